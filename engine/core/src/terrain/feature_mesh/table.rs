//! A feature's mesh before it has positions: tables, places of vertices, triangles.
//!
//! What depends on topology and depths is here; points come of executing it, on the device by the stage `refine`, or on the
//! CPU in f64 for heights and rays.

use super::{FeatureMesh, FeatureShape, build};
use crate::{
    fas::{Sample, Tables},
    reference::{
        refine::{LEAST_SINE_SQUARE, RefineSite, RefineTables},
        shared::{FEATURE_BORDER, NONE, SAMPLE_BITS, border::TILE_SAMPLES},
    },
};

/// Tables of a feature, and the vertices and triangles wanted of them.
#[derive(Clone, Debug)]
pub struct FeatureTable {
    pub(super) tables: Tables,
    pub(super) sites: Vec<RefineSite>,
    /// For every vertex: column and row in the cut of the sample it is, on the cut's border.
    pub(super) samples: Vec<Option<[u32; 2]>>,
    /// Three a triangle, counter-clockwise seen from outside.
    pub(super) indices: Vec<u32>,
}

impl FeatureTable {
    pub(super) fn new(shape: &FeatureShape, tables: Tables) -> Self {
        build::table(shape, tables)
    }

    /// The mesh, executed on the CPU.
    pub(super) fn execute(&self, shape: &FeatureShape) -> FeatureMesh {
        let points = self.tables.execute(shape.cage.positions());
        let mut mesh = FeatureMesh {
            origin: shape.origin,
            indices: self.indices.clone(),
            ..FeatureMesh::default()
        };
        for (site, border) in self.sites.iter().zip(&self.samples) {
            let mut sample = self.tables.render.evaluate(site.piece, &points, site.uv);
            if let Some([rise, by_u, by_v]) = site.offset {
                sample.position[2] += rise;
                sample.du[2] += by_u;
                sample.dv[2] += by_v;
            }
            mesh.normals.push(narrow(unit_normal(&sample)));
            let (position, tile, code) = match border {
                Some(at) => on_border(shape, *at),
                None => (sample.position, shape.tile_under(sample.position), NONE),
            };
            mesh.positions.push(narrow(position));
            mesh.tiles.push(tile);
            mesh.border.push(code);
        }
        for (vertex, site) in self.sites.iter().enumerate() {
            mesh.positions[vertex] = mesh.positions[site.position_of as usize];
        }
        mesh
    }

    /// What a device is handed: the tables with all vertices but those that are samples of the terrain, and the indices,
    /// three a triangle: vertices, or samples of the feature's tiles (see [`FEATURE_BORDER`]).
    #[must_use]
    pub fn packed(&self, shape: &FeatureShape) -> (RefineTables, Vec<u32>) {
        let mut number = 0;
        let numbers: Vec<u32> = self
            .samples
            .iter()
            .map(|border| match border {
                Some(at) => FEATURE_BORDER | on_border(shape, *at).2,
                None => {
                    number += 1;
                    number - 1
                }
            })
            .collect();
        let inner = self.sites.iter().zip(&self.samples);
        let sites: Vec<_> = inner
            .filter(|(_, border)| border.is_none())
            .map(|(site, _)| RefineSite {
                position_of: numbers[site.position_of as usize],
                ..*site
            })
            .collect();
        let cage = shape.cage.positions();
        let tables = RefineTables::new(&self.tables, cage, &shape.place.ground(), &sites);
        let indices = self.indices.iter().map(|&index| numbers[index as usize]);
        (tables, indices.collect())
    }
}

/// A sample (column, row) on the cut's border: its place in metres from the origin, its tile, and its code.
fn on_border(shape: &FeatureShape, [x, y]: [u32; 2]) -> ([f64; 3], u32, u32) {
    let cut = &shape.place;
    let start = cut.first_sample();
    let rise = f64::from(shape.height([x, y])) * cut.unit - shape.origin[2];
    let position = [f64::from(x) * cut.step[0], f64::from(y) * cut.step[1], rise];
    let (tile, [row, column]) = cut.tile_at([start[0] + y, start[1] + x]);
    (
        position,
        tile,
        tile << SAMPLE_BITS | (row * TILE_SAMPLES + column),
    )
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "metres from the cut's corner are f32"
)]
fn narrow(a: [f64; 3]) -> [f32; 3] {
    a.map(|part| part as f32)
}

/// Upward where the surface has no tangent plane.
fn unit_normal(sample: &Sample<f64>) -> [f64; 3] {
    let [du, dv] = [sample.du, sample.dv].map(glam::DVec3::from);
    let area = du.cross(dv);
    let least = f64::from(LEAST_SINE_SQUARE) * du.length_squared() * dv.length_squared();
    if area.length_squared() <= least {
        return [0.0, 0.0, 1.0];
    }
    area.normalize().into()
}
