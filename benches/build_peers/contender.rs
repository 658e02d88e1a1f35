//! Who takes part: command lines, and what they leave.

use std::{
    fs,
    io::ErrorKind,
    path::{Path, PathBuf},
};

use anyhow::{Context as _, Result, ensure};

use super::{Arguments, bytes_at};

/// One way to build.
pub(crate) struct Contender {
    pub(crate) name: String,
    pub(crate) command: Vec<String>,
    /// What it leaves; none where it only reads.
    output: Option<PathBuf>,
}

impl Contender {
    pub(crate) fn remove_output(&self) -> Result<()> {
        let Some(path) = &self.output else {
            return Ok(());
        };
        let removed = if path.is_dir() {
            fs::remove_dir_all(path)
        } else {
            fs::remove_file(path)
        };
        match removed {
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
            other => other.with_context(|| format!("{}: removing failed", path.display())),
        }
    }

    pub(crate) fn output_bytes(&self) -> Result<u64> {
        self.output.as_deref().map_or(Ok(0), bytes_at)
    }
}

/// All of them, in the order of the table.
pub(crate) fn contenders(arguments: &Arguments, raster: &Path) -> Result<Vec<Contender>> {
    let own = std::env::current_exe().context("finding this binary")?;
    let drumlin = own.with_file_name(format!("drumlin{}", std::env::consts::EXE_SUFFIX));
    ensure!(
        drumlin.exists(),
        "{}: is missing; `cargo build --release -p drumlin-cli` makes it",
        drumlin.display()
    );
    let Arguments { eps, threads, .. } = arguments;
    let [raster, drumlin] = [raster, &drumlin].map(|path| path.display().to_string());
    let out = |name: &str| arguments.folder.join(name);
    let contender = |name: &str, command: String, output: Option<PathBuf>| Contender {
        name: name.into(),
        command: command.split_whitespace().map(Into::into).collect(),
        output,
    };
    let cog = |name: &str, cache: &str, options: &str| {
        let output = out("cog.tif");
        let common = format!(
            "-q -of COG -co NUM_THREADS={threads} -co RESAMPLING=AVERAGE -co BIGTIFF=IF_SAFER"
        );
        contender(
            name,
            format!(
                "gdal_translate {common} {cache} {options} {raster} {}",
                output.display()
            ),
            Some(output),
        )
    };
    let pyramid = |name: &str, options: &str| {
        let output = out("out.zarr");
        contender(
            name,
            format!(
                "{drumlin} build {raster} -o {} --eps {eps} -j {threads} {options}",
                output.display()
            ),
            Some(output),
        )
    };
    let lerc = format!("-co COMPRESS=LERC_ZSTD -co MAX_Z_ERROR={eps}");
    Ok(vec![
        contender(
            "GDAL: read the raster (`gdalinfo -checksum`)",
            format!("gdalinfo -checksum {raster}"),
            None,
        ),
        contender(
            "GDAL: overviews only (`gdaladdo -r average`)",
            format!("gdaladdo -q -ro -r average --config GDAL_NUM_THREADS {threads} {raster}"),
            Some(format!("{raster}.ovr").into()),
        ),
        cog(
            "GDAL: COG, ZSTD level 1",
            "",
            "-co COMPRESS=ZSTD -co LEVEL=1 -co PREDICTOR=YES",
        ),
        cog(&format!("GDAL: COG, LERC_ZSTD {eps} m"), "", &lerc),
        cog(
            "GDAL: the same, GDAL_CACHEMAX=64",
            "--config GDAL_CACHEMAX 64",
            &lerc,
        ),
        pyramid(&format!("Drumlin, {eps} m, all levels"), ""),
        pyramid("Drumlin, --memory-budget 256MB", "--memory-budget 256MB"),
    ])
}
