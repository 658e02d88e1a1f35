//! The drawn cut: the wanted one, as far as its tiles are there, balanced by *coarsening*.
//!
//! It covers the data set without overlap, and tiles that touch, by side or by corner, differ by at most one level. It
//! needs nothing that is not there: a tile is split only when all its children are in the pool and all its neighbours
//! of the same level are drawn or split themselves; otherwise it is drawn in their stead.
//!
//! One walk from coarse to fine does it. Each tile carries the nine tiles around itself (of its own level, or coarser
//! where the drawn cut ends there), found among the children of the nine around its parent:
//!
//! ```text
//!   0 1 2      NW N NE
//!   3 4 5      W  ·  E
//!   6 7 8      SW S SE
//! ```

use super::{NO_NODE, Tree};

/// A tile of the drawn cut, with the nodes of the nine tiles around it.
#[derive(Clone, Copy, Debug)]
pub struct Leaf {
    /// Its node.
    pub node: u32,
    /// The nine around it, itself in the middle.
    pub around: [u32; 9],
}

/// The drawn cut. Kept between plans for its memory.
#[derive(Debug, Default)]
pub struct Drawn {
    /// The tiles that are drawn, coarse ones first. A node's `drawn` is its place here.
    pub leaves: Vec<Leaf>,
    level: Vec<Leaf>,
    next: Vec<Leaf>,
}

impl Drawn {
    /// Finds the drawn cut below the wanted one.
    pub fn find(&mut self, tree: &mut Tree) {
        self.leaves.clear();
        self.level.clear();
        if tree.node(Tree::ROOT).slot().is_none() {
            return;
        }
        let mut around = [NO_NODE; 9];
        around[4] = Tree::ROOT;
        self.level.push(Leaf {
            node: Tree::ROOT,
            around,
        });
        while !self.level.is_empty() {
            self.descend(tree);
        }
    }

    fn descend(&mut self, tree: &mut Tree) {
        for visit in &self.level {
            let split = may_split(tree, visit);
            let node = tree.node_mut(visit.node);
            node.drawn_split = split;
            node.drawn = NO_NODE;
            if !split {
                node.drawn = u32::try_from(self.leaves.len()).unwrap_or(NO_NODE);
                self.leaves.push(*visit);
            }
        }
        self.next.clear();
        for visit in self
            .level
            .iter()
            .filter(|visit| tree.node(visit.node).drawn_split)
        {
            self.next.extend(children(tree, visit));
        }
        std::mem::swap(&mut self.level, &mut self.next);
    }
}

fn may_split(tree: &Tree, visit: &Leaf) -> bool {
    let node = tree.node(visit.node);
    let mut children = node
        .children
        .iter()
        .filter(|&&child| child != NO_NODE)
        .peekable();
    node.split
        && children.peek().is_some()
        && children.all(|&child| tree.node(child).slot().is_some())
        && visit
            .around
            .iter()
            .all(|&near| near == NO_NODE || tree.node(near).id.level == node.id.level)
}

fn children<'a>(tree: &'a Tree, visit: &'a Leaf) -> impl Iterator<Item = Leaf> + 'a {
    let node = tree.node(visit.node);
    let present = (0..4).filter(|&quadrant| node.children[quadrant] != NO_NODE);
    present.map(move |quadrant| Leaf {
        node: node.children[quadrant],
        around: std::array::from_fn(|at| near_child(tree, visit, quadrant, at)),
    })
}

