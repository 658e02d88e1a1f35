//! Laws of balance and emit together, on small drawn lists with random depths.

use std::collections::HashSet;

use super::*;
use crate::{
    geo::TileId,
    reference::{
        balance::balance,
        shared::{
            DRAW_LIST_WORDS, SIDE_COARSER, SIDE_FINER, SLOT_WORDS,
            border::SIDE_NONE,
            patch_word::DEPTH_CUT,
            synthetic::{Scene, frame, scene},
        },
    },
};

/// 2 × 2 tiles of level 1, those of `split` replaced by their children but for `absent`.
fn quarters(split: &[u32], absent: &[TileId]) -> Scene {
    let root = TileId::ROOT;
    let mut ids = Vec::new();
    for (quadrant, child) in (0..).zip(root.children()) {
        if split.contains(&quadrant) {
            ids.extend(
                child
                    .children()
                    .into_iter()
                    .filter(|id| !absent.contains(id)),
            );
        } else {
            ids.push(child);
        }
    }
    scene(&ids, 8.0, &|_, _| 0.0)
}

/// Same level; each quarter split; opposite quarters split; three of them; one with a child missing.
fn scenes() -> Vec<Scene> {
    let mut all = vec![
        quarters(&[], &[]),
        quarters(&[0, 3], &[]),
        quarters(&[0, 1, 2], &[]),
    ];
    all.extend((0..4).map(|quadrant| quarters(&[quadrant], &[])));
    all.push(quarters(&[3], &[TileId::new(2, 2, 3)]));
    all
}

/// Numbers that look random, the same every time.
fn random(state: &mut u32) -> u32 {
    *state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
    *state >> 16
}

/// Dense: each depth alike; sparse: mostly 0, some 2; by tile: one depth a tile.
fn random_depths(tiles: usize, kind: u32, state: &mut u32) -> Vec<u32> {
    let mut depths = Vec::new();
    for _ in 0..tiles {
        let whole = random(state) % 3;
        for _ in 0..PATCH_COUNT {
            depths.push(match kind {
                0 => random(state) % 3,
                1 => random(state) % 12 / 11 * 2,
                _ => whole,
            });
        }
    }
    depths
}

struct Emitted {
    patches: Vec<u32>,
    draw_list: Vec<u32>,
    indices: Vec<u32>,
}

/// The list at a shift, forced by its capacity.
fn emit(scene: &Scene, pages: &Pages<'_>, depths: &[u32], shift: u32) -> Emitted {
    let mut view = frame(u32::try_from(scene.tiles.len()).unwrap());
    let (mut raised, mut patches) = (vec![0; depths.len()], vec![0; depths.len()]);
    balance(&view, &scene.tiles, depths, &mut raised, &mut patches);
    let mut draw_list = vec![0; DRAW_LIST_WORDS];
    count(&view, &scene.tiles, &patches, &mut draw_list);
    let wanted = draw_list[SHIFT_COUNTS_WORD + shift as usize];
    view.index_capacity = wanted;
    // With equal counts a lesser shift fits too.
    let mut indices = vec![0; wanted as usize];
    write(
        &view,
        &scene.tiles,
        pages,
        &patches,
        &mut draw_list,
        &mut indices,
    );
    assert_eq!(draw_list[INDEX_COUNT_WORD], wanted, "as many as counted");
    assert_eq!(draw_list[CURSOR_WORD], wanted);
    assert_eq!(draw_list[INSTANCE_COUNT_WORD], 1);
    Emitted {
        patches,
        draw_list,
        indices,
    }
}

/// A vertex's place in half samples of the finest level of these scenes: row, column.
fn place(scene: &Scene, index: u32) -> [i64; 2] {
    let id = scene.ids[(index >> SAMPLE_BITS) as usize];
    let sample = index & ((1 << SAMPLE_BITS) - 1);
    let scale = 1 << (2 - id.level);
    [
        i64::from((id.row * 128 + sample / 129) * scale),
        i64::from((id.column * 128 + sample % 129) * scale),
    ]
}

