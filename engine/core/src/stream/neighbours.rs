//! How the tiles of the drawn cut lie beside each other: who is across each side, who owns each corner.

use super::{Leaf, NO_NODE, Tree};
use crate::geo::TILE_CELLS;

/// What lies across half a side; the number is the place in the drawn list.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Nothing: the data set ends.
    None,
    /// A tile of the same level.
    Same(u32),
    /// A tile one level coarser.
    Coarser(u32),
    /// A tile one level finer.
    Finer(u32),
}

/// The surroundings of a drawn tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Neighbours {
    /// Across the north, east, south and west side; the west or north half first. Both halves are equal but where the
    /// neighbours are finer; of these one may be missing, where the data set ends in the middle of the side.
    pub sides: [[Side; 2]; 4],
    /// The drawn tile that owns each corner, NW, NE, SW, SE: the coarsest of those that touch it, of these the first
    /// by row and column.
    pub corner_tile: [u32; 4],
    /// The owner's sample at that corner, row by row.
    pub corner_sample: [u32; 4],
}

#[expect(clippy::cast_possible_truncation, reason = "it is 128")]
const CELLS: u32 = TILE_CELLS as u32;

/// The surroundings of a leaf.
#[must_use]
pub fn neighbours(tree: &Tree, leaf: &Leaf) -> Neighbours {
    let corners = [0, 1, 2, 3].map(|corner| corner_owner(tree, leaf, corner));
    Neighbours {
        // Places around the tile, and the children of a neighbour there that touch it.
        sides: [(1, [2, 3]), (5, [0, 2]), (7, [0, 1]), (3, [1, 3])]
            .map(|(at, near)| side(tree, leaf, at, near)),
        corner_tile: corners.map(|(tile, _)| tile),
        corner_sample: corners.map(|(_, sample)| sample),
    }
}

fn side(tree: &Tree, leaf: &Leaf, at: usize, near: [usize; 2]) -> [Side; 2] {
    let place = leaf.around[at];
    if place == NO_NODE {
        return [Side::None; 2];
    }
    let node = tree.node(place);
    if node.id.level < tree.node(leaf.node).id.level {
        [Side::Coarser(node.drawn); 2]
    } else if !node.drawn_split {
        [Side::Same(node.drawn); 2]
    } else {
        near.map(|child| match node.children[child] {
            NO_NODE => Side::None,
            child => Side::Finer(tree.node(child).drawn),
        })
    }
}

fn corner_owner(tree: &Tree, leaf: &Leaf, corner: usize) -> (u32, u32) {
    let id = tree.node(leaf.node).id;
    let (south, east) = (corner / 2, corner % 2);
    let places = [4, south * 6 + 1, 3 + east * 2, south * 6 + east * 2];
    let touching = places
        .map(|at| leaf.around[at])
        .into_iter()
        .filter(|&near| near != NO_NODE);
    let coarse = touching
        .map(|near| tree.node(near))
        .filter(|near| !near.drawn_split);
    // The tile itself is among them.
    let Some(owner) = coarse.min_by_key(|near| (near.id.level, near.id.row, near.id.column)) else {
        return (tree.node(leaf.node).drawn, 0);
    };
    let up = id.level - owner.id.level;
    // Samples from the owner's first to the corner; it touches the owner, so there are 0 to 128.
    let sample = |corner: u32, first: u32| ((corner * CELLS) >> up) - first * CELLS;
    let row = sample(id.row + u32::from(corner >= 2), owner.id.row);
    let column = sample(id.column + u32::from(corner % 2 == 1), owner.id.column);
    (owner.drawn, row * (CELLS + 1) + column)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        geo::TileId,
        stream::{CutRule, Drawn, Life, View, Wanted, cut::CutLimit, synthetic::Synthetic},
    };

    fn drawn() -> (Tree, Drawn) {
        let source = Synthetic::new(1500, 1300, 4);
        let mut tree = source.whole_tree();
        for place in 0..tree.places() {
            let tile = std::sync::Arc::new(source.tile(tree.node(place).id));
            tree.node_mut(place).life = Life::Uploaded { tile, slot: place };
        }
        let view = View::looking_at(
            [-300.0, 200.0, 80.0],
            [-280.0, 200.0, 50.0],
            0.9,
            [600, 400],
        );
        let limit = CutLimit {
            nodes: usize::MAX,
            leaves: usize::MAX,
        };
        assert!(Wanted::default().find(&mut tree, &CutRule::new(&view, 1.0, 4.0, None), limit));
        let mut drawn = Drawn::default();
        drawn.find(&mut tree);
        (tree, drawn)
    }

    #[test]
    fn relations_are_mutual() {
        let (tree, drawn) = drawn();
        let all: Vec<_> = drawn
            .leaves
            .iter()
            .map(|leaf| neighbours(&tree, leaf))
            .collect();
        let mut seen = [false; 4];
        for (index, around) in (0u32..).zip(&all) {
            for (side, halves) in around.sides.iter().enumerate() {
                let across = |other: u32| all[other as usize].sides[(side + 2) % 4];
                for half in halves {
                    match *half {
                        Side::None => seen[0] = true,
                        Side::Same(other) => {
                            assert_eq!(across(other), [Side::Same(index); 2]);
                            seen[1] = true;
                        }
                        Side::Coarser(other) => {
                            assert!(across(other).contains(&Side::Finer(index)));
                            seen[2] = true;
                        }
                        Side::Finer(other) => {
                            assert_eq!(across(other), [Side::Coarser(index); 2]);
                            seen[3] = true;
                        }
                    }
                }
            }
        }
        assert_eq!(seen, [true; 4]);
    }

    #[test]
    fn all_tiles_at_a_corner_name_the_same_owner() {
        let (tree, drawn) = drawn();
        let id = |index: u32| tree.node(drawn.leaves[index as usize].node).id;
        let finest = tree.finest();
        let place = |tile: TileId, sample: u32| {
            let up = finest - tile.level;
            [
                tile.row * 128 + sample / 129,
                tile.column * 128 + sample % 129,
            ]
            .map(|at| at << up)
        };
        let mut owners = std::collections::HashMap::new();
        for (index, leaf) in (0u32..).zip(&drawn.leaves) {
            let around = neighbours(&tree, leaf);
            for (corner, sample) in [0, 128, 128 * 129, 128 * 129 + 128].into_iter().enumerate() {
                let (owner, owned) = (around.corner_tile[corner], around.corner_sample[corner]);
                assert_eq!(place(id(index), sample), place(id(owner), owned));
                assert!(id(owner).level <= id(index).level);
                let before = owners
                    .entry(place(id(index), sample))
                    .or_insert((owner, owned));
                assert_eq!(*before, (owner, owned));
            }
        }
    }
}
