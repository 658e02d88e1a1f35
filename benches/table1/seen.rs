//! What both ways look like: their pictures, and how far they are apart.

use std::path::Path;

use anyhow::{Context as _, Result};
use drumlin_benches::{
    errors::blocks_at,
    picture::{self, Camera},
};
use drumlin_core::{
    cage::Cage,
    fas::{DepthRule, Features},
};
use serde::Serialize;

/// Pixels of a side of the pictures.
const SIZE: u32 = 1080;
/// Classic's depth in the picture.
const CLASSIC_DEPTH: u8 = 5;

/// Classic at one depth beside adaptive at half a pixel.
#[derive(Serialize)]
pub(crate) struct Seen {
    /// Patches of classic and of adaptive.
    pub(crate) patches: [u64; 2],
    /// Adaptive's greatest depth.
    pub(crate) deepest: u8,
    /// Mean of FLIP between the pictures.
    pub(crate) difference: f64,
}

impl Seen {
    /// Draws and compares; the pictures are written where there is a folder for them.
    pub(crate) fn new(name: &str, cage: &Cage, folder: Option<&Path>) -> Result<Self> {
        let camera = Camera::before(cage, SIZE);
        let features = Features::of(cage);
        let own = features.depths(
            camera.eye(),
            camera.pixels_per_radian(),
            DepthRule::DEFAULT,
            &[],
        );
        let depths = [vec![CLASSIC_DEPTH; own.len()], own];
        let draw = |depths: &Vec<u8>| picture::draw(cage, depths, &camera);
        let pictures = [draw(&depths[0])?, draw(&depths[1])?];
        if let Some(folder) = folder {
            std::fs::create_dir_all(folder)
                .with_context(|| format!("{}: making it failed", folder.display()))?;
            for (picture, way) in pictures.iter().zip(["classic", "adaptive"]) {
                picture::save(picture, &folder.join(format!("{name}_{way}.png")))?;
            }
        }
        let count = |depths: &Vec<u8>| -> Result<u64> {
            let mut patches = 0;
            blocks_at(cage, depths)?.visit(|_| patches += 1);
            Ok(patches)
        };
        Ok(Self {
            patches: [count(&depths[0])?, count(&depths[1])?],
            deepest: depths[1].iter().copied().max().unwrap_or(0),
            difference: picture::mean_difference(&pictures[0], &pictures[1])?,
        })
    }
}
