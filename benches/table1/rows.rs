//! The printed table, and what must be known to read it.

use std::fmt::Write as _;

use drumlin_benches::measure::{Table, thousands, three_digits};

use crate::{Case, Report};

/// What is timed and what is not.
const NOTES: &str = "\
* Classic gives all features the least depth whose worst error is within the bound. Adaptive gives each the least depth
  at which its own caps are, looked up in what every feature is off by at each depth; those errors depend on the cage
  alone and are measured before, outside of all times.
* Worst error: greatest distance of caps from the exact limit of their face, at 24 x 24 places each (depths of both
  are chosen to be within 0.97 of the bound at 33 x 33), to the nearest limit point of five on a
  Gauss-Newton search: never less than the true distance there. Other patches are the limit itself. Error and bound
  are in mean edge lengths.
* Subdivision: choosing depths, tables from linked ones at depth 0, points in f32. Not in it: reading and linking the
  cage, the same for both, and measuring the errors, which only adaptive needs.
* Drawing: controls gathered, positions and derivatives in f32 at 5 x 5 places of every patch, on the processor. No
  triangles are put together and no pixels filled.
* Feature patches: those of levels from 2 on, and caps.
* One thread by its own clock, so that other work on the machine does not count; all threads by the clock on the wall.
* The cages have the paper's counts (faces, irregular faces, irregular points), not its models, and the paper's times
  are of another machine: of its columns only the ratio of totals, 1.48 to 2.04, may be set beside ours.
* Pictures: 1080 x 1080 pixels, all of the cage in them; classic at depth 5 beside adaptive by the view-dependent rule
  (`fas::DepthRule`) at half a pixel. FLIP is the mean over the cage's pixels, 0 where equal, 1 at most.
";

/// The whole text.
pub(crate) fn text(report: &Report) -> String {
    let mut text = format!("{}\n\n", report.machine.line());
    text += &table(report).text();
    // Writing into a string cannot fail.
    let _ = write!(text, "\n{}\n", ratios(report).text());
    let _ = writeln!(text, "{}", pictures(report).text());
    let mean = three_digits(report.total_ratio);
    let _ = write!(
        text,
        "geometric mean of classic's total over adaptive's, one thread: {mean}\n\n{NOTES}"
    );
    text
}

fn table(report: &Report) -> Table {
    let mut table = Table::new(&[
        "cage (faces, irregular)",
        "depths",
        "subdivision, ms",
        "of it choosing",
        "drawing, ms",
        "total, ms",
        "total, all threads",
        "patches",
        "feature patches",
        "refined points",
        "worst error",
        "bound",
    ]);
    for case in &report.cages {
        let counts = &case.cage;
        let name = format!(
            "{} ({}, {})",
            case.name, counts.faces, counts.irregular_faces
        );
        let classic = format!("classic, {}", case.classic.deepest);
        table.row(row(case, report.bound, [name, classic], 0));
        let adaptive = format!("adaptive, up to {}", case.adaptive.deepest);
        table.row(row(case, report.bound, [String::new(), adaptive], 1));
    }
    table
}

fn row(case: &Case, bound: f64, names: [String; 2], which: usize) -> Vec<String> {
    let scheme = [&case.classic, &case.adaptive][which];
    let times = &scheme.one_thread;
    let millis = |seconds: f64| three_digits(1e3 * seconds);
    let figures = [
        millis(times.subdivision()),
        millis(times.choosing.median),
        millis(times.drawing.median),
        millis(times.total()),
        millis(scheme.all_threads.total()),
        thousands(scheme.patches),
        thousands(scheme.feature_patches),
        thousands(scheme.refined_points),
        format!("{:.2e}", case.worst_errors[which] / case.mean_edge_length),
        format!("{bound:.0e}"),
    ];
    names.into_iter().chain(figures).collect()
}

/// Classic over adaptive, and what share choosing has.
fn ratios(report: &Report) -> Table {
    let mut table = Table::new(&[
        "classic over adaptive",
        "subdivision",
        "drawing",
        "total",
        "total, all threads",
        "feature patches, adaptive over classic",
        "choosing, share of adaptive's total",
    ]);
    for case in &report.cages {
        let (classic, adaptive) = (&case.classic, &case.adaptive);
        let (theirs, ours) = (&classic.one_thread, &adaptive.one_thread);
        let kept = adaptive.feature_patches as f64 / classic.feature_patches as f64;
        let choosing = 100.0 * ours.choosing.median / ours.total();
        table.row([
            case.name.to_owned(),
            three_digits(theirs.subdivision() / ours.subdivision()),
            three_digits(theirs.drawing.median / ours.drawing.median),
            three_digits(case.total_ratio()),
            three_digits(classic.all_threads.total() / adaptive.all_threads.total()),
            three_digits(kept),
            format!("{} %", three_digits(choosing)),
        ]);
    }
    table
}

/// How far pictures of the two are apart.
fn pictures(report: &Report) -> Table {
    let mut table = Table::new(&[
        "pictures",
        "classic, 5: patches",
        "adaptive, 0.5 px: patches",
        "deepest",
        "FLIP",
    ]);
    for case in &report.cages {
        let [classic, adaptive] = case.seen.patches;
        table.row([
            case.name.to_owned(),
            thousands(classic),
            thousands(adaptive),
            case.seen.deepest.to_string(),
            format!("{:.1e}", case.seen.difference),
        ]);
    }
    table
}
