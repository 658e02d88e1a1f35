//! The stage `refine` on a device: against its reference on the CPU, and against the exact limit of the shared cages.

use std::{collections::HashMap, fs};

use drumlin::{Headless, Refine, offscreen, wgpu};
use drumlin_core::{
    cage::{Cage, CageBudget, read_obj},
    fas::{PieceIndex, RenderTable, Tables},
    reference::{
        refine::{self, RefineGround, RefineSite, RefineTables},
        shared::FeatureVertex,
    },
};
use glam::{DVec3, Vec3};

use crate::support::shared;

/// Valences 3 to 12, boundaries, corners, creases semi-sharp and infinite.
const CAGES: [&str; 8] = [
    "box_creases",
    "discs_3_5_7_10",
    "sheet_boundary",
    "polycube_a",
    "terrain_a",
    "regression_car",
    "regression_helmet",
    "regression_gregory_test1",
];

/// Levels that every feature is refined.
const DEPTH: u8 = 5;

/// A reference sample: face, place on it, exact position and normal.
struct Exact {
    face: u32,
    uv: [f64; 2],
    /// Splits of the face after which the place lies in a bicubic patch; none at a vertex.
    level: Option<u8>,
    position: DVec3,
    /// None where there is no tangent plane.
    normal: Option<DVec3>,
}

fn exact(text: &str) -> Vec<Exact> {
    let row = |line: &str| {
        let cells: Vec<_> = line.split(',').collect();
        let number = |cell: usize| cells[cell].parse::<f64>().expect("a number");
        let vector = |cell: usize| DVec3::new(number(cell), number(cell + 1), number(cell + 2));
        Exact {
            face: cells[1].parse().expect("a face"),
            uv: [number(2), number(3)],
            level: cells[5].parse().ok(),
            position: vector(6),
            normal: (!cells[15].is_empty()).then(|| vector(15)),
        }
    };
    text.lines().skip(1).map(row).collect()
}

/// The cage and its samples; none, said aloud, without the shared reference.
fn reference(name: &str) -> Option<(Cage, Vec<Exact>)> {
    let folder = shared("reference/catmull-clark")?;
    let obj = fs::read(folder.join(format!("{name}.obj"))).expect("a cage");
    let csv = fs::read_to_string(folder.join(format!("{name}.csv"))).expect("samples");
    let cage = read_obj(&obj, CageBudget::default()).expect("a cage");
    Some((cage, exact(&csv)))
}

/// Pieces by face.
fn pieces(table: &RenderTable) -> HashMap<u32, Vec<PieceIndex>> {
    let mut pieces: HashMap<u32, Vec<PieceIndex>> = HashMap::new();
    for (patch, at) in table.patches.iter().zip(0..) {
        let of_face = pieces.entry(patch.place.face).or_default();
        of_face.push(PieceIndex::Patch(at));
    }
    for (cap, at) in table.caps.iter().zip(0..) {
        pieces
            .entry(cap.place.face)
            .or_default()
            .push(PieceIndex::Cap(at));
    }
    pieces
}

/// True where nothing semi-sharp is left at a depth; what is, is drawn as if it were smooth.
fn has_worn_off(cage: &Cage, depth: u8) -> bool {
    let topology = cage.topology();
    let edges = (0..topology.edge_count()).map(|edge| topology.edge_sharpness(edge));
    let vertices = (0..topology.vertex_count()).map(|vertex| topology.vertex_sharpness(vertex));
    edges
        .chain(vertices)
        .all(|sharpness| sharpness <= f64::from(depth) || sharpness.is_infinite())
}

/// Where a sample is a place that tables of [`DEPTH`] hold exactly: on a bicubic patch, or on a corner of a cap.
fn site(
    table: &RenderTable,
    pieces: &[PieceIndex],
    sample: &Exact,
    vertices: bool,
) -> Option<(PieceIndex, [f64; 2])> {
    if !sample.level.map_or(vertices, |level| level <= DEPTH) {
        return None;
    }
    let found = pieces.iter().find_map(|&piece| {
        let place = match piece {
            PieceIndex::Patch(patch) => table.patches[patch as usize].place,
            PieceIndex::Cap(cap) => table.caps[cap as usize].place,
        };
        Some((piece, place.local(sample.uv)?))
    })?;
    let is_corner = found.1.iter().all(|part| *part == 0.0 || *part == 1.0);
    (matches!(found.0, PieceIndex::Patch(_)) || is_corner).then_some(found)
}

/// No ground of its own: one tile of a metre a sample.
const GROUND: RefineGround = RefineGround {
    step: [1.0, -1.0],
    size: [128, 128],
    first: [0, 0],
    tiles: [1, 1],
};

