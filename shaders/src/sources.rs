//! The texts themselves, part of the binary.

/// A stage's name and its text with `#import` lines as they stand.
pub const SOURCES: &[(&str, &str)] = &[
    ("decode", include_str!("../stages/decode.wgsl")),
    ("refine", include_str!("../stages/refine.wgsl")),
    ("depth", include_str!("../stages/depth.wgsl")),
    ("balance", include_str!("../stages/balance.wgsl")),
    ("emit", include_str!("../stages/emit.wgsl")),
    ("draw", include_str!("../stages/draw.wgsl")),
];

/// A shared file's name and its text with `#import` lines as they stand.
pub const SHARED: &[(&str, &str)] = &[
    ("constants", include_str!("../shared/constants.wgsl")),
    ("frame", include_str!("../shared/frame.wgsl")),
    ("tile", include_str!("../shared/tile.wgsl")),
    ("pool", include_str!("../shared/pool.wgsl")),
    ("border", include_str!("../shared/border.wgsl")),
    ("ground", include_str!("../shared/ground.wgsl")),
    ("colors", include_str!("../shared/colors.wgsl")),
    ("patch_word", include_str!("../shared/patch_word.wgsl")),
    ("draw_list", include_str!("../shared/draw_list.wgsl")),
    ("feature", include_str!("../shared/feature.wgsl")),
    ("refine", include_str!("../shared/refine.wgsl")),
    ("upload", include_str!("../shared/upload.wgsl")),
];
