//! Imagery: which tiles' pictures are read, and which layers of the colour pool hold them.
//!
//! A drawn tile shows its own picture, or the part of the nearest ancestor's that lies over it. So pictures are wanted
//! coarse first, as far as a texel of the parent's picture would be too large on the screen, and where layers run out
//! the pictures that gain least stay away.

use std::sync::Arc;

use super::{CutRule, NO_NODE, Tree, Wanted};
use crate::{geo::TILE_CELLS, pyramid::Metadata};

/// Where a tile's picture is.
#[derive(Clone, Debug)]
pub enum ColorLife {
    /// Not in memory, not asked for.
    Absent,
    /// A loader has been asked.
    Requested {
        /// The loader's ticket.
        ticket: u32,
        /// Tries that failed before this one.
        attempts: u32,
    },
    /// Read, not yet in a layer.
    Ready(Arc<[u8]>),
    /// In a layer of the colour pool.
    Uploaded(u32),
    /// The last try failed.
    Failed {
        /// Tries that failed.
        attempts: u32,
        /// Not before this time, in milliseconds of the planner's clock.
        retry_at: u64,
    },
    /// There is no picture.
    Nothing,
}

impl ColorLife {
    /// True when nothing is under way and nothing is held.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        matches!(self, Self::Absent | Self::Failed { .. } | Self::Nothing)
    }

    /// The layer, where there is one.
    #[must_use]
    pub fn layer(&self) -> Option<u32> {
        if let Self::Uploaded(layer) = self {
            Some(*layer)
        } else {
            None
        }
    }
}

/// The layers, and the pictures this plan wants in them.
#[derive(Debug)]
pub struct ColorPool {
    free: Vec<u32>,
    layers: u32,
    levels: u8,
    texel_px: f64,
    /// Nodes whose pictures are wanted, most needed first.
    pub wanted: Vec<u32>,
    ranked: Vec<(f64, u8, u32)>,
    holders: Vec<u32>,
    ready: Vec<u32>,
}

impl ColorPool {
    /// A pool of empty layers; `texel_px` is how large a texel may be on the screen.
    #[must_use]
    pub fn new(metadata: &Metadata, layers: u32, texel_px: f64) -> Self {
        let levels = metadata.color.as_ref().map_or(0, |color| color.levels);
        let layers = if levels == 0 { 0 } else { layers };
        let free = (0..layers).rev().collect();
        let holders = vec![NO_NODE; layers as usize];
        Self {
            free,
            layers,
            levels,
            texel_px,
            wanted: vec![],
            ranked: vec![],
            holders,
            ready: vec![],
        }
    }

    /// Layers in all; 0 where there is no imagery.
    #[must_use]
    pub fn layers(&self) -> u32 {
        self.layers
    }

    /// Levels of imagery.
    #[must_use]
    pub fn levels(&self) -> u8 {
        self.levels
    }

    /// Layers in use.
    #[must_use]
    pub fn used(&self) -> u32 {
        self.layers - u32::try_from(self.free.len()).unwrap_or(0)
    }

    /// Ranks the pictures of the tiles that plan `number` wants.
    pub fn rank(&mut self, tree: &mut Tree, wanted: &Wanted, rule: &CutRule, number: u64) {
        self.wanted.clear();
        self.ranked.clear();
        if self.layers == 0 {
            return;
        }
        for &place in &wanted.nodes {
            let node = tree.node(place);
            if node.id.level >= self.levels || matches!(node.color, ColorLife::Nothing) {
                continue;
            }
            let texel_px = if node.parent == NO_NODE {
                f64::MAX
            } else {
                parent_texel_px(tree, node.parent, rule)
            };
            if texel_px > self.texel_px && (node.visible || node.parent == NO_NODE) {
                self.ranked.push((texel_px, node.id.level, place));
            }
        }
        self.ranked
            .sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
        self.ranked.truncate(self.layers as usize);
        for &(_, _, place) in &self.ranked {
            tree.node_mut(place).color_wanted = number;
            self.wanted.push(place);
        }
    }

    /// A layer for a wanted picture: a free one, or the one of the picture that was wanted longest ago.
    ///
    /// Pictures that plan `number` wants keep their layers.
    fn take(&mut self, tree: &mut Tree, node: u32, number: u64) -> Option<u32> {
        let layer = self.free.pop().or_else(|| {
            let idle =
                |&holder: &u32| holder != NO_NODE && tree.node(holder).color_wanted != number;
            let age = |&holder: &u32| {
                (
                    tree.node(holder).color_wanted,
                    u8::MAX - tree.node(holder).id.level,
                    holder,
                )
            };
            let oldest = self.holders.iter().copied().filter(idle).min_by_key(age)?;
            let layer = tree.node(oldest).color.layer()?;
            tree.node_mut(oldest).color = ColorLife::Absent;
            Some(layer)
        })?;
        self.holders[layer as usize] = node;
        Some(layer)
    }

    /// Gives up the picture of a tile that leaves memory.
    pub fn release(&mut self, tree: &mut Tree, node: u32) {
        match tree.node(node).color {
            ColorLife::Uploaded(layer) => {
                self.holders[layer as usize] = NO_NODE;
                self.free.push(layer);
            }
            ColorLife::Ready(_) => self.ready.retain(|&ready| ready != node),
            _ => return,
        }
        tree.node_mut(node).color = ColorLife::Absent;
    }

    /// The colour pool is empty.
    pub fn empty_layers(&mut self, tree: &mut Tree) {
        for holder in self.holders.iter_mut().filter(|holder| **holder != NO_NODE) {
            tree.node_mut(*holder).color = ColorLife::Absent;
            *holder = NO_NODE;
        }
        self.free = (0..self.layers).rev().collect();
    }

    /// A picture has been read.
    pub fn arrive(&mut self, tree: &mut Tree, node: u32, texels: Arc<[u8]>) {
        tree.node_mut(node).color = ColorLife::Ready(texels);
        self.ready.push(node);
    }

    /// Drops the pictures that were read and that plan `number` does not want.
    pub fn drop_unwanted(&mut self, tree: &mut Tree, number: u64) {
        self.ready.retain(|&ready| {
            let node = tree.node_mut(ready);
            let keep = node.color_wanted == number;
            if !keep {
                node.color = ColorLife::Absent;
            }
            keep
        });
    }

    /// The most needed picture of plan `number` that was read and has no layer, and the layer it goes to.
    pub fn upload(&mut self, tree: &mut Tree, number: u64) -> Option<(u32, Arc<[u8]>)> {
        if self.ready.is_empty() {
            return None;
        }
        let is_ready = |&&place: &&u32| matches!(tree.node(place).color, ColorLife::Ready(_));
        let place = *self.wanted.iter().find(is_ready)?;
        let layer = self.take(tree, place, number)?;
        self.ready.retain(|&ready| ready != place);
        match std::mem::replace(&mut tree.node_mut(place).color, ColorLife::Uploaded(layer)) {
            ColorLife::Ready(texels) => Some((layer, texels)),
            _ => None,
        }
    }

    /// Pictures in RAM.
    #[must_use]
    pub fn ready(&self) -> usize {
        self.ready.len()
    }
}

/// How large a texel of a node's picture is on the screen.
fn parent_texel_px(tree: &Tree, node: u32, rule: &CutRule) -> f64 {
    let node = tree.node(node);
    rule.texel_px(
        &node.bounds,
        TILE_CELLS as f64 * tree.corner_and_step(node.id).1[0],
    )
}
