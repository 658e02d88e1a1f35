//! Running OpenSubdiv beside us: builds the harness in `peers/` where that is asked for, hands it a cage, reads its
//! figures.
//!
//! Nothing else of the workspace knows that there is a C++ compiler. On Debian and Ubuntu `apt install g++ libosd-dev`
//! brings what is needed.

use std::{
    fs,
    io::Write as _,
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::{Context as _, Result, bail};
use drumlin_core::cage::{Cage, Crease};
use serde::{Deserialize, Serialize};

/// What the harness is asked for.
#[derive(Clone, Copy, Debug)]
pub struct PeerOrder {
    /// Isolation depth.
    pub depth: u8,
    /// Places along each side of a face, in the middles of its squares.
    pub places: u8,
    /// Runs of every step.
    pub runs: u8,
}

/// The harness's figures: seconds of every run, bytes and counts.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PeerFigures {
    /// Linking the cage.
    pub refiner: Vec<f64>,
    /// Refining its topology.
    pub adaptive: Vec<f64>,
    /// Making the patches.
    pub patch_table: Vec<f64>,
    /// Making the stencils of all points.
    pub stencil_table: Vec<f64>,
    /// Points level by level.
    pub update_primvar: Vec<f64>,
    /// Points by stencils.
    pub update_stencils: Vec<f64>,
    /// Finding the patches of all places.
    pub find: Vec<f64>,
    /// Limit positions.
    pub positions: Vec<f64>,
    /// Limit positions and derivatives.
    pub derivatives: Vec<f64>,
    /// Bytes of the refined topology.
    pub refiner_bytes: u64,
    /// Bytes of the patches.
    pub patch_table_bytes: u64,
    /// Bytes of the stencils.
    pub stencil_table_bytes: u64,
    /// Points made by refinement.
    pub refined_points: u64,
    /// Patches.
    pub patches: u64,
    /// Places evaluated.
    pub places: u64,
}

/// Builds and runs the harness on a cage of quads; its figures, and the limit positions face by face.
///
/// # Errors
/// No compiler, no OpenSubdiv, or a harness that failed, with what it said.
pub fn open_subdiv(
    cage: &Cage,
    creases: &[Crease],
    order: PeerOrder,
) -> Result<(PeerFigures, Vec<[f32; 3]>)> {
    let folder = folder()?;
    let [harness, input, output] =
        ["opensubdiv", "cage.bin", "positions.bin"].map(|name| folder.join(name));
    build(&harness)?;
    write_cage(&input, cage, creases)
        .with_context(|| format!("{}: writing failed", input.display()))?;
    let numbers = [
        order.depth.to_string(),
        order.places.to_string(),
        order.runs.to_string(),
    ];
    let run = Command::new(&harness)
        .arg(&input)
        .args(&numbers)
        .arg(&output)
        .output()
        .with_context(|| format!("{}: starting failed", harness.display()))?;
    if !run.status.success() {
        bail!(
            "OpenSubdiv's harness failed ({}): {}",
            run.status,
            text(&run.stderr)
        );
    }
    let figures = serde_json::from_slice(&run.stdout).context("reading the harness's figures")?;
    let bytes =
        fs::read(&output).with_context(|| format!("{}: reading failed", output.display()))?;
    let (numbers, _) = bytes.as_chunks::<4>();
    let numbers: Vec<f32> = numbers
        .iter()
        .map(|bytes| f32::from_le_bytes(*bytes))
        .collect();
    let (points, _) = numbers.as_chunks::<3>();
    Ok((figures, points.to_vec()))
}

/// Beside this binary, where builds go.
fn folder() -> Result<PathBuf> {
    let own = std::env::current_exe().context("finding this binary")?;
    let folder = own.with_file_name("peers");
    fs::create_dir_all(&folder).with_context(|| format!("{}: making failed", folder.display()))?;
    Ok(folder)
}

fn build(harness: &Path) -> Result<()> {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("peers/opensubdiv.cpp");
    let compiler = std::env::var_os("CXX").unwrap_or_else(|| "g++".into());
    let run = Command::new(&compiler)
        .args(["-std=c++17", "-O3", "-o"])
        .arg(harness)
        .arg(&source)
        .arg("-losdCPU")
        .output()
        .with_context(|| {
            format!(
                "{}: starting failed; try: apt install g++",
                compiler.display()
            )
        })?;
    if !run.status.success() {
        bail!(
            "building OpenSubdiv's harness failed (is libosd-dev installed?): {}",
            text(&run.stderr)
        );
    }
    Ok(())
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).trim().to_owned()
}

/// The layout is described at the head of the harness.
fn write_cage(file: &Path, cage: &Cage, creases: &[Crease]) -> std::io::Result<()> {
    let topology = cage.topology();
    let mut out = std::io::BufWriter::new(fs::File::create(file)?);
    let counts = [
        topology.vertex_count(),
        topology.face_count(),
        creases.len() as u32,
    ];
    for count in counts {
        out.write_all(&count.to_le_bytes())?;
    }
    for part in cage.positions().as_flattened() {
        out.write_all(&(*part as f32).to_le_bytes())?;
    }
    let ends = creases.iter().flat_map(|crease| &crease.vertices);
    for vertex in topology.faces().list().iter().chain(ends) {
        out.write_all(&vertex.to_le_bytes())?;
    }
    for crease in creases {
        out.write_all(&(crease.sharpness as f32).to_le_bytes())?;
    }
    out.flush()
}
