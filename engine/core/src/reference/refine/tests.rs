//! The stage against the f64 tables, on a cage with a boundary, a crease and an extraordinary vertex.

use super::*;
use crate::fas::{PieceIndex, Tables, testing::fan};

fn ground() -> RefineGround {
    RefineGround {
        step: [0.5, -0.5],
        size: [4, 4],
        first: [126, 0],
        tiles: [2, 1],
    }
}

/// Corners, sides and the middle of every piece.
fn sites(tables: &Tables) -> Vec<RefineSite> {
    let patches = (0..)
        .take(tables.render.patches.len())
        .map(PieceIndex::Patch);
    let caps = (0..).take(tables.render.caps.len()).map(PieceIndex::Cap);
    let places = [[0.0, 0.0], [1.0, 1.0], [0.5, 0.0], [0.25, 0.625]];
    let mut sites = Vec::new();
    for piece in patches.chain(caps) {
        for uv in places {
            sites.push(RefineSite {
                piece,
                uv,
                offset: None,
                position_of: u32::try_from(sites.len()).unwrap(),
            });
        }
    }
    sites
}

/// f32 against f64: coordinates below 2 and a few dozen roundings, 1e-6; normals of patches an eighth of an edge wide
/// lose three more bits.
#[test]
fn points_and_vertices_are_those_of_the_tables() {
    for sharpness in [0.0, 1.5, f64::INFINITY] {
        let cage = fan(sharpness);
        let tables = Tables::classic(cage.topology(), 3).unwrap();
        let exact = tables.execute(cage.positions());
        let sites = sites(&tables);
        let packed = RefineTables::new(&tables, cage.positions(), &ground(), &sites);
        let (points, vertices) = refine(&packed);
        for (found, wanted) in points.iter().zip(&exact) {
            let wanted = glam::DVec3::from(*wanted);
            assert!(found.as_dvec3().distance(wanted) < 2e-6, "{found} {wanted}");
        }
        for (site, vertex) in sites.iter().zip(&vertices) {
            let wanted = tables.render.evaluate(site.piece, &exact, site.uv);
            let position = glam::DVec3::from(wanted.position);
            let found = Vec3::from(vertex.position).as_dvec3();
            assert!(found.distance(position) < 2e-6, "{site:?}");
            let normal = glam::DVec3::from(wanted.du).cross(wanted.dv.into());
            let angle = Vec3::from(vertex.normal).as_dvec3().angle_between(normal);
            assert!(angle < 1e-4, "{site:?}: {angle}");
        }
    }
}

#[test]
fn an_offset_lifts_a_vertex_and_tilts_it() {
    let cage = fan(0.0);
    let tables = Tables::classic(cage.topology(), 1).unwrap();
    let site = RefineSite {
        piece: PieceIndex::Patch(0),
        uv: [0.5, 0.5],
        offset: None,
        position_of: 0,
    };
    let lifted = RefineSite {
        offset: Some([2.0, 0.25, -0.5]),
        ..site
    };
    let packed = RefineTables::new(&tables, cage.positions(), &ground(), &[site, lifted]);
    let (points, vertices) = refine(&packed);
    let plain = patch_sample(&packed.header, &packed.words, &points, 0, Vec2::splat(0.5));
    assert_eq!(vertices[1].position[2], vertices[0].position[2] + 2.0);
    let (du, dv) = (plain.du + Vec3::Z * 0.25, plain.dv - Vec3::Z * 0.5);
    let wanted = du.cross(dv).normalize();
    assert!(wanted.distance(vertices[1].normal.into()) < 1e-6);
}

#[test]
fn tiles_are_found_under_positions_and_beside_them() {
    let cage = fan(0.0);
    let tables = Tables::classic(cage.topology(), 0).unwrap();
    let header = RefineTables::new(&tables, cage.positions(), &ground(), &[]).header;
    for (x, tile) in [(-3.0, 0), (0.4, 0), (0.99, 0), (1.0, 1), (1.7, 1), (9.0, 1)] {
        assert_eq!(tile_under(&header, Vec3::new(x, -0.6, 0.0)), tile, "{x}");
    }
}

/// A level's bytes: every row and every point it names once, every point it makes.
#[test]
fn bytes_by_level_count_rows_gathers_and_points() {
    let cage = fan(0.0);
    let tables = Tables::classic(cage.topology(), 2).unwrap();
    let packed = RefineTables::new(&tables, cage.positions(), &ground(), &[]);
    let levels = bytes_by_level(&tables);
    let rows: u64 = levels.iter().map(|level| level.rows).sum();
    assert_eq!(rows, 4 * packed.words.len() as u64);
    let points: u64 = levels.iter().map(|level| level.points).sum();
    assert_eq!(points, u64::from(tables.point_count() - tables.cage_points));
    for (bytes, rows) in levels[1..].iter().zip(&tables.levels) {
        let quads = rows.faces.len() + rows.edges.len();
        let plain = 4 * quads + rows.vertex_points.len();
        assert!(bytes.gathered >= 12 * plain as u64);
        assert_eq!(bytes.written, 12 * bytes.points);
    }
}
