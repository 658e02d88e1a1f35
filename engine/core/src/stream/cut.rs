//! The cut a view wants: which tiles to split, by their true error on the screen.
//!
//! A tile is split when ρ = δ K / distance to its box is above the tolerance, so that the error on the screen is under
//! the tolerance wherever the cut is complete. The cut is then balanced by *refining*: tiles that touch, by side or by
//! corner, differ by at most one level. What the view does not see gets a coarser cut, so that turning the camera finds
//! something there.
//!
//! Balance in one pass: a tile may be split when all its neighbours of the same level exist, that is when the up to
//! four tiles of the coarser level around it are split too. Going from fine to coarse, each is marked at most once.

use super::{Bounds, Frustum, NO_NODE, Node, Tree, View};
use crate::geo::TileId;

/// When to split.
#[derive(Clone, Copy, Debug)]
pub struct CutRule {
    eye: [f64; 3],
    frustum: Frustum,
    pixels_per_radian: f64,
    /// Nothing is drawn nearer than the near plane, so nothing counts as nearer: gains stay finite.
    nearest: f64,
    /// Largest screen-space error, pixels.
    pub tolerance: f64,
    /// The tolerance outside the view, as a factor.
    pub outside: f64,
    /// Number of levels of imagery, and the largest texel, pixels.
    pub imagery: Option<(u8, f64)>,
}

impl CutRule {
    /// The rule of a view.
    #[must_use]
    pub fn new(view: &View, tolerance: f64, outside: f64, imagery: Option<(u8, f64)>) -> Self {
        let (frustum, pixels_per_radian) = (view.frustum(), view.pixels_per_radian());
        Self {
            eye: view.eye,
            frustum,
            pixels_per_radian,
            nearest: view.near,
            tolerance,
            outside,
            imagery,
        }
    }

    /// Pixels of a texel of a picture that is `width` metres wide and lies in the box.
    #[must_use]
    pub fn texel_px(&self, bounds: &Bounds, width: f64) -> f64 {
        width / 255.0 * self.pixels_per_radian / bounds.distance(self.eye).max(self.nearest)
    }

    /// Sets a node's `visible`, `gain` and `split`, once a run.
    fn judge(&self, node: &mut Node, finest: u8, run: u64) {
        if node.mark == run {
            return;
        }
        node.mark = run;
        let visible = self.frustum.sees(&node.bounds);
        let allowed = if visible {
            self.tolerance
        } else {
            self.tolerance * self.outside
        };
        let distance = node.bounds.distance(self.eye).max(self.nearest);
        let error = f64::from(node.summary.error).min(1e9);
        let mut gain = error * self.pixels_per_radian / distance / allowed;
        if let Some((levels, texel_px)) = self.imagery
            && node.id.level + 1 < levels
            && visible
        {
            let width = node.bounds.max[0] - node.bounds.min[0];
            gain = gain.max(self.texel_px(&node.bounds, width) / texel_px);
        }
        node.visible = visible;
        node.split = node.id.level < finest && gain > 1.0;
        node.gain = rank(gain, visible);
    }
}

/// Gain as a rank: whatever is visible comes before all that is not.
#[expect(
    clippy::cast_possible_truncation,
    reason = "a rank: clamped, and rounding is harmless"
)]
fn rank(gain: f64, visible: bool) -> f32 {
    let gain = gain.clamp(0.0, 1e9) as f32;
    if visible { gain * 1e12 } else { gain }
}

/// The tiles a plan wants: the tree of the cut, root first, level by level. Kept between plans for its memory.
#[derive(Debug, Default)]
pub struct Wanted {
    /// Nodes of the tree, those that are split and those that are not.
    pub nodes: Vec<u32>,
    /// How many of them are not split.
    pub leaf_count: usize,
    by_level: Vec<Vec<u32>>,
    stack: Vec<u32>,
    run: u64,
}

/// How many tiles a cut may take.
#[derive(Clone, Copy, Debug)]
pub struct CutLimit {
    /// Tiles in all, ancestors among them.
    pub nodes: usize,
    /// Tiles that are drawn.
    pub leaves: usize,
}

impl Wanted {
    /// Finds the cut among the known tiles; false when it is beyond the limit (the list is then of no use).
    pub fn find(&mut self, tree: &mut Tree, rule: &CutRule, limit: CutLimit) -> bool {
        self.run = tree.begin_run();
        self.by_level
            .resize_with(usize::from(tree.finest()) + 1, Vec::new);
        self.by_level.iter_mut().for_each(Vec::clear);
        self.split(tree, rule, limit) && {
            self.balance(tree, rule);
            self.collect(tree, rule);
            self.nodes.len() <= limit.nodes && self.leaf_count <= limit.leaves
        }
    }

    /// Marks the tiles to be split, from the root down; false as soon as there are too many.
    fn split(&mut self, tree: &mut Tree, rule: &CutRule, limit: CutLimit) -> bool {
        let mut count = 1;
        self.stack.clear();
        self.stack.push(Tree::ROOT);
        while let Some(place) = self.stack.pop() {
            let finest = tree.finest();
            let node = tree.node_mut(place);
            rule.judge(node, finest, self.run);
            if node.split {
                let first = self.stack.len();
                self.stack
                    .extend(node.children.iter().filter(|&&child| child != NO_NODE));
                self.by_level[usize::from(node.id.level)].push(place);
                count += self.stack.len() - first;
                if count > limit.nodes {
                    return false;
                }
            }
        }
        true
    }

