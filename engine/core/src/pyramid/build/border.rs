//! How a level runs on past its data: smoothly to whole tiles, and mirrored for whoever fits at an end.
//!
//! The samples past the data are a function of the data near by, however far the rectangle in hand reaches: a line of
//! them depends on one sample more each way than the line before.

use super::area::Area;
use super::samples::Samples;
use crate::geo::{Grid, TILE_CELLS};
use crate::pyramid::PyramidError;

/// How far along the border the data reach that decide a continued sample: a sample a line, two tiles at most.
const REACH: usize = 2 * TILE_CELLS + 1;
/// Whole units: past some lines the slope is rounding and no more.
const SLOPE_LINES: usize = 8;

/// Rows and columns of a level's plane: whole tiles, an even number of them unless the level is the coarsest, so that
/// the next coarser level can be fitted to it without asking what lies beyond.
pub(super) fn plane_size(grid: &Grid, level: u8) -> [usize; 2] {
    let even = |count: u32| {
        if level == 0 {
            count
        } else {
            count.next_multiple_of(2)
        }
    };
    grid.tiles(level)
        .map(|count| even(count) as usize * TILE_CELLS + 1)
}

/// The samples of an area of a plane of `size` whose first rows and columns are `data`, which `load` gives for any
/// area of them; what lies past them is continued.
pub(super) fn continued(
    area: &Area,
    data: [usize; 2],
    size: [usize; 2],
    load: impl Fn(&Area) -> Result<Samples, PyramidError>,
) -> Result<Samples, PyramidError> {
    let inner = Area::whole(data);
    if inner.contains(area) {
        return load(area);
    }
    let outer = reach(area, &inner).and(&Area::whole(size));
    let known = load(&outer.and(&inner))?;
    let mut all = Samples::new(outer.clone(), vec![0; outer.count()]);
    all.put(&known);
    drop(known);
    continue_past(&mut all, outer.and(&inner).size());
    Ok(all.crop(area))
}

/// An area grown to all that decides it.
fn reach(area: &Area, data: &Area) -> Area {
    let mut outer = area.clone();
    let [rows_end, columns_end] = [data.rows.end, data.columns.end];
    if area.rows.end > rows_end {
        outer.rows.start = outer.rows.start.min(rows_end - 2);
        outer = outer.grown([0, REACH]);
    }
    if outer.columns.end > columns_end {
        outer.columns.start = outer.columns.start.min(columns_end - 2);
        outer = outer.grown([REACH, 0]);
    }
    outer
}

/// Continues heights and voids past the first rows and columns to the whole rectangle.
///
/// Heights run on with a slope that fades, and are smoothed along the border, the more the farther out: noise must not
/// make ridges.
fn continue_past(samples: &mut Samples, [rows, columns]: [usize; 2]) {
    let width = samples.columns;
    for column in columns..width {
        let values = &mut samples.values[..rows * width];
        continue_column(values, width, column, column - columns);
    }
    for row in rows..samples.rows {
        let (done, rest) = samples.values.split_at_mut(row * width);
        let last = &done[(row - 1) * width..];
        let before = &done[row.saturating_sub(2) * width..][..width];
        let line = next_line(
            row - rows,
            width,
            |place| last[place],
            |place| before[place],
        );
        rest[..width].copy_from_slice(&line);
    }
    if samples.voids.is_some() {
        continue_voids(samples, [rows, columns]);
    }
}

/// One more column past the border.
fn continue_column(values: &mut [i32], width: usize, column: usize, distance: usize) {
    let rows = values.len() / width;
    let before = column.saturating_sub(2);
    let line = next_line(
        distance,
        rows,
        |row| values[row * width + column - 1],
        |row| values[row * width + before],
    );
    for (row, height) in line.into_iter().enumerate() {
        values[row * width + column] = height;
    }
}

/// One more line past the border: the last one smoothed along itself, plus half its smoothed slope.
fn next_line(
    distance: usize,
    len: usize,
    last: impl Fn(usize) -> i32,
    before: impl Fn(usize) -> i32,
) -> Vec<i32> {
    let slope = |place: usize| {
        if distance < SLOPE_LINES {
            (last(place) - before(place)) / 2
        } else {
            0
        }
    };
    let around = |place: usize| [place.saturating_sub(1), place, (place + 1).min(len - 1)];
    (0..len)
        .map(|place| weigh(around(place).map(&last)) + weigh(around(place).map(slope)))
        .collect()
}

/// (1, 2, 1) / 4, rounded.
fn weigh([a, b, c]: [i32; 3]) -> i32 {
    (a + 2 * b + c + 2) >> 2
}

fn continue_voids(samples: &mut Samples, [rows, columns]: [usize; 2]) {
    for row in 0..samples.rows {
        let first = if row < rows { columns } else { 0 };
        for column in first..samples.columns {
            if samples.is_void(row.min(rows - 1), column.min(columns - 1)) {
                samples.set_void(row, column);
            }
        }
    }
}

