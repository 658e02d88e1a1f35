//! Classic against adaptive refinement at the same worst error, on four cages with the counts of the paper's Table 1.
//!
//! ```text
//! cargo run --release -p drumlin-benches --bin table1 -- [--cages FOLDER] [--json FILE] [--pictures FOLDER]
//! ```
//!
//! Based on: Lin, Wang, Sun, *Improved feature-adaptive subdivision for Catmull-Clark surface model* (2018), Table 1.

mod rows;
mod seen;

use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result};
use clap::Parser;
use drumlin_benches::{
    errors::{Errors, blocks_at, depths_within, mean_edge_length},
    measure::{self, Machine, geometric_mean},
    scheme::{self, Scheme},
    terrain_cage::{CageCounts, cage_counts},
};
use drumlin_core::cage::{Cage, CageBudget, read_obj};
use serde::Serialize;

use crate::seen::Seen;

/// The paper's models; the cages have their counts, not their shape.
const NAMES: [&str; 4] = ["hippo", "crocodile", "gorilla", "koala"];

/// Steps along each side of a cap between the places that depths are chosen by.
const STEPS: u32 = 32;
/// The share of the bound that depths are chosen within, as the error may be greater between those places.
const SHARE: f64 = 0.97;
/// Steps between the places at which the error that is printed is measured: other places, but for the corners.
const CHECK_STEPS: u32 = 23;

/// Classic against adaptive refinement at the same worst error.
#[derive(Parser)]
struct Arguments {
    /// Folder with table1_hippo.obj, table1_crocodile.obj, table1_gorilla.obj and table1_koala.obj.
    #[arg(long, default_value = "assets/table1")]
    cages: PathBuf,
    /// Worst error allowed, in mean edge lengths of the cage.
    #[arg(long, default_value_t = 1e-3)]
    bound: f64,
    /// Runs of every step; the median is printed.
    #[arg(long, default_value_t = 15, value_parser = clap::value_parser!(u8).range(1..))]
    runs: u8,
    /// Writes all figures.
    #[arg(long)]
    json: Option<PathBuf>,
    /// Writes the pictures that are compared, as PNG.
    #[arg(long)]
    pictures: Option<PathBuf>,
}

/// Everything, as JSON.
#[derive(Serialize)]
struct Report {
    machine: Machine,
    /// In mean edge lengths.
    bound: f64,
    cages: Vec<Case>,
    /// Geometric mean of classic's total over adaptive's, one thread.
    total_ratio: f64,
}

/// One cage's figures; lengths are the cage's own.
#[derive(Serialize)]
struct Case {
    name: &'static str,
    cage: CageCounts,
    mean_edge_length: f64,
    bound: f64,
    classic: Scheme,
    adaptive: Scheme,
    /// Greatest distance from the limit of both.
    worst_errors: [f64; 2],
    seen: Seen,
}

impl Case {
    /// Classic's total over adaptive's, one thread.
    fn total_ratio(&self) -> f64 {
        self.classic.one_thread.total() / self.adaptive.one_thread.total()
    }
}

fn main() -> Result<()> {
    let arguments = Arguments::parse();
    let cases = NAMES.map(|name| case(name, &arguments).with_context(|| name.to_owned()));
    let cages = cases.into_iter().collect::<Result<Vec<_>>>()?;
    let ratios: Vec<_> = cages.iter().map(Case::total_ratio).collect();
    let report = Report {
        machine: Machine::here(),
        bound: arguments.bound,
        total_ratio: geometric_mean(&ratios),
        cages,
    };
    print!("{}", rows::text(&report));
    if let Some(file) = &arguments.json {
        measure::write_json(file, &report)?;
    }
    Ok(())
}

fn case(name: &'static str, arguments: &Arguments) -> Result<Case> {
    let cage = read(&arguments.cages.join(format!("table1_{name}.obj")))?;
    let mean_edge_length = mean_edge_length(&cage);
    let bound = arguments.bound * mean_edge_length;
    let mut errors = Errors::new(&cage, STEPS)?;
    let depth = errors.classic_depth(SHARE * bound)?;
    let vertices = cage.positions().len();
    let same = || vec![depth; vertices];
    let features = errors.by_feature(&blocks_at(&cage, &same())?, depth);
    let own = || depths_within(SHARE * bound, &features, vertices);
    let mut check = Errors::new(&cage, CHECK_STEPS)?;
    let worst_errors = [check.worst(&same())?, check.worst(&own())?];
    let runs = usize::from(arguments.runs);
    Ok(Case {
        name,
        cage: cage_counts(&cage),
        mean_edge_length,
        bound,
        classic: scheme::measure(&cage, &same, runs)?,
        adaptive: scheme::measure(&cage, &own, runs)?,
        worst_errors,
        seen: Seen::new(name, &cage, arguments.pictures.as_deref())?,
    })
}

fn read(file: &Path) -> Result<Cage> {
    let text = std::fs::read(file).with_context(|| {
        let file = file.display();
        format!("{file}: reading failed; --cages names the folder of the four cages")
    })?;
    read_obj(&text, CageBudget::default()).with_context(|| file.display().to_string())
}
