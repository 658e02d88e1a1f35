//! What every cap of a large cage is off by, at every depth: the bulk of `errors`, for hundreds of thousands of features.
//!
//! A cap is measured against the limit at the same parameters, along the limit's normal: to first order the distance
//! between the surfaces, as the ways their parameters run differ only along them. All faces share the same places, so
//! limit stencils do the work ([`LimitPattern`]), some places at a time to keep memory small. `errors` measures the few
//! caps of small cages without that approximation.

use anyhow::Result;
use drumlin_core::{
    cage::{Cage, LimitPattern},
    fas::{Blocks, Piece, Positions},
};
use glam::DVec3;
use rayon::prelude::*;

use crate::errors::FeatureErrors;

/// Steps along each side of a cap between the places at which it is measured.
const STEPS: u8 = 4;

/// What the caps of every feature are off by at depths from 0 to `deepest`, in the cage's own length.
///
/// At depth 0 a face is one cap, or, beside a deeper feature, its corner a cap of depth 1: the greater of both counts.
///
/// # Errors
/// When the cage has faces that are no quads, or inner vertices of valence 2.
pub fn by_feature(cage: &Cage, deepest: u8) -> Result<Vec<FeatureErrors>> {
    let topology = cage.topology();
    let mut blocks = Blocks::new(topology).map_err(anyhow::Error::msg)?;
    let by_corner = (0..=deepest)
        .map(|depth| by_corner(cage, &mut blocks, depth))
        .collect::<Result<Vec<_>>>()?;
    let of_feature = |vertex: u32| {
        let corners = || topology.vertex_corners(vertex).iter();
        let worst = |depth: usize| {
            let errors = &by_corner[depth];
            corners().fold(0.0_f32, |most, &corner| most.max(errors[corner as usize]))
        };
        let own = |depth: usize| f64::from(worst(depth));
        let mut by_depth: Vec<_> = (0..by_corner.len()).map(own).collect();
        if let [whole, first, ..] = &mut by_depth[..] {
            *whole = whole.max(*first);
        }
        FeatureErrors {
            vertex,
            by_depth,
            least: 0,
        }
    };
    Ok(blocks.features().map(of_feature).collect())
}

/// The error of the cap at every corner of a face, all features at one depth; 0 where there is none.
fn by_corner(cage: &Cage, blocks: &mut Blocks, depth: u8) -> Result<Vec<f32>> {
    let topology = cage.topology();
    let depths = vec![depth; topology.vertex_count() as usize];
    blocks.set_depths(&depths).map_err(anyhow::Error::msg)?;
    let points = Positions::new(blocks, cage.positions());
    let mut caps = [const { Vec::new() }; 4];
    for part in 0..blocks.part_count() {
        points.visit_part(blocks, part, &mut |piece| {
            if piece.is_cap {
                caps[corner_of(piece)].push(piece.clone());
            }
        });
    }
    drop(points);
    let face_count = topology.face_count() as usize;
    let mut errors = vec![0.0_f32; 4 * face_count];
    let mut jets = [0, 1, 2].map(|_| vec![[0.0; 3]; face_count * (usize::from(STEPS) + 1)]);
    for (corner, caps) in caps.iter().enumerate().filter(|(_, caps)| !caps.is_empty()) {
        for row in 0..=STEPS {
            let inside = row_of_places(row);
            let places = inside.map(|uv| on_face(uv, corner, depth));
            let limit = LimitPattern::<f64>::new(topology, &places)?;
            let [at, du, dv] = &mut jets;
            limit.jets_into(cage.positions(), [at, du, dv]);
            let found = caps.par_iter().map(|cap| {
                let first = cap.place.face as usize * inside.len();
                let here = first..first + inside.len();
                let jet = [
                    &jets[0][here.clone()],
                    &jets[1][here.clone()],
                    &jets[2][here],
                ];
                off_by(cap, &inside, jet)
            });
            let found: Vec<f64> = found.collect();
            for (cap, found) in caps.iter().zip(found) {
                let at = 4 * cap.place.face as usize;
                let corners = if depth == 0 { 0..4 } else { corner..corner + 1 };
                for error in &mut errors[at..][corners] {
                    *error = error.max(found as f32);
                }
            }
        }
    }
    Ok(errors)
}

/// The corner of its face that a cap lies at; the first for a whole face.
fn corner_of(cap: &Piece<f64>) -> usize {
    match [cap.place.u, cap.place.v].map(|at| at > 0) {
        [false, false] => 0,
        [true, false] => 1,
        [true, true] => 2,
        [false, true] => 3,
    }
}

