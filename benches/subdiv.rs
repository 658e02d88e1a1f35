//! Set-up, update and limit evaluation of the terrain cage, beside OpenSubdiv when asked: one thread, one run.
//!
//! ```text
//! cargo run --release -p drumlin-benches --bin subdiv -- --dem FILE [--peers] [--json FILE]
//! ```

#![expect(
    clippy::cast_possible_truncation,
    reason = "positions of experiments are rounded to f32 on purpose"
)]

use std::path::PathBuf;

use anyhow::{Context as _, Result};
use clap::Parser;
use drumlin_benches::{
    heights::Heights,
    measure::{self, Machine, Table, Timing, thousands, thread_median_of, three_digits},
    peer::{self, PeerFigures, PeerOrder},
    terrain_cage::{CageCounts, PAPER_QUADS, cage_counts, sharpest_edges, terrain_cage},
};
use drumlin_core::{
    cage::{Cage, Crease, LimitPattern, Tags},
    fas::{Blocks, Positions},
};
use serde::Serialize;

/// Set-up, update and limit evaluation on one thread.
#[derive(Parser)]
struct Arguments {
    /// Elevation model the cage is made of, without voids.
    #[arg(long)]
    dem: PathBuf,
    /// Quads of the cage.
    #[arg(long, default_value_t = PAPER_QUADS)]
    quads: u64,
    /// Depth of every feature.
    #[arg(long, default_value_t = 2)]
    depth: u8,
    /// Places along each side of a face at which the limit is evaluated.
    #[arg(long, default_value_t = 4)]
    places: u8,
    /// Runs of every step; the median is printed.
    #[arg(long, default_value_t = 3)]
    runs: usize,
    /// Also builds and runs OpenSubdiv (needs g++ and libosd-dev).
    #[arg(long)]
    peers: bool,
    /// Writes all figures.
    #[arg(long)]
    json: Option<PathBuf>,
}

/// Everything, as JSON.
#[derive(Serialize)]
struct Report {
    machine: Machine,
    cage: CageCounts,
    depth: u8,
    smooth: Case,
    creased: Case,
}

/// One cage's figures.
#[derive(Serialize)]
struct Case {
    creases: usize,
    ours: Ours,
    /// The greatest distance of our f32 limit positions from f64 ones, over the cage's extent.
    f32_error: f64,
    open_subdiv: Option<PeerFigures>,
    /// The median and the greatest distance between both limit positions, over the cage's extent.
    peer_distance: Option<[f64; 2]>,
}

/// Our own times.
#[derive(Serialize)]
struct Ours {
    link: Timing,
    tables: Timing,
    update: Timing,
    stencils: Timing,
    positions: Timing,
    derivatives: Timing,
    table_bytes: u64,
    link_bytes: u64,
    refined_points: u64,
    patches: u64,
    places: u64,
}

fn main() -> Result<()> {
    let arguments = Arguments::parse();
    let heights = Heights::read(&arguments.dem)?;
    let cage = terrain_cage(&heights, arguments.quads)?;
    drop(heights);
    let report = measure::with_threads(1, || report(&cage, &arguments))??;
    print(&report);
    if let Some(file) = &arguments.json {
        measure::write_json(file, &report)?;
    }
    Ok(())
}

fn report(cage: &Cage, arguments: &Arguments) -> Result<Report> {
    Ok(Report {
        machine: Machine::here(),
        cage: cage_counts(cage),
        depth: arguments.depth,
        smooth: case(cage, &[], arguments)?,
        creased: case(cage, &sharpest_edges(cage), arguments)?,
    })
}

fn case(cage: &Cage, creases: &[Crease], arguments: &Arguments) -> Result<Case> {
    let places = middles(arguments.places);
    let (ours, positions, f32_error) = ours(cage, creases, &places, arguments)?;
    let order = PeerOrder {
        depth: arguments.depth,
        places: arguments.places,
        runs: arguments.runs,
    };
    let peer = if arguments.peers {
        Some(peer::open_subdiv(cage, creases, order)?)
    } else {
        None
    };
    let (open_subdiv, theirs) = peer.unzip();
    Ok(Case {
        creases: creases.len(),
        ours,
        f32_error,
        open_subdiv,
        peer_distance: theirs.map(|theirs| spread(&distances(&positions, &theirs, cage.extent()))),
    })
}