fn is_skirt(triangle: &[u32]) -> bool {
    triangle
        .iter()
        .any(|index| index & ((1 << SAMPLE_BITS) - 1) >= SKIRT_FIRST)
}

/// Triangles of the surface: skirts come in pairs, the second with one vertex below.
fn surface(emitted: &Emitted) -> impl Iterator<Item = &[u32]> {
    emitted
        .indices
        .chunks_exact(3)
        .filter(|triangle| !is_skirt(triangle))
}

/// Every edge has its opposite exactly once but on the data's border, whose length comes back.
fn assert_watertight(scene: &Scene, emitted: &Emitted) -> i64 {
    let mut edges: Vec<[u32; 2]> = surface(emitted)
        .flat_map(|t| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]])
        .collect();
    edges.sort_unstable();
    assert!(
        edges.windows(2).all(|pair| pair[0] != pair[1]),
        "an edge twice in one direction"
    );
    let mut border = 0;
    for &[a, b] in &edges {
        if edges.binary_search(&[b, a]).is_err() {
            let (from, to) = (place(scene, a), place(scene, b));
            assert!(
                is_on_border(scene, from, to),
                "open edge {from:?} to {to:?}"
            );
            border += (from[0] - to[0]).abs() + (from[1] - to[1]).abs();
        }
    }
    border
}

/// True where one side of an axis-parallel edge has no tile.
fn is_on_border(scene: &Scene, from: [i64; 2], to: [i64; 2]) -> bool {
    let covered = |row: i64, column: i64| {
        scene.ids.iter().any(|id| {
            let size = 128 << (2 - id.level);
            let inside = |at: i64, tile: u32| {
                at > i64::from(tile) * size * 2 && at < (i64::from(tile) + 1) * size * 2
            };
            inside(row, id.row) && inside(column, id.column)
        })
    };
    // Doubled, so that the places beside the edge's middle are whole numbers.
    let middle = [from[0] + to[0], from[1] + to[1]];
    let normal = [(from[1] - to[1]).signum(), (from[0] - to[0]).signum()];
    from.iter().zip(&to).any(|(a, b)| a == b)
        && covered(middle[0] + normal[0], middle[1] + normal[1])
            != covered(middle[0] - normal[0], middle[1] - normal[1])
}

fn area(scene: &Scene) -> i64 {
    scene
        .ids
        .iter()
        .map(|id| (128_i64 << (2 - id.level)).pow(2))
        .sum()
}

#[test]
fn every_edge_is_shared_by_two_triangles_and_the_ground_is_tiled_once() {
    let words = vec![0; 16 * SLOT_WORDS];
    let pages: Pages<'_> = [&words, &[], &[], &[]];
    let mut state = 7;
    for scene in scenes() {
        for kind in 0..3 {
            let depths = random_depths(scene.tiles.len(), kind, &mut state);
            // Shifts lessen depths, whose law is below: one kind is enough.
            for shift in 0..if kind == 0 { SHIFT_COUNT } else { 1 } {
                let emitted = emit(&scene, &pages, &depths, shift);
                let border = assert_watertight(&scene, &emitted);
                assert_eq!(border, perimeter(&scene));
                let mut twice = 0;
                let mut owners = Vec::new();
                for triangle in surface(&emitted) {
                    let [a, b, c] = [0, 1, 2].map(|i| place(&scene, triangle[i]));
                    // Rows count south: counter-clockwise seen from above is positive here.
                    let doubled = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
                    assert!(doubled > 0, "{a:?} {b:?} {c:?}");
                    twice += doubled;
                    owners.extend([(a, triangle[0]), (b, triangle[1]), (c, triangle[2])]);
                }
                assert_eq!(twice, 2 * area(&scene));
                owners.sort_unstable();
                owners.dedup();
                let is_double = |pair: &[([i64; 2], u32)]| pair[0].0 == pair[1].0;
                assert!(
                    !owners.windows(2).any(is_double),
                    "two vertices at one place"
                );
            }
        }
    }
}

