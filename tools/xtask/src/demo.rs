//! `cargo demo`: Mt Rainier from the elevation model to the screen.

use anyhow::Result;

use crate::{
    setup,
    step::{cargo, command, program, root, run},
};

const PYRAMID: &str = "demo/rainier.zarr";

/// Builds the pyramid and flies it, in a window where there is a display, else into pictures.
pub(crate) fn fly() -> Result<()> {
    run(
        "building the programs",
        &mut cargo("build --release --package drumlin-cli --package drumlin-view"),
    )?;
    setup::adapter("release")?;
    std::fs::create_dir_all(root().join("demo"))?;
    drumlin(
        "building the pyramid of Mt Rainier",
        &[
            "build",
            "assets/mt_rainier_90m.tif",
            "-o",
            PYRAMID,
            "--overwrite",
            "--features",
            "assets/rainier_arch.obj",
            "assets/rainier_cliff.obj",
            "assets/rainier_road.obj",
        ],
    )?;
    if !has_display() {
        return pictures();
    }
    eprintln!(
        "WASD and mouse to fly, wheel for speed, P plays the path, F3 wireframe, F4 depths, F2 screenshot"
    );
    let window = drumlin(
        "opening a window",
        &["view", PYRAMID, "--path", "assets/rainier_flight.json"],
    );
    window.or_else(|error| {
        eprintln!("{error:#}; making pictures instead");
        pictures()
    })
}

fn pictures() -> Result<()> {
    let frames = root().join("demo/frames");
    if frames.exists() {
        std::fs::remove_dir_all(&frames)?;
    }
    let arguments = [
        "fly",
        PYRAMID,
        "--path",
        "assets/rainier_flight.json",
        "--size",
        "1280x720",
        "--fps",
        "10",
        "--wait-for-tiles",
        "--frames",
        "demo/frames",
        "--contact-sheet",
        "demo/contact.png",
        "--report",
        "demo/report.json",
    ];
    drumlin("flying", &arguments)?;
    let demo = root().join("demo");
    println!("pyramid        {}", demo.join("rainier.zarr").display());
    println!("frames         {}", frames.display());
    println!("contact sheet  {}", demo.join("contact.png").display());
    println!("report         {}", demo.join("report.json").display());
    Ok(())
}

fn drumlin(name: &str, arguments: &[&str]) -> Result<()> {
    run(name, &mut command(program("release", "drumlin"), arguments))
}

fn has_display() -> bool {
    let set = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    !cfg!(target_os = "linux") || set("DISPLAY") || set("WAYLAND_DISPLAY")
}
