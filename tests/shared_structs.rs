//! The structs and constants of `shaders/shared/*.wgsl` against their Rust twins: names, offsets, sizes, values.

use std::collections::BTreeMap;

use drumlin_core::{
    geo,
    reference::shared::{
        self, DrawnTile, FeatureVertex, Frame, UploadHeader, border, patch_word, refine,
        refine::{RefineHeader, RefineTask},
    },
};
use naga::{Expression, Literal, Module, TypeInner};

/// All shared files as one module: every stage's imports put together.
fn modules() -> Vec<Module> {
    drumlin_shaders::STAGES
        .iter()
        .map(|name| naga::front::wgsl::parse_str(&drumlin_shaders::stage(name).unwrap()).unwrap())
        .collect()
}

/// A struct's member: name, offset and size.
type Member = (String, u32, u32);

/// The members of a struct; the size of the whole.
fn members(module: &Module, name: &str) -> Option<(Vec<Member>, u32)> {
    let (_, kind) = module
        .types
        .iter()
        .find(|kind| kind.1.name.as_deref() == Some(name))?;
    let TypeInner::Struct { members, span } = &kind.inner else {
        return None;
    };
    let size = |member: &naga::StructMember| module.types[member.ty].inner.size(module.to_ctx());
    let list = members
        .iter()
        .map(|member| {
            (
                member.name.clone().unwrap_or_default(),
                member.offset,
                size(member),
            )
        })
        .collect();
    Some((list, *span))
}

/// Offsets and sizes of the fields named, as Rust lays them out.
macro_rules! fields {
    ($kind:ty: $($field:ident),+ $(,)?) => {{
        let value: $kind = bytemuck::Zeroable::zeroed();
        (
            vec![$((
                stringify!($field).to_owned(),
                u32::try_from(std::mem::offset_of!($kind, $field)).unwrap(),
                u32::try_from(size_of_val(&value.$field)).unwrap(),
            )),+],
            u32::try_from(size_of::<$kind>()).unwrap(),
        )
    }};
}

#[test]
fn structs_have_one_layout_on_both_sides() {
    let frame = fields!(Frame: clip_from_view_world, viewport, pixels_per_radian, tolerance, unit, drawn_count,
        index_capacity, uniform_depth, sun, haze, sky, flags, height_range, camera_height, reserved, ground_min, ground_max);
    let tile = fields!(DrawnTile: origin, slot, step, error, level, base, z_min, z_max, flags, parent_slot, quadrant,
        color_slot, color_scale, color_offset, skirt, geometric_error, corner_tile, corner_sample, side_north,
        side_east, side_south, side_west);
    let upload = fields!(UploadHeader: slot, quantum, unit, reserved, step, reserved_2);
    let vertex = fields!(FeatureVertex: position, tile, normal, position_of);
    let header = fields!(RefineHeader: step, size, first, tiles, patches_word, vertices_word, vertex_count, reserved);
    let task = fields!(RefineTask: kind, count, rows_word, first_point);
    let modules = modules();
    for (name, rust) in [
        ("Frame", frame),
        ("DrawnTile", tile),
        ("UploadHeader", upload),
        ("FeatureVertex", vertex),
        ("RefineHeader", header),
        ("RefineTask", task),
    ] {
        let found: Vec<_> = modules
            .iter()
            .filter_map(|module| members(module, name))
            .collect();
        assert!(!found.is_empty(), "no stage has {name}");
        for wgsl in found {
            assert_eq!(wgsl, rust, "{name}");
        }
    }
}

/// Every constant of the shared files whose value is a plain number.
fn shader_constants() -> BTreeMap<String, u32> {
    let mut constants = BTreeMap::new();
    for module in modules() {
        for (_, constant) in module.constants.iter() {
            if let (Some(name), Expression::Literal(Literal::U32(value))) =
                (&constant.name, &module.global_expressions[constant.init])
            {
                constants.insert(name.clone(), *value);
            }
        }
    }
    constants
}