fn perimeter(scene: &Scene) -> i64 {
    let length = |(at, id): (u32, &TileId)| {
        let half = 64_i64 << (2 - id.level);
        let drawn = &scene.tiles[at as usize];
        let sides = [
            drawn.side_north,
            drawn.side_east,
            drawn.side_south,
            drawn.side_west,
        ];
        sides
            .iter()
            .flatten()
            .filter(|&&word| word == u32::MAX)
            .count() as i64
            * half
    };
    (0..).zip(&scene.ids).map(length).sum()
}

#[test]
fn neighbours_differ_by_at_most_one_and_no_depth_is_lessened() {
    let mut state = 99;
    let mut seen = HashSet::new();
    let across = |relation: u32, depth: u32| {
        if relation == SIDE_COARSER {
            (depth + 1).min(2)
        } else {
            depth
        }
    };
    for scene in scenes() {
        for kind in 0..3 {
            let depths = random_depths(scene.tiles.len(), kind, &mut state);
            let words = vec![0; 16 * SLOT_WORDS];
            let emitted = emit(&scene, &[&words, &[], &[], &[]], &depths, 0);
            for tile in 0..u32::try_from(scene.tiles.len()).unwrap() {
                for patch in 0..PATCH_COUNT {
                    let own = word_depth(emitted.patches[(tile * PATCH_COUNT + patch) as usize], 0);
                    let raw = depths[(tile * PATCH_COUNT + patch) as usize];
                    assert!(
                        own >= raw && own <= raw.max(1),
                        "raised from 0 to 1 or not at all"
                    );
                    for edge in EDGES {
                        let other = facing(&scene.tiles, tile, patch, edge);
                        if other.relation == SIDE_NONE {
                            continue;
                        }
                        let at = (other.tile * PATCH_COUNT + other.second) as usize;
                        let theirs = word_depth(emitted.patches[at], 0);
                        let mine = across(other.relation, own);
                        let theirs = if other.relation == SIDE_FINER {
                            (theirs + 1).min(2)
                        } else {
                            theirs
                        };
                        assert!(mine.abs_diff(theirs) <= 1);
                        seen.insert((other.relation, edge, other.tile == tile, raw, depths[at]));
                    }
                }
            }
        }
    }
    // In a tile and across a border of one level; across both kinds of level border: every pair of depths, every side.
    assert_eq!(seen.len(), 4 * 9 * 4, "every pair of depths was tried");
}

#[test]
fn a_shift_is_the_same_as_lesser_depths() {
    let words = vec![0; 16 * SLOT_WORDS];
    let pages: Pages<'_> = [&words, &[], &[], &[]];
    let mut state = 5;
    for scene in scenes() {
        let depths = random_depths(scene.tiles.len(), 0, &mut state);
        for shift in 1..SHIFT_COUNT {
            let lesser: Vec<u32> = depths
                .iter()
                .map(|depth| depth.saturating_sub(shift))
                .collect();
            let (at_shift, at_zero) = (
                emit(&scene, &pages, &depths, shift),
                emit(&scene, &pages, &lesser, 0),
            );
            assert_eq!(at_shift.indices, at_zero.indices);
            let classes = CLASS_COUNTS_WORD..CLASS_COUNTS_WORD + 6;
            assert_eq!(
                at_shift.draw_list[classes.clone()],
                at_zero.draw_list[classes]
            );
        }
    }
}

#[test]
fn past_the_last_shift_nothing_is_drawn() {
    let scene = quarters(&[], &[]);
    let mut view = frame(4);
    view.index_capacity = 100;
    let patches = vec![0; 4 * 1_024];
    let mut draw_list = vec![0; DRAW_LIST_WORDS];
    count(&view, &scene.tiles, &patches, &mut draw_list);
    // 2 triangles a patch; a skirt of 2 more along the outer border of 8 × 32 patches.
    assert_eq!(
        draw_list[SHIFT_COUNTS_WORD + 2],
        3 * (2 * 4 * 1_024 + 2 * 8 * 32)
    );
    assert_eq!(chosen_shift(&view, &draw_list), SHIFT_COUNT);
    write(
        &view,
        &scene.tiles,
        &[&[], &[], &[], &[]],
        &patches,
        &mut draw_list,
        &mut [],
    );
    assert_eq!(draw_list[..5], [0, 1, 0, 0, 0]);
}