/// The tile at place `at` around the child of a quadrant.
fn near_child(tree: &Tree, visit: &Leaf, quadrant: usize, at: usize) -> u32 {
    // In children's steps from the north-west corner of the parent, plus 2 to stay positive.
    let (row, column) = (quadrant / 2 + at / 3 + 1, quadrant % 2 + at % 3 + 1);
    let parent = visit.around[row / 2 * 3 + column / 2];
    if parent == NO_NODE
        || !tree.node(parent).drawn_split
        || tree.node(parent).id.level != tree.node(visit.node).id.level
    {
        return parent;
    }
    tree.node(parent).children[row % 2 * 2 + column % 2]
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::{
        geo::TileId,
        stream::{Life, schedule::mix, synthetic::Synthetic},
    };

    /// A tree with random splits and a random part of its tiles in the pool, ancestors first.
    fn random_tree(seed: u64) -> Tree {
        let source = Synthetic::new(2900, 2100, seed);
        let mut tree = source.whole_tree();
        let mut stack = vec![Tree::ROOT];
        while let Some(place) = stack.pop() {
            let tile = Arc::new(source.tile(tree.node(place).id));
            let node = tree.node_mut(place);
            node.life = Life::Uploaded { tile, slot: place };
            node.split = mix(u64::from(place) ^ seed << 32) % 100 < 96;
            let here = mix(u64::from(place) ^ seed << 33) % 100 < 98;
            let children = node
                .children
                .into_iter()
                .filter(|&child| child != NO_NODE && here);
            stack.extend(children);
        }
        tree
    }

    fn boxes_touch(a: TileId, b: TileId) -> bool {
        let level = a.level.max(b.level);
        let span = |id: TileId| {
            let up = level - id.level;
            [
                (id.row << up, (id.row + 1) << up),
                (id.column << up, (id.column + 1) << up),
            ]
        };
        span(a)
            .iter()
            .zip(span(b))
            .all(|(a, b)| a.0 <= b.1 && b.0 <= a.1)
    }

    #[test]
    fn the_drawn_cut_covers_once_and_is_balanced() {
        for seed in 0..30 {
            let mut tree = random_tree(seed);
            let mut drawn = Drawn::default();
            drawn.find(&mut tree);
            let ids: Vec<_> = drawn
                .leaves
                .iter()
                .map(|leaf| tree.node(leaf.node).id)
                .collect();
            let finest = tree.finest();
            let covered: usize = ids
                .iter()
                .map(|id| {
                    let up = finest - id.level;
                    let [rows, columns] = tree.grid().tiles(finest);
                    let count =
                        |at: u32, end: u32| (((at + 1) << up).min(end) - (at << up)) as usize;
                    count(id.row, rows) * count(id.column, columns)
                })
                .sum();
            let [rows, columns] = tree.grid().tiles(finest);
            assert_eq!(covered, (rows * columns) as usize);
            for a in &ids {
                for b in ids.iter().filter(|b| *b != a) {
                    assert!(
                        a.level.abs_diff(b.level) < 2 || !boxes_touch(*a, *b),
                        "{a} beside {b}"
                    );
                    assert!(
                        a.level >= b.level || b.ancestor(a.level) != *a,
                        "{a} over {b}"
                    );
                }
            }
        }
    }

    #[test]
    fn around_are_the_tiles_around() {
        let mut tree = random_tree(3);
        let mut drawn = Drawn::default();
        drawn.find(&mut tree);
        assert!(drawn.leaves.len() > 30);
        for leaf in &drawn.leaves {
            let id = tree.node(leaf.node).id;
            for (at, near) in leaf.around.iter().enumerate() {
                let row = (i64::from(id.row) + at as i64 / 3 - 1).try_into();
                let column = (i64::from(id.column) + at as i64 % 3 - 1).try_into();
                let (Ok(row), Ok(column)) = (row, column) else {
                    assert_eq!(*near, NO_NODE);
                    continue;
                };
                let wanted = TileId::new(id.level, row, column);
                if *near == NO_NODE {
                    assert!(!tree.grid().has(wanted));
                    continue;
                }
                let near = tree.node(*near);
                assert_eq!(wanted.ancestor(near.id.level), near.id);
                assert!(
                    near.id.level == id.level || near.id.level + 1 == id.level && !near.drawn_split
                );
            }
        }
    }
}
