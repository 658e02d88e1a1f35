//! Laws of feature meshes.

use std::collections::HashMap;

use glam::Vec3;

use super::{
    FeatureMesh, FeatureShape,
    synthetic::{ARCH_PATCHES, arch_cage, arch_place, ground_control},
};
use crate::reference::{
    refine::refine,
    shared::{FEATURE_BORDER, NONE},
};

/// The arch's shape, on samples that are off the limit surface.
fn arch_shape() -> FeatureShape {
    let cage = arch_cage(200.0, ground_control);
    FeatureShape::new(&cage, arch_place(1.0, 0.125), |[row, column]| {
        (810 + (row * 7 + column * 5) % 13).cast_signed()
    })
    .unwrap()
}

fn depths(shape: &FeatureShape, seed: u64, most: u64) -> Vec<u8> {
    (0..shape.vertex_count())
        .map(|vertex| {
            u8::try_from(crate::stream::mix(seed ^ u64::from(vertex)) % (most + 1)).unwrap()
        })
        .collect()
}

/// Directed edges by the bits of their ends' positions.
fn edges(mesh: &FeatureMesh) -> HashMap<[[u32; 3]; 2], i32> {
    let mut edges = HashMap::new();
    for triangle in mesh.indices.chunks_exact(3) {
        let corner = [0, 1, 2].map(|i| mesh.positions[triangle[i] as usize].map(f32::to_bits));
        for i in 0..3 {
            *edges.entry([corner[i], corner[(i + 1) % 3]]).or_default() += 1;
        }
    }
    edges
}

#[test]
fn a_mesh_is_closed_but_for_the_cuts_border_whatever_its_depths() {
    let shape = arch_shape();
    for seed in 0..6 {
        let mesh = shape.mesh(&depths(&shape, seed, seed.min(4))).unwrap();
        let edges = edges(&mesh);
        let open: Vec<_> = edges
            .iter()
            .filter(|([a, b], _)| !edges.contains_key(&[*b, *a]))
            .collect();
        assert!(edges.values().all(|&count| count == 1), "seed {seed}");
        let around = 2 * 4 * (ARCH_PATCHES[0] + ARCH_PATCHES[1]) as usize;
        assert_eq!(open.len(), around, "seed {seed}");
        for ([a, b], _) in open {
            let at = |corner: &[u32; 3]| corner.map(f32::from_bits);
            let (a, b) = (at(a), at(b));
            let length = (a[0] - b[0]).abs() + (a[1] - b[1]).abs();
            assert!(
                (length - 1.0).abs() < 1e-6,
                "stride 1 along the border: {a:?} {b:?}"
            );
        }
    }
}

#[test]
fn border_vertices_are_the_samples() {
    let shape = arch_shape();
    let mesh = shape.mesh(&depths(&shape, 3, 3)).unwrap();
    let mut seen = 0;
    for ((position, &code), &tile) in mesh.positions.iter().zip(&mesh.border).zip(&mesh.tiles) {
        if code == NONE {
            continue;
        }
        seen += 1;
        let (at, sample) = (code >> 15, code & 0x7fff);
        assert_eq!(at, tile);
        let [row, column] = [sample / 129, at * 128 + sample % 129];
        let height = f64::from(810 + (row * 7 + column * 5) % 13) * 0.125;
        let wanted = [
            f64::from(column) - 104.0,
            20.0 - f64::from(row),
            height - mesh.origin[2],
        ];
        for axis in 0..3 {
            assert_eq!(f64::from(position[axis]), wanted[axis], "{row} {column}");
        }
    }
    assert_eq!(seen, 2 * 4 * (ARCH_PATCHES[0] + ARCH_PATCHES[1]));
}

#[test]
fn normals_are_unit_and_lie_with_their_triangles() {
    let shape = arch_shape();
    let mesh = shape.mesh(&vec![3; shape.vertex_count() as usize]).unwrap();
    for normal in &mesh.normals {
        let length: f32 = normal.iter().map(|part| part * part).sum();
        assert!((length - 1.0).abs() < 1e-5);
    }
    let mut wrong = 0;
    for triangle in mesh.indices.chunks_exact(3) {
        let [a, b, c] = [0, 1, 2].map(|i| Vec3::from(mesh.positions[triangle[i] as usize]));
        let face = (b - a).cross(c - a).normalize_or_zero();
        let turned = triangle
            .iter()
            .any(|&corner| Vec3::from(mesh.normals[corner as usize]).dot(face) < 0.3);
        wrong += usize::from(turned);
    }
    assert!(wrong * 200 < mesh.indices.len() / 3, "{wrong} triangles");
}

#[test]
fn nearer_eyes_get_deeper_meshes_and_the_arch_stands_above_the_ground() {
    let shape = arch_shape();
    let [x, y, z] = shape.origin();
    let at = |distance: f64| shape.depths([x + 20.0, y - distance, z], 800.0, &[]);
    let (near, far) = (at(30.0), at(3000.0));
    assert!(near.iter().max() > far.iter().max());
    let (near, far) = (shape.mesh(&near).unwrap(), shape.mesh(&far).unwrap());
    assert!(near.indices.len() > far.indices.len());
    let top = near
        .positions
        .iter()
        .map(|position| position[2])
        .fold(0.0, f32::max);
    assert!((15.0..40.0).contains(&top), "{top}");
    assert_eq!(
        shape.mesh(&at(30.0)).unwrap(),
        near,
        "same input, same mesh"
    );
}

#[test]
fn a_cage_of_another_cut_is_refused() {
    let cage = arch_cage(100.0, |_, _| 0.0);
    let mut place = arch_place(1.0, 0.125);
    place.cut[2] += 1;
    assert!(FeatureShape::new(&cage, place, |_| 0).is_err());
}

/// The stage `refine` in f32 against the CPU's mesh in f64, a hundred metres across: positions to 1e-6 of that, normals of
/// the deepest patches, a sixteenth of a cell wide, to 1e-3 rad.
#[test]
fn what_a_device_is_handed_gives_the_same_mesh() {
    let shape = arch_shape();
    for seed in 0..3 {
        let table = shape.table(&depths(&shape, seed, 4)).unwrap();
        let mesh = table.execute(&shape);
        let (packed, indices) = table.packed(&shape);
        let (_, vertices) = refine(&packed);
        assert_eq!(indices.len(), mesh.indices.len());
        for (&index, &vertex) in indices.iter().zip(&mesh.indices) {
            let border = mesh.border[vertex as usize];
            if border != NONE {
                assert_eq!(index, FEATURE_BORDER | border);
                continue;
            }
            let found = vertices[index as usize];
            let position = vertices[found.position_of as usize].position;
            let wanted = Vec3::from(mesh.positions[vertex as usize]);
            assert!(wanted.distance(position.into()) < 1e-4, "{wanted}");
            let normal = Vec3::from(mesh.normals[vertex as usize]);
            assert!(
                normal.distance(found.normal.into()) < 1e-3,
                "{wanted} {normal} {found:?}"
            );
            // The tiles' common border, 24 m east of the cut's corner, belongs to both.
            let on_border = (wanted.x - 24.0).abs() < 1e-4;
            assert!(on_border || found.tile == mesh.tiles[vertex as usize]);
        }
    }
}
