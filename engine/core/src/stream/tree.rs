//! The tiles the engine knows of: an arena of nodes, one for the root and one for each child of a tile in memory.
//!
//! A tile's life is one state machine:
//!
//! ```text
//! Absent → Requested → Resident → Uploaded
//!    ↑ cancelled │ │ error  ↑ slot taken │
//!    └───────────┘ ↓        └────────────┘      any of the last two → Absent when evicted
//!               Failed → Requested, when its time has come
//! ```
//!
//! What a tile says of its children is in its own record, so a node exists as soon as its parent is in memory.

use std::{
    collections::HashMap,
    hash::{BuildHasherDefault, Hasher},
    sync::Arc,
};

use super::{Bounds, color::ColorLife};
use crate::{
    geo::{Grid, TILE_CELLS, TileId},
    pyramid::{Metadata, Summary, Tile, feature::FeatureGroup},
};

/// No node: outside the data set, or not known.
pub const NO_NODE: u32 = u32::MAX;

/// Where a tile is.
#[derive(Clone, Debug)]
pub enum Life {
    /// Not in memory, not asked for.
    Absent,
    /// A loader has been asked; failures before it.
    Requested {
        /// The loader's ticket.
        ticket: u32,
        /// Tries that failed before this one.
        attempts: u32,
    },
    /// In RAM.
    Resident(Arc<Tile>),
    /// In RAM and in a slot of the pool.
    Uploaded {
        /// The tile.
        tile: Arc<Tile>,
        /// Its slot.
        slot: u32,
    },
    /// The last try failed.
    Failed {
        /// Tries that failed.
        attempts: u32,
        /// Not before this time, in milliseconds of the planner's clock.
        retry_at: u64,
    },
}

/// One tile that is known.
#[derive(Clone, Debug)]
pub struct Node {
    /// Its address.
    pub id: TileId,
    /// What its parent says of it.
    pub summary: Summary,
    /// Its box.
    pub bounds: Bounds,
    /// Its parent's node.
    pub parent: u32,
    /// Its children's nodes by quadrant; known while the tile is in memory.
    pub children: [u32; 4],
    /// Where it is.
    pub life: Life,
    /// Where its imagery is.
    pub color: ColorLife,
    /// Features that stand in the place of some of its patches; there while the tile is in memory.
    pub features: Arc<[FeatureGroup]>,
    /// Last plan that looked at it.
    pub used: u64,
    /// Last plan that wanted it.
    pub wanted: u64,
    /// Last plan that wanted its imagery.
    pub color_wanted: u64,
    /// Which run of the cut the next three belong to.
    pub mark: u64,
    /// The cut wants its children.
    pub split: bool,
    /// The view sees its box.
    pub visible: bool,
    /// What a split gains: screen-space error over what is allowed, the visible ones first.
    pub gain: f32,
    /// The drawn cut splits it.
    pub drawn_split: bool,
    /// Place in the drawn list, where it is drawn.
    pub drawn: u32,
}

impl Node {
    /// The tile, where it is in memory.
    #[must_use]
    pub fn tile(&self) -> Option<&Arc<Tile>> {
        match &self.life {
            Life::Resident(tile) | Life::Uploaded { tile, .. } => Some(tile),
            _ => None,
        }
    }

    /// Bytes in RAM of the tile and its features.
    #[must_use]
    pub fn byte_count(&self) -> u64 {
        let tile = self.tile().map_or(0, |tile| tile.byte_count() as u64);
        let cages = self.features.iter().filter_map(|group| group.cage.as_ref());
        tile + cages
            .map(|cage| {
                let topology = cage.topology();
                u64::from(topology.vertex_count()) * 48 + u64::from(topology.corner_count()) * 32
            })
            .sum::<u64>()
    }

    /// The slot, where the tile has one.
    #[must_use]
    pub fn slot(&self) -> Option<u32> {
        match self.life {
            Life::Uploaded { slot, .. } => Some(slot),
            _ => None,
        }
    }
}

