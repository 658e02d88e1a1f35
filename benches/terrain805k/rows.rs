//! The printed tables, the plot, and what must be known to read them.

use std::fmt::Write as _;

use anyhow::Result;
use drumlin_benches::{
    measure::{Table, Timing, thousands, three_digits},
    plot::{Line, Plot},
    scheme::Scheme,
};

use crate::Report;

/// What is timed and what is not.
const NOTES: &str = "\
* One thread by its own clock. Subdivision: choosing depths, tables from linked ones at depth 0, points in f32. Linking
  the cage, the same for all, is not in it. Drawing: positions and derivatives in f32 at 5 x 5 places of every patch, on
  the processor; no pixels are filled. Nothing is left out for being out of view.
* Equal error everywhere: a cap is off by its greatest distance from the limit along the limit's normal, at 5 x 5 places.
  Adaptive gives each feature the least depth at which its own caps are within what classic leaves at worst, looked up;
  measuring comes before and is not in the time.
* Along the path: depths by `DepthRule::DEFAULT` (half a pixel, triangles of eight) at 1920 x 1080. Classic gives all
  features the depth the rule asks for where it asks for most.
* Tiles: the engine's own, of the same elevation model, at half a pixel of vertical error everywhere, the ground behind
  the camera included. Their error is measured against the elevation model, the cage's against its own limit surface.
  Subdivision is the plan with all tiles there, and the stages depth, balance and emit by their references; drawing
  places every vertex once, without normals. Decoding, once a tile's arrival, is not in the times.
* A step: the watch, the blocks that move, their points. Its rebuild is adaptive's subdivision, the stations' median.
";

/// The whole text.
pub(crate) fn text(report: &Report) -> Result<String> {
    let cage = &report.cage;
    let mut text = format!("{}\n\n", report.machine.line());
    // Writing into a string cannot fail.
    let _ = writeln!(
        text,
        "{} quads, {} of them irregular, {} features, mean edge {} m\n",
        thousands(u64::from(cage.faces)),
        thousands(u64::from(cage.irregular_faces)),
        thousands(u64::from(cage.features)),
        three_digits(report.equal.mean_edge_length),
    );
    let _ = writeln!(text, "Equal error everywhere:\n\n{}", equal(report).text());
    let _ = writeln!(text, "Along the path:\n\n{}", path(report)?.text());
    let _ = writeln!(text, "Tiles:\n\n{}", tiles(report).text());
    let _ = writeln!(text, "A step of the camera:\n\n{}", steps(report).text());
    Ok(text + NOTES)
}

/// Both totals along the path, as the paper's figure 13, and that of the tiles.
pub(crate) fn plot(report: &Report) -> Result<Plot> {
    let mut lines = ["classic", "adaptive", "tiles"].map(|name| Line {
        name: name.to_owned(),
        points: Vec::new(),
    });
    for (seen, tiled) in report.path.seen.iter().zip(&report.tiles) {
        let classic = report.path.classic_at(seen)?.one_thread.total();
        let totals = [classic, seen.adaptive.one_thread.total(), tiled.total()];
        for (line, total) in lines.iter_mut().zip(totals) {
            line.points.push([100.0 * seen.along, 1e3 * total]);
        }
    }
    let quads = thousands(u64::from(report.cage.faces));
    Ok(Plot {
        title: format!("{quads} quads, subdivision and drawing"),
        x_name: "% of the path".to_owned(),
        y_name: "total, ms".to_owned(),
        lines: lines.into(),
    })
}

fn scheme_cells(scheme: &Scheme) -> [String; 8] {
    let times = &scheme.one_thread;
    [
        millis(times.subdivision()),
        millis(times.choosing.median),
        millis(times.drawing.median),
        millis(times.total()),
        millis(scheme.all_threads.total()),
        thousands(scheme.patches),
        thousands(scheme.refined_points),
        thousands(scheme.bytes >> 20),
    ]
}

fn equal(report: &Report) -> Table {
    let mut table = Table::new(&[
        "depths",
        "deepest",
        "worst error, m",
        "subdivision, ms",
        "of it choosing",
        "drawing, ms",
        "total, ms",
        "total, all threads",
        "patches",
        "points",
        "memory, MiB",
        "total over classic's",
    ]);
    let classic = &report.equal.rows[0].scheme;
    for row in &report.equal.rows {
        let names = [
            row.name.to_owned(),
            row.scheme.deepest.to_string(),
            three_digits(row.worst_error),
        ];
        let ratio = row.scheme.one_thread.total() / classic.one_thread.total();
        let cells = names.into_iter().chain(scheme_cells(&row.scheme));
        table.row(cells.chain([three_digits(ratio)]));
    }
    table
}

fn path(report: &Report) -> Result<Table> {
    let mut table = Table::new(&[
        "% of the path",
        "depth",
        "subdivision, ms",
        "of it choosing",
        "drawing, ms",
        "total, ms",
        "total, all threads",
        "patches",
        "points",
        "memory, MiB",
        "classic's total, ms",
        "classic's patches",
        "total over classic's",
    ]);
    let mut ratios = Vec::new();
    for seen in &report.path.seen {
        let classic = report.path.classic_at(seen)?;
        let total = classic.one_thread.total();
        let ratio = seen.adaptive.one_thread.total() / total;
        ratios.push(ratio);
        let names = [three_digits(100.0 * seen.along), seen.depth.to_string()];
        let cells = names.into_iter().chain(scheme_cells(&seen.adaptive));
        let rest = [
            millis(total),
            thousands(classic.patches),
            three_digits(ratio),
        ];
        table.row(cells.chain(rest));
    }
    let Timing {
        median,
        least,
        greatest,
        ..
    } = Timing::of(ratios);
    let spread = [median, least, greatest].map(three_digits).join(", ");
    table.row(["median, least, greatest ratio".to_owned(), spread]);
    Ok(table)
}

fn tiles(report: &Report) -> Table {
    let mut table = Table::new(&[
        "% of the path",
        "error, px",
        "subdivision, ms",
        "drawing, ms",
        "total, ms",
        "tiles",
        "patches",
        "triangles",
        "points",
        "memory, MiB",
    ]);
    for tiled in &report.tiles {
        table.row([
            three_digits(100.0 * tiled.along),
            three_digits(tiled.tolerance_px),
            millis(1e-3 * tiled.planning_millis + tiled.stages.median),
            millis(tiled.drawing.median),
            millis(tiled.total()),
            thousands(tiled.tiles),
            thousands(tiled.patches),
            thousands(tiled.triangles),
            thousands(tiled.points),
            thousands(tiled.bytes >> 20),
        ]);
    }
    table
}

fn steps(report: &Report) -> Table {
    let mut table = Table::new(&[
        "step, m",
        "median, ms",
        "p95",
        "greatest",
        "rebuild",
        "p95 of a rebuild",
        "features",
        "looked at, mean",
        "changed, mean",
    ]);
    for steps in &report.steps {
        table.row([
            steps.metres.to_string(),
            millis(steps.median),
            millis(steps.p95),
            millis(steps.greatest),
            millis(steps.rebuild),
            format!("{} %", three_digits(100.0 * steps.p95 / steps.rebuild)),
            thousands(steps.features as u64),
            three_digits(steps.looked_at),
            three_digits(steps.changed),
        ]);
    }
    table
}

fn millis(seconds: f64) -> String {
    three_digits(1e3 * seconds)
}