/// Places in the middles of a face's squares, row by row.
fn middles(count: u8) -> Vec<[f64; 2]> {
    let middle = |index: u8| (f64::from(index) + 0.5) / f64::from(count);
    (0..count)
        .flat_map(|v| (0..count).map(move |u| [middle(u), middle(v)]))
        .collect()
}

/// Our figures, our limit positions and how far f32 ones are off.
fn ours(
    cage: &Cage,
    creases: &[Crease],
    places: &[[f64; 2]],
    arguments: &Arguments,
) -> Result<(Ours, Vec<[f32; 3]>, f64)> {
    let runs = arguments.runs;
    let tags = Tags {
        creases: creases.to_vec(),
        ..Tags::default()
    };
    let faces = cage.topology().faces();
    let narrow: Vec<_> = cage
        .positions()
        .iter()
        .map(|at| at.map(|x| x as f32))
        .collect();
    // What linking takes over is copied before it is timed.
    let mut copies: Vec<_> = (0..=runs)
        .map(|_| (cage.positions().to_vec(), faces.clone()))
        .collect();
    let (link, linked) = thread_median_of(runs, || {
        let (positions, faces) = copies.pop().context("a copy a run")?;
        Cage::new(positions, faces, &tags).context("linking the cage")
    });
    let topology = linked?.topology().clone();
    let depths = vec![arguments.depth; topology.vertex_count() as usize];
    let (tables_time, tables) = thread_median_of(runs, || {
        let mut blocks = Blocks::new(&topology)?;
        blocks.set_depths(&depths).map(|_| blocks)
    });
    let tables = tables.map_err(anyhow::Error::msg)?;
    let mut points = Positions::new(&tables, &narrow);
    let (update, ()) = thread_median_of(runs, || points.execute(&tables, &narrow));
    let (stencils, pattern) =
        thread_median_of(runs, || LimitPattern::<f32>::new(&topology, places));
    let pattern = pattern?;
    let place_count = topology.face_count() as usize * places.len();
    let mut out = [0, 1, 2].map(|_| vec![[0.0_f32; 3]; place_count]);
    let [at, du, dv] = &mut out;
    let (derivatives, ()) = thread_median_of(runs, || pattern.jets_into(&narrow, [at, du, dv]));
    let (positions, ()) = thread_median_of(runs, || pattern.positions_into(&narrow, at));
    let exact = LimitPattern::<f64>::new(&topology, places)?.positions(cage.positions());
    let exact: Vec<_> = exact.iter().map(|at| at.map(|x| x as f32)).collect();
    let off = spread(&distances(at, &exact, cage.extent()))[1];
    let ours = Ours {
        link,
        tables: tables_time,
        update,
        stencils,
        positions,
        derivatives,
        table_bytes: tables.byte_count() as u64,
        link_bytes: topology.byte_count() as u64,
        refined_points: u64::from(tables.refined_point_count()),
        patches: u64::from(tables.patch_count()),
        places: place_count as u64,
    };
    let [at, ..] = out;
    Ok((ours, at, off))
}

/// Distances of points by twos, over an extent.
fn distances(a: &[[f32; 3]], b: &[[f32; 3]], extent: f64) -> Vec<f64> {
    let distance = |(a, b): (&[f32; 3], &[f32; 3])| {
        let squares = (0..3).map(|axis| (f64::from(a[axis]) - f64::from(b[axis])).powi(2));
        squares.sum::<f64>().sqrt() / extent
    };
    a.iter().zip(b).map(distance).collect()
}

/// The median and the greatest; zeros of none.
fn spread(values: &[f64]) -> [f64; 2] {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    [sorted.len() / 2, sorted.len().saturating_sub(1)]
        .map(|at| sorted.get(at).copied().unwrap_or(0.0))
}