/// All known tiles.
#[derive(Debug)]
pub struct Tree {
    nodes: Vec<Node>,
    free: Vec<u32>,
    index: HashMap<TileId, u32, BuildHasherDefault<TileHasher>>,
    grid: Grid,
    finest: u8,
    run: u64,
    /// World x and y of the north-west sample, metres of a finest column and row, metres of a unit.
    place: ([f64; 2], [f64; 2], f64),
}

impl Tree {
    /// The root's place in the arena.
    pub const ROOT: u32 = 0;

    /// A tree with its root in memory.
    #[must_use]
    pub fn new(metadata: &Metadata, root: Arc<Tile>) -> Self {
        let (grid, frame) = (metadata.grid, metadata.frame());
        let place = (
            frame.to_world(grid.origin),
            frame.step(&grid),
            metadata.unit(),
        );
        let mut tree = Self {
            nodes: Vec::new(),
            free: Vec::new(),
            index: HashMap::default(),
            grid,
            finest: metadata.finest(),
            run: 0,
            place,
        };
        tree.add(TileId::ROOT, root.summary, NO_NODE);
        tree.arrive(Self::ROOT, root);
        tree
    }

    /// One node.
    #[must_use]
    pub fn node(&self, node: u32) -> &Node {
        &self.nodes[node as usize]
    }

    /// One node, to be changed.
    pub fn node_mut(&mut self, node: u32) -> &mut Node {
        &mut self.nodes[node as usize]
    }

    /// The node of a tile, where it is known.
    #[must_use]
    pub fn find(&self, id: TileId) -> Option<u32> {
        self.index.get(&id).copied()
    }

    /// Places in the arena, those out of use among them.
    #[must_use]
    pub fn places(&self) -> u32 {
        u32::try_from(self.nodes.len()).unwrap_or(NO_NODE)
    }

    /// A new run of the cut: what earlier ones marked no longer holds.
    pub fn begin_run(&mut self) -> u64 {
        self.run += 1;
        self.run
    }

    /// The finest level.
    #[must_use]
    pub fn finest(&self) -> u8 {
        self.finest
    }

    /// The grid of the finest samples.
    #[must_use]
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// World x and y of a tile's north-west sample, and metres a column and a row of its samples.
    #[must_use]
    pub fn corner_and_step(&self, id: TileId) -> ([f64; 2], [f64; 2]) {
        let ([x, y], step, _) = self.place;
        let [row, column] = self.grid.first_sample(id).map(|first| first as f64);
        let stride = f64::from(self.grid.stride(id.level));
        (
            [x + column * step[0], y + row * step[1]],
            step.map(|step| step * stride),
        )
    }

    /// Puts a tile that was read into its node, and makes nodes of its children.
    pub fn arrive(&mut self, node: u32, tile: Arc<Tile>) {
        let id = self.node(node).id;
        for (quadrant, child) in id.children().into_iter().enumerate() {
            let summary = tile.children[quadrant];
            if summary.is_present()
                && self.grid.has(child)
                && self.node(node).children[quadrant] == NO_NODE
            {
                let added = self.add(child, summary, node);
                self.node_mut(node).children[quadrant] = added;
            }
        }
        self.node_mut(node).life = Life::Resident(tile);
    }

    /// Takes a tile out of memory and forgets its children; refused, as false, while one of them is in use.
    pub fn evict(&mut self, node: u32) -> bool {
        let children = self
            .node(node)
            .children
            .map(|child| (child != NO_NODE).then_some(child));
        let busy = |child: &u32| {
            let child = self.node(*child);
            !matches!(child.life, Life::Absent | Life::Failed { .. }) || !child.color.is_idle()
        };
        if node == Self::ROOT || children.iter().flatten().any(busy) {
            return false;
        }
        for child in children.into_iter().flatten() {
            let id = self.node(child).id;
            self.index.remove(&id);
            self.free.push(child);
        }
        let node = self.node_mut(node);
        node.children = [NO_NODE; 4];
        node.life = Life::Absent;
        node.features = Arc::default();
        true
    }

