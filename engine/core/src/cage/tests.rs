//! Linking: what a cage knows about itself, and what is refused.

use super::*;

fn grid(columns: u32, rows: u32) -> (Vec<[f64; 3]>, Faces) {
    let at = |x: u32, y: u32| y * (columns + 1) + x;
    let positions =
        (0..=rows).flat_map(|y| (0..=columns).map(move |x| [f64::from(x), f64::from(y), 0.0]));
    let quad = |x, y| [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
    let faces = (0..rows).flat_map(|y| (0..columns).map(move |x| quad(x, y)));
    (positions.collect(), faces.collect())
}

fn link(vertex_count: usize, faces: &[&[u32]]) -> Result<Cage, CageError> {
    Cage::new(
        vec![[0.0; 3]; vertex_count],
        faces.iter().collect(),
        &Tags::default(),
    )
}

#[test]
fn a_grid_has_the_edges_and_rings_it_should() {
    let (positions, faces) = grid(3, 2);
    let cage = Cage::new(positions, faces, &Tags::default()).unwrap();
    let topology = cage.topology();
    assert_eq!(
        (
            topology.vertex_count(),
            topology.edge_count(),
            topology.face_count()
        ),
        (12, 17, 6)
    );
    assert_eq!(
        (topology.valence(5), topology.vertex_corners(5).len()),
        (4, 4)
    );
    assert!(topology.is_boundary_vertex(4) && !topology.is_boundary_vertex(5));
    assert_eq!(topology.vertex_sharpness(0), f64::INFINITY);
    assert_eq!(topology.vertex_sharpness(1), 0.0);
    assert_eq!(cage.extent(), 3.0);
}

#[test]
fn rings_turn_counter_clockwise_face_between_its_two_edges() {
    let (positions, faces) = grid(4, 4);
    let cage = Cage::new(positions, faces, &Tags::default()).unwrap();
    let topology = cage.topology();
    for vertex in 0..topology.vertex_count() {
        let edges = topology.vertex_edges(vertex);
        for (i, &corner) in topology.vertex_corners(vertex).iter().enumerate() {
            assert_eq!(topology.corner_vertex(corner), vertex);
            let leaving = topology.corner_edges[corner as usize];
            let arriving = topology.corner_edges[topology.previous_corner(corner) as usize];
            assert_eq!(
                [leaving, arriving],
                [edges[i], edges[(i + 1) % edges.len()]]
            );
        }
    }
}

#[test]
fn a_triangle_and_its_back_are_a_closed_cage_of_valence_two() {
    let cage = link(3, &[&[0, 1, 2], &[0, 2, 1]]).unwrap();
    assert_eq!(cage.topology().edge_count(), 3);
    assert!((0..3).all(|vertex| cage.topology().valence(vertex) == 2));
}

#[test]
fn what_is_wrong_is_named() {
    type E = CageError;
    assert!(matches!(link(3, &[]), Err(E::Empty)));
    assert!(matches!(
        link(3, &[&[0, 1]]),
        Err(E::DegenerateFace {
            face: 0,
            corners: 2
        })
    ));
    assert!(matches!(
        link(3, &[&[0, 1, 3]]),
        Err(E::MissingVertex {
            vertex: 3,
            vertex_count: 3,
            ..
        })
    ));
    assert!(matches!(
        link(4, &[&[0, 1, 2, 1]]),
        Err(E::RepeatedCorner { vertex: 1, .. })
    ));
    assert!(matches!(
        link(5, &[&[0, 1, 2, 3, 0]]),
        Err(E::RepeatedCorner { vertex: 0, .. })
    ));
    assert!(matches!(
        link(3, &[&[0, 1, 2], &[1, 2, 0]]),
        Err(E::RepeatedFace { face: 1, first: 0 })
    ));
    assert!(matches!(
        link(4, &[&[0, 1, 2], &[0, 1, 3]]),
        Err(E::Orientation { faces: [0, 1], .. })
    ));
    let three = link(5, &[&[0, 1, 2], &[1, 0, 3], &[0, 1, 4]]);
    assert!(matches!(
        three,
        Err(E::NonManifoldEdge { face_count: 3, .. })
    ));
    let fans = link(5, &[&[0, 1, 2], &[0, 3, 4]]);
    assert!(matches!(
        fans,
        Err(E::NonManifoldVertex { vertex: 0, face: 1 })
    ));
}

#[test]
fn two_closed_fans_at_one_vertex_are_refused() {
    let tetrahedron = |a: u32, b: u32, c: u32| [[0, a, b], [0, b, c], [0, c, a], [c, b, a]];
    let faces: Faces = tetrahedron(1, 2, 3)
        .into_iter()
        .chain(tetrahedron(4, 5, 6))
        .collect();
    let cage = Cage::new(vec![[0.0; 3]; 7], faces, &Tags::default());
    assert!(matches!(
        cage,
        Err(CageError::NonManifoldVertex {
            vertex: 0,
            face: 4..=6
        })
    ));
}

#[test]
fn numbers_and_tags_are_checked() {
    let new = |position: f64, tags: &Tags| {
        Cage::new(
            vec![[0.0; 3], [1.0; 3], [position; 3], [3.0; 3]],
            Faces::quads(&[[0, 1, 2, 3]]),
            tags,
        )
    };
    let crease = |vertices, sharpness| Tags {
        creases: vec![Crease {
            vertices,
            sharpness,
        }],
        ..Tags::default()
    };
    assert!(matches!(
        new(f64::NAN, &Tags::default()),
        Err(CageError::NotFinite { vertex: 2, .. })
    ));
    assert!(matches!(
        new(1e300, &Tags::default()),
        Err(CageError::NotFinite { vertex: 2, .. })
    ));
    for bad in [-0.5, f64::NAN] {
        assert!(matches!(
            new(0.0, &crease([0, 1], bad)),
            Err(CageError::Sharpness { .. })
        ));
    }
    assert!(matches!(
        new(0.0, &crease([0, 2], 1.0)),
        Err(CageError::MissingEdge { vertices: [0, 2] })
    ));
    assert!(matches!(
        new(0.0, &crease([0, 9], 1.0)),
        Err(CageError::MissingTagged { index: 9, .. })
    ));
    let hole = Tags {
        holes: vec![1],
        ..Tags::default()
    };
    assert!(matches!(
        new(0.0, &hole),
        Err(CageError::MissingTagged {
            what: "face",
            index: 1,
            count: 1
        })
    ));
}

#[test]
fn every_named_cage_reads_or_is_refused_with_a_reason() {
    let folder =
        std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/cages");
    if !folder.is_dir() {
        assert_ne!(
            std::env::var("CI").as_deref(),
            Ok("true"),
            "no ../shared/data/cages in CI"
        );
        println!("skipped: no ../shared/data/cages");
        return;
    }
    let mut refused = Vec::new();
    for entry in std::fs::read_dir(folder)
        .unwrap()
        .map(Result::unwrap)
        .filter(|entry| entry.path().is_file())
    {
        let name = entry.file_name().into_string().unwrap();
        let cage = read_obj(&std::fs::read(entry.path()).unwrap(), CageBudget::default());
        if let Err(error) = cage {
            let kind = match error {
                CageError::Line { error, .. } => *error,
                error => error,
            };
            refused.push((name, std::mem::discriminant(&kind)));
        }
    }
    refused.sort_by(|a, b| a.0.cmp(&b.0));
    let edge = std::mem::discriminant(&CageError::NonManifoldEdge {
        vertices: [0; 2],
        face_count: 0,
        face: 0,
    });
    let vertex = std::mem::discriminant(&CageError::NonManifoldVertex { vertex: 0, face: 0 });
    let corner = std::mem::discriminant(&CageError::RepeatedCorner { face: 0, vertex: 0 });
    let expected = [
        ("catmark_fan.obj", edge),
        ("catmark_gregory_test4.obj", vertex),
        ("catmark_nonman_edge100.obj", edge),
        ("catmark_nonman_edges.obj", corner),
        ("catmark_nonman_quadpole360.obj", corner),
        ("catmark_nonman_quadpole8.obj", corner),
        ("catmark_nonman_verts.obj", vertex),
        ("catmark_val2_nonman.obj", edge),
    ];
    assert_eq!(
        refused,
        expected.map(|(name, kind)| (name.to_owned(), kind))
    );
}