#[test]
fn triangles_with_a_void_corner_shrink_to_a_point() {
    let mut scene = quarters(&[], &[]);
    scene.tiles[2].flags |= TILE_VOIDS;
    let mut words = vec![0; 16 * SLOT_WORDS];
    // Sample (8, 8) of the third tile: six triangles of plain cells meet there.
    let sample = 8 * 129 + 8;
    words[2 * SLOT_WORDS + crate::reference::shared::VOIDS_WORD + sample / 32] = 1 << (sample % 32);
    let emitted = emit(&scene, &[&words, &[], &[], &[]], &[2; 4 * 1_024], 0);
    let points = emitted
        .indices
        .chunks_exact(3)
        .filter(|t| t[0] == t[1] && t[1] == t[2])
        .count();
    assert_eq!(points, 6);
}

#[test]
fn skirts_hang_below_every_border_but_those_of_equal_level() {
    let scene = quarters(&[3], &[]);
    let words = vec![0; 16 * SLOT_WORDS];
    let emitted = emit(&scene, &[&words, &[], &[], &[]], &[2; 7 * 1_024], 0);
    let skirts = emitted
        .indices
        .chunks_exact(3)
        .filter(|triangle| is_skirt(triangle))
        .count();
    // Vertices along the outer border: 12 coarse half sides of 64 cells, 4 fine sides of 128; along the level border 4
    // coarse half sides of 64 and 4 fine sides of 64.
    assert_eq!(skirts, 2 * (12 * 64 + 4 * 128 + 4 * 64 + 4 * 64));
    let top = surface(&emitted)
        .flat_map(|t| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])])
        .collect::<HashSet<_>>();
    let mut hanging = 0;
    for triangle in emitted
        .indices
        .chunks_exact(3)
        .filter(|triangle| is_skirt(triangle))
    {
        // The second triangle of a skirt ends with the edge it hangs from, against the surface's direction.
        let edge = (triangle[0], triangle[2]);
        if !is_skirt(&[edge.0, edge.1]) {
            assert!(top.contains(&edge), "{edge:?}");
            hanging += 1;
        }
    }
    assert_eq!(hanging * 2, skirts);
}

#[test]
fn cut_patches_leave_a_hole_whose_border_has_every_sample_at_any_shift() {
    let words = vec![0; 16 * SLOT_WORDS];
    let pages: Pages<'_> = [&words, &[], &[], &[]];
    let mut state = 3;
    let scene = quarters(&[], &[]);
    // Rows 5 to 11 and columns 28 to 35 of patches: across the border of two tiles.
    let in_cut = |at: u32| {
        let (tile, patch) = (at / PATCH_COUNT, at % PATCH_COUNT);
        let row = tile / 2 * TILE_QUADS + patch / TILE_QUADS;
        let column = tile % 2 * TILE_QUADS + patch % TILE_QUADS;
        (5..12).contains(&row) && (28..36).contains(&column)
    };
    for kind in 0..3 {
        let mut depths = random_depths(scene.tiles.len(), kind, &mut state);
        for (at, depth) in (0..).zip(&mut depths) {
            if in_cut(at) {
                *depth = FINEST_DEPTH | DEPTH_CUT;
            }
        }
        for shift in 0..SHIFT_COUNT {
            let emitted = emit(&scene, &pages, &depths, shift);
            let edges: HashSet<[u32; 2]> = surface(&emitted)
                .flat_map(|t| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]])
                .collect();
            let open = edges.iter().filter(|[a, b]| !edges.contains(&[*b, *a]));
            let ends = open.map(|edge| edge.map(|end| place(&scene, end)));
            let around: Vec<_> = ends
                .filter(|[a, b]| !is_on_border(&scene, *a, *b))
                .collect();
            assert_eq!(around.len(), 2 * 4 * (7 + 8), "kind {kind}, shift {shift}");
            for [a, b] in around {
                // A sample of level 1 is two of the finest.
                assert_eq!((a[0] - b[0]).abs() + (a[1] - b[1]).abs(), 2);
            }
        }
    }
}
