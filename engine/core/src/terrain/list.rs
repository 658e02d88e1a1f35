//! The drawn list: every tile of the drawn cut, as the GPU gets it.

use super::{FramePlan, Place};
use crate::{
    geo::TileId,
    pyramid::{Metadata, Summary},
    reference::shared::{
        DrawnTile, NONE, SIDE_COARSER, SIDE_FINER, SIDE_SAME, TILE_VISIBLE, TILE_VOIDS,
    },
    stream::{Drawn, Leaf, NO_NODE, Node, Side, Tree, neighbours},
};

/// Metres a column and a row of a tile's samples.
#[expect(clippy::cast_possible_truncation, reason = "steps are f32 on the GPU")]
pub(super) fn step(tree: &Tree, id: TileId) -> [f32; 2] {
    tree.corner_and_step(id).1.map(|step| step as f32)
}

/// Lists the drawn cut, seen from the world's origin: [`FramePlan::aim`] brings it to the camera.
pub(super) fn fill(plan: &mut FramePlan, tree: &Tree, drawn: &Drawn, metadata: &Metadata) {
    let unit = metadata.unit();
    for leaf in &drawn.leaves {
        let node = tree.node(leaf.node);
        let base = node.summary.min.midpoint(node.summary.max);
        plan.places.push(Place {
            id: node.id,
            bounds: node.bounds,
            base: f64::from(base) * unit,
        });
        plan.drawn.push(tile(tree, leaf, base, unit));
    }
}

#[expect(clippy::cast_possible_truncation, reason = "metres are f32 on the GPU")]
fn tile(tree: &Tree, leaf: &Leaf, base: i32, unit: f64) -> DrawnTile {
    let node = tree.node(leaf.node);
    let around = neighbours(tree, leaf);
    let [side_north, side_east, side_south, side_west] =
        around.sides.map(|halves| halves.map(side_word));
    let picture = picture(tree, node);
    let parent = (node.parent != NO_NODE).then(|| tree.node(node.parent));
    DrawnTile {
        origin: [0.0; 3],
        slot: node.slot().unwrap_or(NONE),
        step: step(tree, node.id),
        error: node.summary.error.max(unit as f32),
        level: u32::from(node.id.level),
        base,
        z_min: 0.0,
        z_max: 0.0,
        flags: if node.visible { TILE_VISIBLE } else { 0 } | void_flag(node),
        parent_slot: parent.and_then(Node::slot).unwrap_or(NONE),
        quadrant: node.id.quadrant(),
        color_slot: picture.layer,
        color_scale: picture.scale,
        color_offset: picture.offset,
        skirt: skirt(tree, leaf, unit as f32),
        geometric_error: node.summary.error,
        corner_tile: around.corner_tile,
        corner_sample: around.corner_sample,
        side_north,
        side_east,
        side_south,
        side_west,
    }
}

fn side_word(side: Side) -> u32 {
    match side {
        Side::None => NONE,
        Side::Same(drawn) => drawn | SIDE_SAME << 30,
        Side::Coarser(drawn) => drawn | SIDE_COARSER << 30,
        Side::Finer(drawn) => drawn | SIDE_FINER << 30,
    }
}

fn void_flag(node: &Node) -> u32 {
    let has_bits = node.tile().is_some_and(|tile| tile.voids.is_some());
    if has_bits && node.summary.flags & Summary::VOID != 0 {
        TILE_VOIDS
    } else {
        0
    }
}

/// How far two tiles can be apart at their border, and a unit: both may be off the ground by their errors. A finer
/// neighbour's error is at most that of the tile in its stead.
fn skirt(tree: &Tree, leaf: &Leaf, unit: f32) -> f32 {
    let near = leaf.around.iter().filter(|&&near| near != NO_NODE);
    let beside = near
        .map(|&near| tree.node(near).summary.error)
        .fold(0.0, f32::max);
    tree.node(leaf.node).summary.error + beside + unit
}

struct Picture {
    layer: u32,
    scale: f32,
    offset: [f32; 2],
}

/// The picture of the nearest tile above that has one, and the part of it that lies over this tile.
fn picture(tree: &Tree, node: &Node) -> Picture {
    let mut holder = node;
    loop {
        if let Some(layer) = holder.color.layer() {
            let up = node.id.level - holder.id.level;
            let scale = (-f32::from(up)).exp2();
            let part = |at: u32, first: u32| (at - (first << up)) as f32 * scale;
            let offset = [
                part(node.id.column, holder.id.column),
                part(node.id.row, holder.id.row),
            ];
            return Picture {
                layer,
                scale,
                offset,
            };
        }
        if holder.parent == NO_NODE {
            return Picture {
                layer: NONE,
                scale: 1.0,
                offset: [0.0; 2],
            };
        }
        holder = tree.node(holder.parent);
    }
}
