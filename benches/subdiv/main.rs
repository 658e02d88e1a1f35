//! Set-up, update and limit evaluation of the terrain cage, beside OpenSubdiv when asked: one thread, one run.
//!
//! ```text
//! cargo run --release -p drumlin-benches --bin subdiv -- --dem FILE [--peers] [--json FILE]
//! ```

#![expect(
    clippy::cast_possible_truncation,
    reason = "positions of experiments are rounded to f32 on purpose"
)]

mod compare;
mod ours;
mod rows;

use std::path::PathBuf;

use anyhow::Result;
use clap::Parser;
use drumlin_benches::{
    heights::Heights,
    measure::{self, Machine, thousands},
    peer::{self, PeerFigures, PeerOrder},
    terrain_cage::{CageCounts, PAPER_QUADS, cage_counts, sharpest_edges, terrain_cage},
};
use drumlin_core::cage::{Cage, Crease};
use serde::Serialize;

use self::{
    compare::{Spread, distances},
    ours::Ours,
};

/// Set-up, update and limit evaluation on one thread.
#[derive(Parser)]
struct Arguments {
    /// Elevation model the cage is made of; voids are filled.
    #[arg(long)]
    dem: PathBuf,
    /// Quads of the cage.
    #[arg(long, default_value_t = PAPER_QUADS)]
    quads: u64,
    /// Depth of every feature.
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u8).range(1..=10))]
    depth: u8,
    /// Places along each side of a face at which the limit is evaluated.
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u8).range(1..=16))]
    places: u8,
    /// Runs of every step; the median is printed.
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u8).range(1..))]
    runs: u8,
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
    open_subdiv: Option<PeerFigures>,
    /// Between both limit positions, over the cage's extent.
    peer_distance: Option<Spread>,
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
    let (ours, positions) = ours::measure(cage, creases, arguments)?;
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
        open_subdiv,
        peer_distance: theirs
            .map(|theirs| Spread::of(distances(&positions, &theirs, cage.extent()))),
    })
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
        println!("{} creases\n", thousands(case.creases as u64));
        print!("{}", rows::table(case, f64::from(faces)).text());
        println!(
            "\nour f32 limit positions from f64 ones, over the extent: {}",
            case.ours.f32_distance
        );
        if let Some(distance) = case.peer_distance {
            println!("OpenSubdiv's from ours, over the extent: {distance}");
        }
        println!();
    }
}
