//! Exact predicates in plan: points on a fixed grid, so that no rounding decides what is inside of what.
//!
//! x east, y north. Coordinates are smaller than 2²⁹, so that every sign fits 128 bits.

/// A point in plan, in [`PLAN_STEPS`]ths of a sample: x east, y north.
pub(super) type Point = [i64; 2];

/// Steps a finest sample: a millimetre at samples of one metre.
pub(super) const PLAN_STEPS: f64 = 1024.0;

/// Twice the area of a triangle: positive when it is counter-clockwise.
pub(super) const fn turn(a: Point, b: Point, c: Point) -> i64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// True when `d` lies inside the circle through the corners of a counter-clockwise triangle.
pub(super) fn in_circle([a, b, c]: [Point; 3], d: Point) -> bool {
    let [a, b, c] = [a, b, c].map(|p| [i128::from(p[0] - d[0]), i128::from(p[1] - d[1])]);
    let square = |p: [i128; 2]| p[0] * p[0] + p[1] * p[1];
    let cross = |p: [i128; 2], q: [i128; 2]| p[0] * q[1] - p[1] * q[0];
    square(a) * cross(b, c) + square(b) * cross(c, a) + square(c) * cross(a, b) > 0
}

/// True when two segments have a point in common.
pub(super) fn touch([a, b]: [Point; 2], [c, d]: [Point; 2]) -> bool {
    let [abc, abd, cda, cdb] =
        [turn(a, b, c), turn(a, b, d), turn(c, d, a), turn(c, d, b)].map(i64::signum);
    if abc != abd && cda != cdb && abc * abd <= 0 && cda * cdb <= 0 {
        return true;
    }
    (abc == 0 && on(a, b, c))
        || (abd == 0 && on(a, b, d))
        || (cda == 0 && on(c, d, a))
        || (cdb == 0 && on(c, d, b))
}

/// True for a point of the line through `a` and `b` that lies between them.
fn on(a: Point, b: Point, p: Point) -> bool {
    (0..2).all(|axis| a[axis].min(b[axis]) <= p[axis] && p[axis] <= a[axis].max(b[axis]))
}

/// Twice the area inside a loop: positive when it is counter-clockwise.
pub(super) fn area(around: &[Point]) -> i128 {
    let following = around.iter().cycle().skip(1);
    around
        .iter()
        .zip(following)
        .map(|(a, b)| i128::from(a[0]) * i128::from(b[1]) - i128::from(a[1]) * i128::from(b[0]))
        .sum()
}

/// Two sides of a loop that cross or touch where they should not, by their first points; none for a simple loop.
pub(super) fn crossing(around: &[Point]) -> Option<[usize; 2]> {
    let count = around.len();
    let side = |i: usize| [around[i], around[(i + 1) % count]];
    let mut order: Vec<usize> = (0..count).collect();
    let west = |i: usize| side(i)[0][0].min(side(i)[1][0]);
    let east = |i: usize| side(i)[0][0].max(side(i)[1][0]);
    order.sort_by_key(|&i| (west(i), i));
    for (at, &i) in order.iter().enumerate() {
        for &j in order[at + 1..].iter().take_while(|&&j| west(j) <= east(i)) {
            let bad = if (i + 1) % count == j {
                folds(side(i), side(j)[1])
            } else if (j + 1) % count == i {
                folds(side(j), side(i)[1])
            } else {
                touch(side(i), side(j))
            };
            if bad {
                return Some([i.min(j), i.max(j)]);
            }
        }
    }
    None
}

/// True when a loop that has come along a side runs back on it to `next`, or has not moved at all.
fn folds([a, b]: [Point; 2], next: Point) -> bool {
    let dot = (b[0] - a[0]) * (next[0] - b[0]) + (b[1] - a[1]) * (next[1] - b[1]);
    a == b || b == next || (turn(a, b, next) == 0 && dot < 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_that_cross_or_touch_are_told_from_those_that_do_not() {
        let touches = |a, b, c, d| touch([a, b], [c, d]);
        assert!(touches([0, 0], [4, 4], [0, 4], [4, 0]));
        assert!(touches([0, 0], [4, 0], [2, 0], [2, 5]));
        assert!(touches([0, 0], [4, 0], [3, 0], [9, 0]));
        assert!(!touches([0, 0], [4, 0], [5, 0], [9, 0]));
        assert!(!touches([0, 0], [4, 4], [0, 1], [3, 4]));
    }

    #[test]
    fn the_circle_through_three_corners_of_a_square_holds_its_middle_and_not_its_fourth() {
        let square = [[0, 0], [2, 0], [2, 2]];
        assert!(in_circle(square, [1, 1]));
        assert!(!in_circle(square, [0, 2]));
        let far = 1 << 29;
        assert!(!in_circle(
            [[-far, -far], [far, -far], [far, far]],
            [-far, far]
        ));
    }

    #[test]
    fn loops_that_cross_touch_or_turn_back_are_found() {
        assert_eq!(crossing(&[[0, 0], [4, 0], [4, 4], [0, 4]]), None);
        assert!(crossing(&[[0, 0], [4, 4], [4, 0], [0, 4]]).is_some());
        assert!(crossing(&[[0, 0], [4, 0], [2, 0], [2, 4]]).is_some());
        assert!(crossing(&[[0, 0], [4, 0], [4, 4], [2, 0], [0, 4]]).is_some());
        assert!(crossing(&[[0, 0], [0, 0], [4, 4], [0, 4]]).is_some());
    }
}
