//! A coarser level's texels from the finer one's: every second texel, weighed (1, 2, 1) with its neighbours each way.

use super::block::Area;
use super::layers::Layers;
use super::slots::{NOT_MADE, Slots};
use super::{STEPS, Texel};
use crate::geo::TileId;
use crate::pyramid::PyramidError;
use crate::pyramid::light::{LINEAR, encode};

/// Weights of three texels in a row.
const WEIGHTS: [f32; 3] = [1.0, 2.0, 1.0];

/// Which texels of a block the finer level makes all of.
pub(super) struct Whole(Option<Vec<bool>>);

impl Whole {
    /// True when that is all of them.
    pub(super) const fn is_whole(&self) -> bool {
        self.0.is_none()
    }

    /// True when it is the one at an index.
    pub(super) fn is_at(&self, index: usize) -> bool {
        self.0.as_ref().is_none_or(|whole| whole[index])
    }
}

/// The means of what the finer level has around a block's texels, and where it has all of it.
pub(super) fn reduce(
    area: &Area,
    layers: &Layers<'_>,
    finer: Option<&Slots>,
) -> Result<(Vec<Texel>, Whole), PyramidError> {
    let (rows, columns) = (area.lattice_rows(), area.lattice_columns());
    let count = rows.len() * columns.len();
    let children = TileId::new(area.level, area.row, 0).children();
    let around = area.tiles.start.saturating_mul(2).saturating_sub(1)..2 * area.tiles.end + 1;
    let rows_around = children[0].row.saturating_sub(1)..children[2].row + 2;
    let grid = layers.grid;
    let has_any = finer.is_some()
        && rows_around
            .flat_map(|row| around.clone().map(move |column| [row, column]))
            .any(|[row, column]| layers.has(TileId::new(area.level + 1, row, column)));
    let Some(finer) = finer.filter(|_| has_any) else {
        return Ok((vec![[0; 4]; count], Whole(Some(vec![false; count]))));
    };
    let size = grid
        .tiles(area.level + 1)
        .map(|tiles| tiles as usize * STEPS + 1);
    // Where the level has an odd number of tiles, the coarser lattice ends half a tile past the finer one.
    let reach = |range: &std::ops::Range<usize>, axis: usize| {
        let start = (2 * range.start).saturating_sub(1).min(size[axis]);
        start..(2 * range.end).min(size[axis])
    };
    let (fine_rows, fine_columns) = (reach(&rows, 0), reach(&columns, 1));
    let width = fine_columns.len();
    let fine = finer.lattice(area.level + 1, &fine_rows, &fine_columns, |tile| {
        layers.has(tile)
    })?;
    let mut texels = Vec::with_capacity(count);
    let mut whole = vec![true; count];
    let mut lines: [(usize, Vec<[f32; 4]>); 3] = std::array::from_fn(|_| (usize::MAX, Vec::new()));
    for row in rows {
        for below in 0..3 {
            // Line 2 of a row is line 0 of the next.
            let at = (2 * row + below)
                .checked_sub(1)
                .filter(|at| fine_rows.contains(at));
            if below == 0 && at.is_some() && lines[2].0 == 2 * row - 1 {
                lines.swap(0, 2);
                continue;
            }
            lines[below].0 = at.unwrap_or(usize::MAX);
            lines[below].1.clear();
            if let Some(at) = at {
                let line = &fine[(at - fine_rows.start) * width..][..width];
                lines[below].1.extend(line.iter().map(covered));
            }
        }
        for column in columns.clone() {
            let (texel, all) = mean(&lines, 2 * column, fine_columns.clone());
            whole[texels.len()] = all && 2 * row < size[0] && 2 * column < size[1];
            texels.push(texel);
        }
    }
    let whole = if whole.iter().all(|whole| *whole) {
        None
    } else {
        Some(whole)
    };
    Ok((texels, Whole(whole)))
}

/// Linear light of the colours, and alpha of 255; less than 0 where the texel is not made.
fn covered(texel: &Texel) -> [f32; 4] {
    if *texel == NOT_MADE {
        return [0.0, 0.0, 0.0, -1.0];
    }
    let [r, g, b, alpha] = *texel;
    let [r, g, b] = [r, g, b].map(|value| LINEAR[usize::from(value)]);
    [r, g, b, f32::from(alpha)]
}

/// The mean around a column of the middle line, and whether all that is there is made.
fn mean(
    lines: &[(usize, Vec<[f32; 4]>); 3],
    center: usize,
    columns: std::ops::Range<usize>,
) -> (Texel, bool) {
    let (mut sum, mut weights, mut all) = ([0.0_f32; 4], 0.0, true);
    for ((_, line), row_weight) in lines.iter().zip(WEIGHTS) {
        if line.is_empty() {
            continue;
        }
        for (across, column_weight) in WEIGHTS.into_iter().enumerate() {
            let Some(column) = (center + across)
                .checked_sub(1)
                .filter(|at| columns.contains(at))
            else {
                continue;
            };
            let [r, g, b, alpha] = line[column - columns.start];
            let weight = row_weight * column_weight;
            weights += weight;
            all &= alpha >= 0.0;
            let covered = weight * alpha.max(0.0);
            for (sum, value) in sum.iter_mut().zip([r, g, b, 1.0]) {
                *sum += covered * value;
            }
        }
    }
    if sum[3] == 0.0 {
        return ([0; 4], all);
    }
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a mean of u8"
    )]
    let alpha = (sum[3] / weights).round() as u8;
    if alpha == 0 {
        return ([0; 4], all);
    }
    let [r, g, b] = [sum[0], sum[1], sum[2]].map(|light| encode(light / sum[3]));
    ([r, g, b, alpha], all)
}
