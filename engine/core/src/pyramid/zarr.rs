//! The profile's `zarr.json` files: groups, arrays, and the root's attributes.
//!
//! Knows JSON and shapes; knows no file. Based on the Zarr core specification 3.1 and its sharding codec, version 1.0.

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

use super::{
    COLOR_TEXELS, ColorCodec, ColorMetadata, FeatureMetadata, Metadata, RecordLayout,
    shard::shard_shape,
};

/// What a root's attributes say in `profile`.
const PROFILE: &str = "drumlin";
/// The root's file name, and every other node's.
pub(super) const NODE: &str = "zarr.json";
/// Bytes beyond which the features of a tile are not written or read.
pub(super) const FEATURE_BYTES_LIMIT: u32 = 256 << 20;
/// Bytes beyond which a root is not read.
pub(super) const ROOT_LIMIT_BYTES: u64 = 16 << 20;

/// The attributes of the root: the metadata, and what other tools look for.
#[derive(Serialize, Deserialize)]
struct RootAttributes {
    profile: String,
    #[serde(rename = "proj:code", skip_serializing_if = "Option::is_none")]
    proj_code: Option<String>,
    #[serde(flatten)]
    metadata: Metadata,
    height_unit_metres: f64,
}

/// The root's `zarr.json`.
pub(super) fn root_json(metadata: &Metadata) -> Result<Vec<u8>, serde_json::Error> {
    let attributes = RootAttributes {
        profile: PROFILE.into(),
        proj_code: metadata.crs.code.clone(),
        metadata: metadata.clone(),
        height_unit_metres: metadata.unit(),
    };
    let node = json!({"zarr_format": 3, "node_type": "group", "attributes": serde_json::to_value(attributes)?});
    serde_json::to_vec_pretty(&node)
}

/// The files of all nodes but the root, and what is in them.
pub(super) fn nodes(metadata: &Metadata) -> Vec<(String, Vec<u8>)> {
    let grid = &metadata.grid;
    let mut nodes = vec![("tile".into(), group_json())];
    for (index, level) in metadata.levels.iter().enumerate() {
        let array = tile_array_json(level.tiles, &RecordLayout::new(level));
        nodes.push((format!("tile/{index}"), array));
    }
    if let Some(features) = &metadata.features {
        let array = feature_array_json(grid.tiles(features.level), features);
        nodes.push(("feature".into(), group_json()));
        nodes.push((format!("feature/{}", features.level), array));
    }
    if let Some(color) = &metadata.color {
        nodes.extend(color_nodes(metadata, color));
    }
    let file = |(name, text)| (format!("{name}/{NODE}"), text);
    nodes.into_iter().map(file).collect()
}

/// The `zarr.json` of a group without attributes.
fn group_json() -> Vec<u8> {
    text(&json!({"zarr_format": 3, "node_type": "group", "attributes": {}}))
}

/// The `zarr.json` of a level's records: `[rows, columns, bytes]`, one record a chunk.
fn tile_array_json(tiles: [u32; 2], layout: &RecordLayout) -> Vec<u8> {
    let names = ["row", "column", "byte"];
    array_json(tiles, &[layout.byte_count()], &names, 0, &zstd_codecs())
}

/// All nodes of the imagery: names and texts.
fn color_nodes(metadata: &Metadata, color: &ColorMetadata) -> Vec<(String, Vec<u8>)> {
    let tiles = |level| metadata.grid.tiles(level);
    let mut nodes = vec![("color".into(), group_json())];
    nodes.extend((0..color.levels).map(|level| {
        let text = color_array_json(tiles(level), color.codec);
        (format!("color/{level}"), text)
    }));
    if color.codec != ColorCodec::Zstd {
        nodes.push(("alpha".into(), group_json()));
        nodes.extend(
            (0..color.levels)
                .map(|level| (format!("alpha/{level}"), alpha_array_json(tiles(level)))),
        );
    }
    nodes
}

/// The `zarr.json` of a level's imagery: `[rows, columns, 256, 256, 4 or 3]`, one tile a chunk.
fn color_array_json(tiles: [u32; 2], codec: ColorCodec) -> Vec<u8> {
    let (name, channels, codecs) = match codec {
        ColorCodec::Zstd => ("rgba", 4, zstd_codecs()),
        ColorCodec::Jpeg { quality } => {
            let jpeg = json!({"name": "imagecodecs_jpeg", "configuration": {"level": quality}});
            ("rgb", 3, json!([jpeg, {"name": "crc32c"}]))
        }
    };
    let names = ["row", "column", "texel_row", "texel_column", name];
    array_json(
        tiles,
        &[COLOR_TEXELS, COLOR_TEXELS, channels],
        &names,
        0,
        &codecs,
    )
}