fn row_of_places(row: u8) -> [[f64; 2]; STEPS as usize + 1] {
    let step = |index: usize| index as f64 / f64::from(STEPS);
    std::array::from_fn(|column| [step(column), step(usize::from(row))])
}

/// A place of the cap of some depth at a corner, as one of its face.
fn on_face([u, v]: [f64; 2], corner: usize, depth: u8) -> [f64; 2] {
    let side = f64::from(depth).exp2();
    let [column, row] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]][corner];
    let last = side - 1.0;
    [(column * last + u) / side, (row * last + v) / side]
}

/// The greatest distance of a cap from the limit along the limit's normal, at these places.
fn off_by(cap: &Piece<f64>, places: &[[f64; 2]], [at, du, dv]: [&[[f64; 3]]; 3]) -> f64 {
    let distance = |(index, &uv): (usize, &[f64; 2])| {
        let off = DVec3::from(cap.evaluate(uv).position) - DVec3::from(at[index]);
        let normal = DVec3::from(du[index]).cross(DVec3::from(dv[index]));
        match normal.try_normalize() {
            Some(normal) => off.dot(normal).abs(),
            None => off.length(),
        }
    };
    places.iter().enumerate().map(distance).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::terrain_cage::{terrain_cage_of, tests::ground};

    /// Steps along each side of a face between the limit points that are looked at.
    const DENSE: u32 = 24;

    /// The limit at a grid of places of every face: points and unit normals.
    fn dense_limit(cage: &Cage) -> Result<Vec<[DVec3; 2]>> {
        let step = |index: u32| f64::from(index) / f64::from(DENSE);
        let places = (0..=DENSE).flat_map(|v| (0..=DENSE).map(move |u| [step(u), step(v)]));
        let places: Vec<_> = places.collect();
        let samples = LimitPattern::<f64>::new(cage.topology(), &places)?.samples(cage.positions());
        let point = |sample: &drumlin_core::cage::LimitSample| {
            [sample.position, sample.normal].map(DVec3::from)
        };
        Ok(samples.iter().map(point).collect())
    }

    /// From a point to the surface: along the normal of the nearest of its points.
    fn distance(point: DVec3, limit: &[[DVec3; 2]]) -> f64 {
        let nearest = limit.iter().min_by(|a, b| {
            let away = |one: &[DVec3; 2]| one[0].distance_squared(point);
            away(a).total_cmp(&away(b))
        });
        nearest.map_or(f64::NAN, |[at, normal]| (point - *at).dot(*normal).abs())
    }

    #[test]
    fn the_worst_errors_are_distances_to_the_nearest_limit_points() -> Result<()> {
        let cage = terrain_cage_of(&ground(), 301, 6)?;
        let topology = cage.topology();
        let features = by_feature(&cage, 2)?;
        let limit = dense_limit(&cage)?;
        for depth in [1, 2_u8] {
            let error = |feature: &FeatureErrors| feature.by_depth[usize::from(depth)];
            let mut worst: Vec<_> = features.iter().collect();
            worst.sort_by(|a, b| error(b).total_cmp(&error(a)));
            let mut blocks = Blocks::new(topology).map_err(anyhow::Error::msg)?;
            let depths = vec![depth; cage.positions().len()];
            blocks.set_depths(&depths).map_err(anyhow::Error::msg)?;
            let points = Positions::new(&blocks, cage.positions());
            let mut found = 0.0_f64;
            for part in 0..blocks.part_count() {
                points.visit_part(&blocks, part, &mut |cap| {
                    let corner = topology.face_vertices(cap.place.face)[corner_of(cap)];
                    if !cap.is_cap || worst[..4].iter().all(|feature| feature.vertex != corner) {
                        return;
                    }
                    for uv in (0..=STEPS).flat_map(row_of_places) {
                        let point = DVec3::from(cap.evaluate(uv).position);
                        found = found.max(distance(point, &limit));
                    }
                });
            }
            // The two approximations and the grid of limit points: a tenth.
            let ratio = error(worst[0]) / found;
            assert!((0.9..1.1).contains(&ratio), "depth {depth}: {ratio}");
        }
        Ok(())
    }

    #[test]
    fn errors_fall_with_depth() -> Result<()> {
        let features = by_feature(&terrain_cage_of(&ground(), 2001, 7)?, 2)?;
        let worst = |depth: usize| {
            let errors = features.iter().map(|feature| feature.by_depth[depth]);
            errors.fold(0.0, f64::max)
        };
        assert!(worst(0) >= worst(1) && worst(1) > worst(2));
        Ok(())
    }
}