    /// True when the place in the arena is in use.
    #[must_use]
    pub fn is_live(&self, node: u32) -> bool {
        self.index.get(&self.node(node).id) == Some(&node)
    }

    fn add(&mut self, id: TileId, summary: Summary, parent: u32) -> u32 {
        let node = Node {
            id,
            summary,
            bounds: self.bounds(id, &summary),
            parent,
            children: [NO_NODE; 4],
            life: Life::Absent,
            color: ColorLife::Absent,
            features: Arc::default(),
            used: 0,
            wanted: 0,
            color_wanted: 0,
            mark: 0,
            split: false,
            visible: false,
            gain: 0.0,
            drawn_split: false,
            drawn: NO_NODE,
        };
        let place = self.free.pop().unwrap_or_else(|| self.places());
        if place == self.places() {
            self.nodes.push(node);
        } else {
            self.nodes[place as usize] = node;
        }
        self.index.insert(id, place);
        place
    }

    fn bounds(&self, id: TileId, summary: &Summary) -> Bounds {
        let ([x, y], step) = self.corner_and_step(id);
        let (unit, cells) = (self.place.2, TILE_CELLS as f64);
        Bounds {
            min: [x, y + cells * step[1], f64::from(summary.min) * unit],
            max: [x + cells * step[0], y, f64::from(summary.max) * unit],
        }
    }
}

/// Mixes the three numbers of an address; addresses are few and regular, so one multiplication each will do.
#[derive(Debug, Default)]
pub(crate) struct TileHasher(u64);

impl Hasher for TileHasher {
    fn finish(&self) -> u64 {
        self.0 ^ self.0 >> 29
    }

    fn write(&mut self, bytes: &[u8]) {
        bytes
            .iter()
            .for_each(|byte| self.write_u64(u64::from(*byte)));
    }

    fn write_u8(&mut self, number: u8) {
        self.write_u64(u64::from(number));
    }

    fn write_u32(&mut self, number: u32) {
        self.write_u64(u64::from(number));
    }

    fn write_u64(&mut self, number: u64) {
        self.0 = (self.0.rotate_left(23) ^ number).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stream::{TileSource, synthetic::Synthetic};

    fn tree() -> (Synthetic, Tree) {
        let source = Synthetic::new(1025, 1025, 1);
        let root = Arc::new(source.load(TileId::ROOT, None).unwrap());
        let tree = Tree::new(source.metadata(), root);
        (source, tree)
    }

    #[test]
    fn children_are_known_while_their_parent_is_in_memory() {
        let (source, mut tree) = tree();
        let child = tree.find(TileId::new(1, 1, 0)).unwrap();
        assert!(tree.find(TileId::new(2, 2, 0)).is_none());
        let tile = source
            .load(
                TileId::new(1, 1, 0),
                tree.node(Tree::ROOT).tile().map(|tile| &**tile),
            )
            .unwrap();
        tree.arrive(child, Arc::new(tile));
        assert!(tree.find(TileId::new(2, 2, 0)).is_some());
        assert!(tree.evict(child));
        assert!(tree.find(TileId::new(2, 2, 0)).is_none());
        assert!(!tree.evict(Tree::ROOT));
    }

    #[test]
    fn children_fill_their_parents_box() {
        let (_, tree) = tree();
        let root = tree.node(Tree::ROOT);
        let boxes = root.children.map(|child| tree.node(child).bounds);
        assert_eq!(boxes[2].min[..2], root.bounds.min[..2]);
        assert_eq!(boxes[1].max[..2], root.bounds.max[..2]);
        assert_eq!(boxes[0].max[0], boxes[1].min[0]);
        assert_eq!(boxes[0].min[1], boxes[2].max[1]);
    }
}
