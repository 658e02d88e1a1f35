//! The limit at a vertex itself, by its masks.

use glam::DVec3;
use std::f64::consts::PI;

use super::ring::Ring;
use crate::subdiv::{
    CREASE_LIMIT, VertexRule, crease_tangent, smooth_limit, smooth_tangent, vertex_rule,
};

/// Limit position of a vertex, tangents along the patch's two sides there, and the direction of the normal.
#[derive(Clone, Copy, Debug)]
pub(super) struct VertexLimit {
    pub(super) position: DVec3,
    pub(super) du: DVec3,
    pub(super) dv: DVec3,
    pub(super) normal: DVec3,
}

/// The limit at a ring's vertex, the sides being those that leave and arrive there. `None` where no mask is known:
/// sharpness that still wears off, darts, and corners of more than one quad.
pub(super) fn vertex_limit(ring: &Ring) -> Option<VertexLimit> {
    if !ring.settled() {
        return None;
    }
    let [sharp, _] = ring.sharp_counts();
    match vertex_rule(ring.sharpness, sharp) {
        VertexRule::Smooth if sharp == 0 => Some(smooth(ring)),
        VertexRule::Crease => Some(crease(ring)),
        VertexRule::Corner => corner(ring),
        VertexRule::Smooth => None,
    }
}

fn smooth(ring: &Ring) -> VertexLimit {
    let valence = ring.spokes.len();
    let mask = smooth_limit(valence);
    let edges: DVec3 = ring.spokes.iter().sum();
    let diagonals: DVec3 = ring.diagonals.iter().sum();
    let position = mask.vertex * ring.center + mask.edge * edges + mask.diagonal * diagonals;
    let tangent = |along: usize| {
        let weighted = |i: usize| {
            let [edge, diagonal] = smooth_tangent(valence, (i + valence - along) % valence);
            // Relative to the vertex, whose weight is zero: keeps digits.
            edge * (ring.spokes[i] - ring.center) + diagonal * (ring.diagonals[i] - ring.center)
        };
        (0..valence).map(weighted).sum::<DVec3>()
    };
    let (du, dv) = (tangent(ring.at), tangent(ring.spoke(1)));
    let normal = if valence == 2 {
        du.cross(ring.diagonals[ring.at] - ring.diagonals[ring.quad(1)])
    } else {
        du.cross(dv)
    };
    VertexLimit {
        position,
        du,
        dv,
        normal,
    }
}

/// One-sided: the side of the crease that holds the patch.
fn crease(ring: &Ring) -> VertexLimit {
    let count = ring.spokes.len();
    let is_sharp = |spoke: usize| ring.spoke_sharpness[spoke] > 0.0;
    let back = (0..count)
        .find(|&k| is_sharp(ring.spoke(-(k as isize))))
        .unwrap_or(0);
    let first = ring.spoke(-(back as isize));
    let spoke = |k: usize| (first + k) % count;
    let faces = (1..count).find(|&k| is_sharp(spoke(k))).unwrap_or(1);
    let last = spoke(faces);

    let relative = |point: DVec3| point - ring.center;
    let ends = [relative(ring.spokes[first]), relative(ring.spokes[last])];
    let position = ring.center + CREASE_LIMIT[1] * (ends[0] + ends[1]);
    let along = 0.5 * (ends[0] - ends[1]);
    let mask = crease_tangent(faces);
    let mut across = mask.crease * (ends[0] + ends[1]);
    for k in 0..faces {
        if k > 0 {
            across += mask.edge(k) * relative(ring.spokes[spoke(k)]);
        }
        across += mask.diagonal(k) * relative(ring.diagonals[(first + k) % ring.diagonals.len()]);
    }
    let tangent = |k: usize| {
        let (sin, cos) = (PI * k as f64 / faces as f64).sin_cos();
        cos * along + sin * across
    };
    VertexLimit {
        position,
        du: tangent(back),
        dv: tangent(back + 1),
        normal: along.cross(across),
    }
}

/// A corner whose patch lies between two sharp sides.
fn corner(ring: &Ring) -> Option<VertexLimit> {
    let [u, v] = [ring.spoke(0), ring.spoke(1)];
    let alone = ring.spoke_sharpness[u] > 0.0 && ring.spoke_sharpness[v] > 0.0;
    let (du, dv) = (ring.spokes[u] - ring.center, ring.spokes[v] - ring.center);
    alone.then(|| VertexLimit {
        position: ring.center,
        du,
        dv,
        normal: du.cross(dv),
    })
}