/// The `zarr.json` of a level's alpha, where imagery is stored without: `[rows, columns, 256, 256]`, one tile a chunk,
/// opaque where there is none.
fn alpha_array_json(tiles: [u32; 2]) -> Vec<u8> {
    let names = ["row", "column", "texel_row", "texel_column"];
    array_json(
        tiles,
        &[COLOR_TEXELS, COLOR_TEXELS],
        &names,
        u8::MAX,
        &zstd_codecs(),
    )
}

/// The `zarr.json` of the features' records: `[rows, columns, bytes]`, one record a chunk.
fn feature_array_json(tiles: [u32; 2], features: &FeatureMetadata) -> Vec<u8> {
    let bytes = features.record_bytes as usize;
    array_json(
        tiles,
        &[bytes],
        &["row", "column", "byte"],
        0,
        &zstd_codecs(),
    )
}

/// The file of a shard of `array`, as `tile/5`; `inner_dimensions` are those inside a chunk.
pub(super) fn shard_key(array: &str, shard: [u32; 2], inner_dimensions: usize) -> String {
    format!(
        "{array}/c/{}/{}{}",
        shard[0],
        shard[1],
        "/0".repeat(inner_dimensions)
    )
}

/// Bytes as they are, compressed.
fn zstd_codecs() -> Value {
    json!([
        {"name": "bytes"},
        {"name": "zstd", "configuration": {"level": super::shard::ZSTD_LEVEL, "checksum": false}},
        {"name": "crc32c"},
    ])
}

/// An array of bytes in shards of at most 32 × 32 chunks.
fn array_json(
    tiles: [u32; 2],
    inner: &[usize],
    names: &[&str],
    fill: u8,
    codecs: &Value,
) -> Vec<u8> {
    let shape = |outer: [u32; 2]| -> Vec<usize> {
        outer
            .iter()
            .map(|&side| side as usize)
            .chain(inner.iter().copied())
            .collect()
    };
    text(&json!({
        "zarr_format": 3,
        "node_type": "array",
        "shape": shape(tiles),
        "data_type": "uint8",
        "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": shape(shard_shape(tiles))}},
        "chunk_key_encoding": {"name": "default", "configuration": {"separator": "/"}},
        "fill_value": fill,
        "codecs": [{"name": "sharding_indexed", "configuration": {
            "chunk_shape": shape([1, 1]),
            "codecs": codecs,
            "index_codecs": [{"name": "bytes", "configuration": {"endian": "little"}}, {"name": "crc32c"}],
            "index_location": "start",
        }}],
        "dimension_names": names,
        "attributes": {},
    }))
}

fn text(node: &Value) -> Vec<u8> {
    format!("{node:#}").into_bytes()
}

/// True for the text of a pyramid's root, of whatever version.
pub(super) fn is_root(bytes: &[u8]) -> bool {
    serde_json::from_slice::<Value>(bytes)
        .is_ok_and(|node| node["attributes"]["profile"] == PROFILE)
}

/// The metadata in a root's `zarr.json`, checked; an error says in words what is wrong.
pub(super) fn parse_root(bytes: &[u8]) -> Result<Metadata, String> {
    let mut node: Map<String, Value> = serde_json::from_slice(bytes)
        .map_err(|error| format!("not the JSON of a Zarr node: {error}"))?;
    if node.get("zarr_format") != Some(&json!(3)) || node.get("node_type") != Some(&json!("group"))
    {
        return Err("not a Zarr version 3 group".into());
    }
    let attributes = node.remove("attributes").unwrap_or_default();
    if attributes["profile"] != PROFILE {
        return Err("a Zarr group, but not a Drumlin pyramid".into());
    }
    let version = &attributes["version"];
    if *version != Metadata::VERSION {
        return Err(format!(
            "version {version} of the profile; this program reads {}",
            Metadata::VERSION
        ));
    }
    let attributes: RootAttributes = serde_json::from_value(attributes)
        .map_err(|error| format!("the pyramid's attributes: {error}"))?;
    check(&attributes.metadata)?;
    Ok(attributes.metadata)
}

