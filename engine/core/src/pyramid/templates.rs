//! How a cell of a patch is cut into triangles: plain, or with vertices added on edges it shares with a finer
//! neighbour. The one place that says so; builder, references and kernels follow it.
//!
//! ```text
//!  plain            north edge split     all edges split
//!  0-------2        0---1---2            0---1---2
//!  | \     |        | \ | / |            | \ | / |
//!  |   \   |        |   4   |            3---4---5
//!  |     \ |        | /   \ |            | / | \ |
//!  6-------8        6-------8            6---7---8
//! ```
//!
//! A plain cell is cut from north-west to south-east. A cell with a split edge is a fan about its centre sample. The
//! nine points of a cell are numbered row by row.
//! At depth 0 a patch is one cell of 4 × 4 samples, at depth 1 four of 2 × 2, at depth 2 sixteen of one sample; those
//! have no centre and are never split. Up to turns the fifteen sets of split edges of a patch are the five transition
//! templates: one, two adjacent, two opposite, three and four edges.

/// The north edge, in a set of edges.
pub const NORTH: u8 = 1;
/// The east edge.
pub const EAST: u8 = 2;
/// The south edge.
pub const SOUTH: u8 = 4;
/// The west edge.
pub const WEST: u8 = 8;

/// The ring of points around the centre, counter-clockwise as seen from above (row 0 is north), from the north-west:
/// each with the edge that must be split for it to be a vertex.
const RING: [(u8, u8); 8] = [
    (0, 0),
    (3, WEST),
    (6, 0),
    (7, SOUTH),
    (8, 0),
    (5, EAST),
    (2, 0),
    (1, NORTH),
];

/// The triangles of a cell with the given split edges, as points of the cell (row · 3 + column, counted in half
/// sides), counter-clockwise as seen from above: two for a plain cell, else five to eight about the centre.
pub fn cell_triangles(split: u8) -> impl Iterator<Item = [u8; 3]> {
    let plain = [[0, 6, 8], [0, 8, 2]]
        .into_iter()
        .filter(move |_| split == 0);
    let fan = (0..8).filter_map(move |index| {
        let present = |ring: usize| RING[ring % 8].1 & !split == 0;
        let next = if present(index + 1) {
            index + 1
        } else {
            index + 2
        };
        (split != 0 && present(index)).then_some([4, RING[index].0, RING[next % 8].0])
    });
    plain.chain(fan)
}

/// Which edges of a cell at depth 1 are split when those of its patch are: the cell at `row`, `column` (0 or 1)
/// touches two of the patch's edges.
#[must_use]
pub const fn quarter_split(patch_split: u8, row: usize, column: usize) -> u8 {
    let across = if row == 0 { NORTH } else { SOUTH };
    let along = if column == 0 { WEST } else { EAST };
    patch_split & (across | along)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn doubled_area(points: [u8; 3]) -> i32 {
        let [a, b, c] = points.map(|point| [i32::from(point % 3), -i32::from(point / 3)]);
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    }

    #[test]
    fn triangles_cover_the_cell_once_and_face_up() {
        for split in 0..16_u8 {
            let areas: Vec<i32> = cell_triangles(split).map(doubled_area).collect();
            assert!(areas.iter().all(|area| *area > 0), "{split}");
            assert_eq!(areas.iter().sum::<i32>(), 8, "{split}");
            let count = if split == 0 {
                2
            } else {
                4 + split.count_ones() as usize
            };
            assert_eq!(areas.len(), count, "{split}");
        }
    }

    #[test]
    fn a_midpoint_is_a_vertex_when_its_edge_is_split_and_only_then() {
        for split in 0..16_u8 {
            for (point, edge) in [(1, NORTH), (5, EAST), (7, SOUTH), (3, WEST)] {
                let used = cell_triangles(split).any(|triangle| triangle.contains(&point));
                assert_eq!(used, split & edge != 0, "{split} {point}");
            }
        }
    }

    #[test]
    fn quarters_split_outer_edges_only() {
        assert_eq!(quarter_split(15, 0, 0), NORTH | WEST);
        assert_eq!(quarter_split(15, 1, 1), SOUTH | EAST);
        assert_eq!(quarter_split(NORTH, 1, 0), 0);
    }
}