fn print(report: &Report) {
    let CageCounts {
        faces,
        irregular_faces,
        ..
    } = report.cage;
    println!("{}", report.machine.line());
    println!(
        "{} quads, {} of them irregular, depth {}, one thread\n",
        thousands(u64::from(faces)),
        thousands(u64::from(irregular_faces)),
        report.depth
    );
    for case in [&report.smooth, &report.creased] {
        println!("{} creases", thousands(case.creases as u64));
        println!("{}", table(case, f64::from(faces)).text());
        println!(
            "our f32 limit positions off by {:.1e} of the extent at most",
            case.f32_error
        );
        if let Some([median, greatest]) = case.peer_distance {
            println!(
                "distance between both: median {median:.1e} of the extent, greatest {greatest:.1e}"
            );
        }
        println!();
    }
}

/// One row a step: ours, OpenSubdiv's, how many times faster we are.
fn table(case: &Case, faces: f64) -> Table {
    let ours = &case.ours;
    let set_up = ours.link.median + ours.tables.median;
    let peer = case.open_subdiv.as_ref();
    let seconds = |runs: fn(&PeerFigures) -> &Vec<f64>| {
        peer.map(|peer| Timing::of(runs(peer).clone()).median)
    };
    let both = |a: Option<f64>, b: Option<f64>| a.zip(b).map(|(a, b)| a + b);
    let their_topology = both(
        seconds(|peer| &peer.refiner),
        seconds(|peer| &peer.adaptive),
    );
    let update = seconds(|peer| &peer.update_primvar);
    let by_stencils = seconds(|peer| &peer.update_stencils);
    let least_update = update.zip(by_stencils).map(|(a, b)| a.min(b));
    let first_points = both(their_topology, update);
    let with_patches = both(first_points, seconds(|peer| &peer.patch_table));
    let with_stencils = both(with_patches, seconds(|peer| &peer.stencil_table));
    let mut table = Table::new(&["step", "ours", "OpenSubdiv", "times faster"]);
    let first = set_up + ours.update.median;
    for (name, ours, theirs) in [
        (
            "to first points (ours with patches), s",
            first,
            first_points,
        ),
        ("to first points with patches, s", first, with_patches),
        (
            "to first points with patches and stencils, s",
            first,
            with_stencils,
        ),
        ("update, the best way, s", ours.update.median, least_update),
    ] {
        let ratio = theirs.map(|theirs| theirs / ours);
        table.row(cells(name, ours, theirs, ratio));
    }
    let millions = |timing: &Timing| 1e-6 * timing.rate(ours.places);
    let their_millions = |time: Option<f64>| {
        peer.zip(time)
            .map(|(peer, time)| 1e-6 * peer.places as f64 / time)
    };
    for (name, ours, theirs) in [
        (
            "set-up, Mfaces/s",
            1e-6 * faces / set_up,
            both(their_topology, seconds(|peer| &peer.patch_table)).map(|time| 1e-6 * faces / time),
        ),
        (
            "limit positions, Mpoints/s",
            millions(&ours.positions),
            their_millions(seconds(|peer| &peer.positions)),
        ),
        (
            "limit derivatives too, Mpoints/s",
            millions(&ours.derivatives),
            their_millions(seconds(|peer| &peer.derivatives)),
        ),
    ] {
        table.row(cells(
            name,
            ours,
            theirs,
            theirs.map(|theirs| ours / theirs),
        ));
    }
    let bytes = peer.map(|peer| {
        (peer.refiner_bytes + peer.patch_table_bytes + peer.stencil_table_bytes) as f64 / faces
    });
    let our_bytes = (ours.table_bytes + ours.link_bytes) as f64 / faces;
    table.row(cells(
        "tables, bytes a face",
        ours.table_bytes as f64 / faces,
        None,
        None,
    ));
    table.row(cells(
        "all, bytes a face",
        our_bytes,
        bytes,
        bytes.map(|bytes| bytes / our_bytes),
    ));
    table
}

fn cells(name: &str, ours: f64, theirs: Option<f64>, ratio: Option<f64>) -> [String; 4] {
    let text = |value: Option<f64>| value.map(three_digits).unwrap_or_default();
    [
        name.to_owned(),
        three_digits(ours),
        text(theirs),
        text(ratio),
    ]
}
