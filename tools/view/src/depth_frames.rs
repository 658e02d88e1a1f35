//! Depths of a flight: one EXR a frame with the channel `Z` in f32, metres along the camera's view axis, +inf where
//! nothing is drawn.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use exr::prelude::{
    Encoding, Image, Layer, LayerAttributes, SpecificChannels, Vec2, WritableImage,
};

/// The file of a frame.
pub(crate) fn file(folder: &Path, index: u32) -> PathBuf {
    folder.join(format!("depth_{index:05}.exr"))
}

/// Writes the metres of a frame, row by row from the top.
pub(crate) fn write(file: &Path, [width, height]: [u32; 2], metres: &[f32]) -> Result<()> {
    let [width, height] = [width as usize, height as usize];
    let channels = SpecificChannels::build()
        .with_channel("Z")
        .with_pixel_fn(|Vec2(x, y)| (metres[y * width + x],));
    let attributes = LayerAttributes::named("depth");
    let layer = Layer::new(
        (width, height),
        attributes,
        Encoding::FAST_LOSSLESS,
        channels,
    );
    Image::from_layer(layer)
        .write()
        .to_file(file)
        .with_context(|| format!("{}: writing failed", file.display()))
}

#[cfg(test)]
mod tests {
    use exr::prelude::{FlatSamples, ReadChannels, ReadLayers, read};

    use super::*;

    #[test]
    fn depths_read_back_bit_by_bit() {
        let path = std::env::temp_dir().join(format!("drumlin-depth-{}.exr", std::process::id()));
        let depths = [1.5, f32::INFINITY, 1.0e-30, 7.0e8, 3.0, 4.0];
        write(&path, [3, 2], &depths).unwrap();
        let reader = read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels();
        let image = reader
            .first_valid_layer()
            .all_attributes()
            .from_file(&path)
            .unwrap();
        let channel = &image.layer_data.channel_data.list[0];
        assert_eq!(channel.name.to_string(), "Z");
        match &channel.sample_data {
            FlatSamples::F32(samples) => assert_eq!(samples.as_slice(), depths),
            other => panic!("{other:?}"),
        }
        std::fs::remove_file(path).unwrap();
    }
}