/// Points and vertices as the device makes them.
fn execute(gpu: &Headless, tables: &RefineTables) -> (Vec<[f32; 3]>, Vec<FeatureVertex>) {
    let Headless { device, queue, .. } = gpu;
    let stage = Refine::new(device);
    let buffers = stage.upload(device, queue, tables);
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
    stage.dispatch(&mut pass, &buffers);
    drop(pass);
    queue.submit([encoder.finish()]);
    let read = |buffer: &wgpu::Buffer| {
        offscreen::read_buffer(device, queue, buffer, buffer.size()).expect("bytes")
    };
    let (points, vertices) = (read(&buffers.points), read(&buffers.vertices));
    gpu.finish().expect("no complaint");
    (
        bytemuck::pod_collect_to_vec(&points),
        bytemuck::pod_collect_to_vec(&vertices),
    )
}

/// Radians by which f32 turns a normal: tangents are differences of points that lie 2^-DEPTH of a face apart, where a
/// coordinate is rounded by 6e-8 of the extent; on faces of a hundredth of it that is 2e-4, and a few roundings meet.
const TURNED: f32 = 1e-3;

/// Both compute in f32, in the same order but for what a compiler fuses: a few last bits of the extent.
fn assert_alike(
    name: &str,
    extent: f64,
    tables: &RefineTables,
    gpu: &Headless,
) -> Vec<FeatureVertex> {
    let (points, vertices) = execute(gpu, tables);
    let (wanted_points, wanted) = refine::refine(tables);
    let near =
        |a: [f32; 3], b: [f32; 3]| f64::from(Vec3::from(a).distance(b.into())) <= 1e-6 * extent;
    assert_eq!(points.len(), wanted_points.len());
    for (found, wanted) in points.iter().zip(&wanted_points) {
        assert!(
            near(*found, wanted.to_array()),
            "{name}: {found:?} {wanted}"
        );
    }
    for (found, wanted) in vertices.iter().zip(&wanted) {
        assert!(
            near(found.position, wanted.position),
            "{name}: {found:?} {wanted:?}"
        );
        let turned = Vec3::from(found.normal).distance(wanted.normal.into());
        assert!(turned <= TURNED, "{name}: {found:?} {wanted:?}");
        assert_eq!(
            (found.tile, found.position_of),
            (wanted.tile, wanted.position_of)
        );
    }
    vertices
}

/// Points are sums of some tens of f32 terms, each rounded by 6e-8 of the extent: within 1e-6 of it.
#[test]
fn cages_are_refined_on_the_device_to_their_exact_limit() {
    let Some(gpu) = drumlin_tests::gpu() else {
        return;
    };
    for name in CAGES {
        let Some((cage, samples)) = reference(name) else {
            return;
        };
        let worn_off = has_worn_off(&cage, DEPTH);
        let tables = Tables::classic(cage.topology(), DEPTH).expect("quads");
        let pieces = pieces(&tables.render);
        let held: Vec<_> = samples
            .iter()
            .filter_map(|sample| {
                let pieces = pieces.get(&sample.face)?;
                let found = site(&tables.render, pieces, sample, worn_off)?;
                Some((sample, found))
            })
            .collect();
        let sites: Vec<_> = (0..)
            .zip(&held)
            .map(|(position_of, &(_, (piece, uv)))| RefineSite {
                piece,
                uv,
                offset: None,
                position_of,
            })
            .collect();
        let packed = RefineTables::new(&tables, cage.positions(), &GROUND, &sites);
        let vertices = assert_alike(name, cage.extent(), &packed, &gpu);
        let ([mut far, mut turned], mut normals) = ([0.0_f64; 2], 0);
        for ((sample, _), vertex) in held.iter().zip(&vertices) {
            let distance = Vec3::from(vertex.position)
                .as_dvec3()
                .distance(sample.position);
            far = far.max(distance / cage.extent());
            let normal = Vec3::from(vertex.normal).as_dvec3();
            assert!((normal.length() - 1.0).abs() < 1e-5, "{name}: {normal}");
            if let Some(exact) = sample.normal {
                turned = turned.max(normal.angle_between(exact));
                normals += 1;
            }
        }
        println!(
            "{name}: {} of {} samples, {far:.1e} of the extent, {turned:.1e} rad",
            held.len(),
            samples.len()
        );
        assert!(held.len() * 2 > samples.len(), "{name}: {}", held.len());
        assert!(normals * 10 > held.len() * 9, "{name}: {normals}");
        assert!(
            far <= 1e-6 && turned <= f64::from(TURNED),
            "{name}: {far} {turned}"
        );
    }
}