macro_rules! values {
    ($($module:ident: $($name:ident),+;)+) => {
        vec![$($((stringify!($name), u32::try_from($module::$name).unwrap()),)+)+]
    };
}

#[test]
fn constants_are_equal_on_both_sides() {
    let rust = values! {
        geo: TILE_QUADS, QUAD_SAMPLES, TILE_CELLS, TILE_SAMPLES, CAGE_CONTROLS, PATCH_COUNT, TILE_SAMPLE_COUNT,
            CAGE_CONTROL_COUNT;
        border: TILE_QUADS, QUAD_SAMPLES, TILE_CELLS, TILE_SAMPLES, PATCH_COUNT, EDGE_NORTH, EDGE_EAST, EDGE_SOUTH,
            EDGE_WEST, SIDE_NONE;
        patch_word: SHIFT_COUNT, FINEST_DEPTH, DEPTH_CUT, PATCH_CUT;
        refine: REFINE_MEANS, REFINE_RINGS, REFINE_WEIGHTED, REFINE_WEIGHTED_WORDS, REFINE_VERTEX_WORDS, REFINE_STENCIL;
        shared: NONE, SAMPLE_BITS, SKIRT_FIRST, HEIGHTS_WORD, SLOPES_WORD, VOIDS_WORD, STRIDE_ERRORS_WORD, CODES_WORD,
            CONTROLS_WORD, CUT_WORD, SLOT_WORDS, SLOTS_PER_PAGE, FLAG_DRAW_VOIDS, FLAG_DEPTH_COLORS, FLAG_SRGB_OUT,
            FLAG_WIREFRAME, TILE_VISIBLE, TILE_VOIDS, TILE_CUT, FEATURE_BORDER, SIDE_INDEX_MASK, SIDE_SAME, SIDE_COARSER, SIDE_FINER,
            UPLOAD_CONTROLS_WORD, UPLOAD_DETAIL_WORD, UPLOAD_VOIDS_WORD, UPLOAD_CODES_WORD, UPLOAD_CUT_WORD,
            UPLOAD_WORDS,
            INDEX_COUNT_WORD, INSTANCE_COUNT_WORD, SHIFT_COUNTS_WORD, CURSOR_WORD, CLASS_COUNTS_WORD, DRAW_LIST_WORDS;
    };
    let wgsl = shader_constants();
    for (name, value) in &rust {
        assert_eq!(wgsl.get(*name), Some(value), "{name}");
    }
    // None is left out: what is declared in a shared file is in the list above.
    for (file, text) in drumlin_shaders::SHARED {
        for line in text
            .lines()
            .filter(|line| line.starts_with("const ") && line.contains(": u32"))
        {
            let name = line["const ".len()..].split(':').next().unwrap_or_default();
            assert!(
                rust.iter().any(|constant| constant.0 == name),
                "{name} of {file}.wgsl is not compared"
            );
        }
    }
}

#[test]
fn the_words_of_a_slot_follow_each_other_within_a_page() {
    let parts = [
        (shared::HEIGHTS_WORD, geo::TILE_SAMPLE_COUNT),
        (shared::SLOPES_WORD, geo::TILE_SAMPLE_COUNT),
        (shared::VOIDS_WORD, geo::TILE_SAMPLE_COUNT.div_ceil(32)),
        (shared::STRIDE_ERRORS_WORD, 2 * geo::PATCH_COUNT),
        (shared::CODES_WORD, geo::PATCH_COUNT / 4),
        (shared::CONTROLS_WORD, geo::CAGE_CONTROL_COUNT),
        (shared::CUT_WORD, geo::PATCH_COUNT / 32),
    ];
    let end = parts.iter().fold(0, |at, &(word, count)| {
        assert_eq!(word, at);
        at + count
    });
    assert!(end <= shared::SLOT_WORDS);
    assert!(shared::SLOT_WORDS * 4 * shared::SLOTS_PER_PAGE as usize <= 128 << 20);
}