    /// Marks what must be split too, from fine to coarse. Gains go the same way, so that no tile waits for one that is
    /// less urgent.
    fn balance(&mut self, tree: &mut Tree, rule: &CutRule) {
        for level in (1..self.by_level.len()).rev() {
            let mut at = 0;
            while let Some(&place) = self.by_level[level].get(at) {
                let (id, gain) = (tree.node(place).id, tree.node(place).gain);
                for parent in parents_around(tree, id) {
                    self.require(tree, rule, parent, gain);
                }
                at += 1;
            }
        }
    }

    /// Splits a tile, or its nearest ancestor that is known, on behalf of one that gains by it.
    fn require(&mut self, tree: &mut Tree, rule: &CutRule, mut id: TileId, gain: f32) {
        let place = loop {
            match (tree.find(id), id.parent()) {
                (Some(place), _) => break place,
                (None, Some(parent)) => id = parent,
                (None, None) => return,
            }
        };
        let finest = tree.finest();
        let node = tree.node_mut(place);
        rule.judge(node, finest, self.run);
        node.gain = node.gain.max(gain);
        if !std::mem::replace(&mut node.split, true) {
            self.by_level[usize::from(id.level)].push(place);
        }
    }

    /// Lists the tree, level by level. Tiles that are there for balance alone have not been judged yet; they are not
    /// split, since they gain no more than their parents, which were not worth it.
    fn collect(&mut self, tree: &mut Tree, rule: &CutRule) {
        self.nodes.clear();
        self.nodes.push(Tree::ROOT);
        self.leaf_count = 0;
        let (finest, mut at) = (tree.finest(), 0);
        while let Some(&place) = self.nodes.get(at) {
            let node = tree.node_mut(place);
            if node.mark != self.run {
                rule.judge(node, finest, self.run);
                node.split = false;
            }
            let before = self.nodes.len();
            if node.split {
                let children = node.children.iter().filter(|&&child| child != NO_NODE);
                self.nodes.extend(children);
            }
            self.leaf_count += usize::from(self.nodes.len() == before);
            at += 1;
        }
    }
}

/// The up to four tiles of the coarser level around a tile: its parent, and those of its neighbours.
fn parents_around(tree: &Tree, id: TileId) -> impl Iterator<Item = TileId> + use<> {
    let [rows, columns] = id
        .level
        .checked_sub(1)
        .map_or([0, 0], |level| tree.grid().tiles(level));
    let near = |at: u32| {
        let parent = at / 2;
        let other = if at.is_multiple_of(2) {
            parent.checked_sub(1)
        } else {
            Some(parent + 1)
        };
        [Some(parent), other]
    };
    let rows = near(id.row).map(|row| row.filter(|&row| row < rows));
    let columns = near(id.column).map(|column| column.filter(|&column| column < columns));
    rows.into_iter().flatten().flat_map(move |row| {
        columns
            .into_iter()
            .flatten()
            .map(move |column| TileId::new(id.level.saturating_sub(1), row, column))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stream::synthetic::Synthetic;

    const NO_LIMIT: CutLimit = CutLimit {
        nodes: usize::MAX,
        leaves: usize::MAX,
    };

    fn wanted(tree: &mut Tree, view: &View, limit: CutLimit) -> (Wanted, bool) {
        let rule = CutRule::new(view, 1.0, 4.0, None);
        let mut wanted = Wanted::default();
        let fits = wanted.find(tree, &rule, limit);
        (wanted, fits)
    }

    #[test]
    fn what_is_not_split_is_within_the_tolerance() {
        let mut tree = Synthetic::new(4000, 3000, 5).whole_tree();
        let view = View::looking_at([300.0, -700.0, 200.0], [0.0; 3], 1.0, [1280, 720]);
        let (wanted, fits) = wanted(&mut tree, &view, NO_LIMIT);
        assert!(fits && wanted.leaf_count > 20);
        for &place in &wanted.nodes {
            let node = tree.node(place);
            let error_px = f64::from(node.summary.error) * view.pixels_per_radian()
                / node.bounds.distance(view.eye);
            assert!(
                node.split
                    || node.id.level == tree.finest()
                    || error_px <= if node.visible { 1.0 } else { 4.0 }
            );
        }
    }

    #[test]
    fn a_tile_is_split_only_where_all_its_neighbours_exist() {
        let mut tree = Synthetic::new(4000, 3000, 6).whole_tree();
        let view = View::looking_at([10.0, 20.0, 5.0], [1000.0, 500.0, 0.0], 0.8, [640, 480]);
        let (wanted, _) = wanted(&mut tree, &view, NO_LIMIT);
        let split: Vec<_> = wanted
            .nodes
            .iter()
            .filter(|&&node| tree.node(node).split)
            .collect();
        assert!(split.len() > 10);
        for &&place in &split {
            for parent in parents_around(&tree, tree.node(place).id).filter(|_| place != Tree::ROOT)
            {
                let parent = tree.find(parent).unwrap();
                assert!(tree.node(parent).split && wanted.nodes.contains(&parent));
            }
        }
    }

    #[test]
    fn a_cut_beyond_the_limit_is_refused() {
        let mut tree = Synthetic::new(4000, 3000, 6).whole_tree();
        let view = View::looking_at([10.0, 20.0, 5.0], [1000.0, 500.0, 0.0], 0.8, [640, 480]);
        assert!(
            !wanted(
                &mut tree,
                &view,
                CutLimit {
                    nodes: 20,
                    leaves: usize::MAX
                }
            )
            .1
        );
        assert!(
            !wanted(
                &mut tree,
                &view,
                CutLimit {
                    nodes: usize::MAX,
                    leaves: 10
                }
            )
            .1
        );
    }
}