/// What is always true of metadata.
pub(super) fn check(metadata: &Metadata) -> Result<(), String> {
    let grid = &metadata.grid;
    let [x, y] = grid.step;
    if grid.columns == 0 || grid.rows == 0 {
        return Err(format!(
            "a grid of {} x {} samples",
            grid.columns, grid.rows
        ));
    }
    let finite = grid.origin.into_iter().chain(grid.step).all(f64::is_finite);
    if !(finite && x > 0.0 && y < 0.0) {
        return Err(format!(
            "a grid with origin {:?} and step {:?}",
            grid.origin, grid.step
        ));
    }
    if !(-40..=40).contains(&metadata.unit_exponent) {
        return Err(format!(
            "a height unit of 2^{} m; -40 to 40 are sane",
            metadata.unit_exponent
        ));
    }
    if !(metadata.eps.is_finite() && metadata.eps >= 0.0) {
        return Err(format!("an error bound of {} m", metadata.eps));
    }
    if metadata.levels.len() != usize::from(grid.level_count()) {
        return Err(format!(
            "{} levels; this grid has {}",
            metadata.levels.len(),
            grid.level_count()
        ));
    }
    (0..grid.level_count()).try_for_each(|level| check_level(metadata, level))?;
    if let Some(features) = &metadata.features {
        if features.level != metadata.finest() {
            return Err(format!(
                "features at level {}; they are laid into the finest, {}",
                features.level,
                metadata.finest()
            ));
        }
        if !(20..=FEATURE_BYTES_LIMIT).contains(&features.record_bytes) {
            return Err(format!(
                "feature records of {} bytes; 20 to {FEATURE_BYTES_LIMIT} are sane",
                features.record_bytes
            ));
        }
    }
    match &metadata.color {
        Some(color) if color.texels as usize != COLOR_TEXELS => Err(format!(
            "colour tiles of {} texels; this version has {COLOR_TEXELS}",
            color.texels
        )),
        Some(ColorMetadata {
            codec: ColorCodec::Jpeg { quality },
            ..
        }) if !(1..=100).contains(quality) => {
            Err(format!("a JPEG quality of {quality}; 1 to 100 are known"))
        }
        Some(color) if color.levels == 0 || color.levels > grid.level_count() => Err(format!(
            "{} colour levels of {}",
            color.levels,
            grid.level_count()
        )),
        _ => Ok(()),
    }
}

fn check_level(metadata: &Metadata, index: u8) -> Result<(), String> {
    let level = &metadata.levels[usize::from(index)];
    let tiles = metadata.grid.tiles(index);
    if level.tiles != tiles {
        return Err(format!(
            "level {index} of {:?} tiles; this grid has {tiles:?}",
            level.tiles
        ));
    }
    if !(1..1 << 25).contains(&level.step) {
        return Err(format!(
            "level {index} with a step of {} units; 1 to 2^25 are sane",
            level.step
        ));
    }
    if index == 0 && !level.key {
        return Err("level 0 is not a key level, though it has no parent".into());
    }
    let widths = [level.cage_bytes, level.detail_bytes];
    if widths.iter().all(|width| [1, 2, 4].contains(width)) {
        Ok(())
    } else {
        Err(format!(
            "level {index} with numbers of {widths:?} bytes; 1, 2 and 4 are known"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pyramid::sample::metadata;

    #[test]
    fn metadata_survive_the_root() {
        let metadata = metadata(300, 200);
        assert_eq!(parse_root(&root_json(&metadata).unwrap()), Ok(metadata));
    }

    #[test]
    fn every_prefix_of_a_root_is_an_error() {
        let root = root_json(&metadata(300, 200)).unwrap();
        for length in 0..root.len() {
            assert!(parse_root(&root[..length]).is_err(), "{length} bytes");
        }
    }

    #[test]
    fn absurd_metadata_are_errors() {
        let absurd: [fn(&mut Metadata); 11] = [
            |m| m.version = 2,
            |m| m.grid.rows = 0,
            |m| m.grid.step = [1.0, 1.0],
            |m| m.grid.columns = u32::MAX,
            |m| m.unit_exponent = 400,
            |m| m.eps = -1.0,
            |m| m.levels.truncate(1),
            |m| m.levels[0].key = false,
            |m| m.levels[1].step = 0,
            |m| m.levels[1].detail_bytes = 3,
            |m| m.levels[1].tiles = [9, 9],
        ];
        for (index, change) in absurd.into_iter().enumerate() {
            let mut metadata = metadata(300, 200);
            change(&mut metadata);
            assert!(
                parse_root(&root_json(&metadata).unwrap()).is_err(),
                "case {index}"
            );
        }
    }

    #[test]
    fn shards_are_where_zarr_looks_for_them() {
        assert_eq!(shard_key("tile/3", [1, 2], 1), "tile/3/c/1/2/0");
        assert_eq!(shard_key("color/0", [0, 0], 3), "color/0/c/0/0/0/0/0");
    }
}