/// The samples of an area that reaches past a plane's ends by less than a tile: there they run on turned by half a
/// circle about the last sample, with the same slope and no bend. `load` gives those of any area of the plane.
pub(super) fn mirrored(
    area: &Area,
    size: [usize; 2],
    load: impl Fn(&Area) -> Result<Samples, PyramidError>,
) -> Result<Samples, PyramidError> {
    let inner = Area::whole(size).and(area);
    if inner == *area {
        return load(area);
    }
    let mut all = Samples::new(area.clone(), vec![0; area.count()]);
    all.put(&load(&inner)?);
    let [first_row, first_column] = area.offset_of(&inner);
    let [inner_rows, inner_columns] = inner.size();
    let columns = first_column..first_column + inner_columns;
    let rows = first_row..first_row + inner_rows;
    for column in (0..columns.start).rev().chain(columns.end..all.columns) {
        let [end, inside] = turned(column, &columns);
        for row in rows.clone() {
            turn(&mut all, [row, column], [row, end], [row, inside]);
        }
    }
    for row in (0..rows.start).rev().chain(rows.end..all.rows) {
        let [end, inside] = turned(row, &rows);
        for column in 0..all.columns {
            turn(&mut all, [row, column], [end, column], [inside, column]);
        }
    }
    Ok(all)
}

/// The end of a range that a place is past, and the place it mirrors.
fn turned(place: usize, range: &std::ops::Range<usize>) -> [usize; 2] {
    let end = if place < range.start {
        range.start
    } else {
        range.end - 1
    };
    [end, 2 * end - place]
}

fn turn(samples: &mut Samples, to: [usize; 2], end: [usize; 2], inside: [usize; 2]) {
    let at = |[row, column]: [usize; 2]| row * samples.columns + column;
    let height = 2 * samples.values[at(end)] - samples.values[at(inside)];
    let place = at(to);
    samples.values[place] = height;
    if samples.is_void(inside[0], inside[1]) {
        samples.set_void(to[0], to[1]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(rows: u32, columns: u32) -> Grid {
        Grid {
            columns,
            rows,
            origin: [0.0, 0.0],
            step: [1.0, -1.0],
        }
    }

    fn load(height: impl Fn(i64, i64) -> i32) -> impl Fn(&Area) -> Result<Samples, PyramidError> {
        move |area| {
            let columns = area.columns.clone();
            let places = area
                .rows
                .clone()
                .flat_map(|row| columns.clone().map(move |column| (row, column)));
            let mut samples =
                Samples::new(area.clone(), places.map(|(r, c)| height(r, c)).collect());
            for (row, column) in
                (0..samples.rows).flat_map(|r| (0..area.size()[1]).map(move |c| (r, c)))
            {
                if (row + usize::try_from(area.rows.start).unwrap()) % 50 == 13 && column % 2 == 0 {
                    samples.set_void(row, column);
                }
            }
            Ok(samples)
        }
    }

    fn rough(row: i64, column: i64) -> i32 {
        i32::try_from((row * 7919 + column * 104_729).rem_euclid(1001)).unwrap()
    }

    #[test]
    fn planes_cover_an_even_number_of_tiles_except_at_the_root() {
        let grid = grid(1201, 300);
        assert_eq!(plane_size(&grid, 4), [1281, 513]);
        assert_eq!(plane_size(&grid, 3), [769, 257]);
        assert_eq!(plane_size(&grid, 0), [129, 129]);
    }

    #[test]
    fn a_plane_runs_on_without_a_step() {
        let slope = |row: i64, column: i64| i32::try_from(16 * (row + column)).unwrap();
        let all = Area::whole([257, 257]);
        let level = continued(&all, [200, 200], [257, 257], load(slope)).unwrap();
        for at in (0..256 * 257).filter(|at| at % 257 < 256) {
            assert!((level.values[at + 1] - level.values[at]).abs() <= 17);
            assert!((level.values[at + 257] - level.values[at]).abs() <= 17);
        }
    }

    #[test]
    fn one_sample_runs_on_as_flat_ground() {
        let all = Area::whole([129, 129]);
        let level = continued(&all, [1, 1], [129, 129], load(|_, _| 77)).unwrap();
        assert!(level.values.iter().all(|height| *height == 77));
    }

    #[test]
    fn any_part_runs_on_as_the_whole_does() {
        for (data, size) in [
            ([900, 1030], [1025, 1281]),
            ([1, 700], [257, 769]),
            ([257, 3], [257, 257]),
        ] {
            let whole = continued(&Area::whole(size), data, size, load(rough)).unwrap();
            let middle = size.map(|count| count / 2);
            for (first, last) in [
                (data, size),
                ([0, middle[1]], [middle[0], size[1]]),
                (middle, size),
            ] {
                let first = [0, 1].map(|axis| first[axis].min(last[axis] - 1));
                let area = Area::new(first[0]..last[0], first[1]..last[1]);
                let part = continued(&area, data, size, load(rough)).unwrap();
                assert!(
                    part.values == whole.crop(&area).values,
                    "{area:?} of {data:?}"
                );
            }
        }
    }

    #[test]
    fn slopes_go_on_past_an_end() {
        let slope = |row: i64, column: i64| i32::try_from(16 * row - 5 * column).unwrap();
        let area = Area::whole([129, 257]).grown([60, 60]);
        let samples = mirrored(&area, [129, 257], load(slope)).unwrap();
        for (row, at) in area.rows.clone().enumerate() {
            for (column, place) in area.columns.clone().enumerate() {
                assert_eq!(
                    samples.values[row * samples.columns + column],
                    slope(at, place)
                );
            }
        }
    }
}
