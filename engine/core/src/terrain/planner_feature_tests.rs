//! Plans with features: what is meshed, what fits, what is drawn.

use std::collections::HashMap;

use super::*;
use crate::{
    geo::TileId,
    pyramid::feature::FeatureGroup,
    reference::shared::{TILE_CUT, border::TILE_QUADS},
    stream::synthetic::Synthetic,
    terrain::feature_mesh::synthetic,
};

/// A data set with an arch across the border of two finest tiles.
fn with_arch(seed: u64) -> Synthetic {
    with_arches(seed, 1)
}

/// A data set with so many arches, each in two tiles of a row of finest tiles of its own, from the north on.
fn with_arches(seed: u64, count: u32) -> Synthetic {
    let mut source = Synthetic::new(1025, 1025, seed);
    let finest = source.metadata().finest();
    let [row0, column0, row1, column1] = synthetic::arch_place(1.0, 1.0 / 16.0).cut;
    for row in 0..count {
        let down = row * TILE_QUADS;
        let tiles = [0, 1].map(|column| TileId::new(finest, row, column));
        source.features.push(FeatureGroup {
            id: row,
            home: tiles[0],
            tiles: tiles.to_vec(),
            cut: [row0 + down, column0, row1 + down, column1],
            cage: Some(synthetic::arch_cage(200.0, |_, _| 800.0)),
        });
    }
    source
}

/// From south of the arch.
fn at_arch(planner: &Planner, distance: f64) -> View {
    let ([x, y], _) = planner
        .tree
        .corner_and_step(TileId::new(planner.tree.finest(), 0, 0));
    let eye = [x + 130.0, y - 40.0 - distance, 65.0];
    View::looking_at(eye, [x + 130.0, y - 36.0, 55.0], 0.9, [640, 360])
}

/// The arch is drawn when both its tiles are drawn at the finest level and its mesh is up, with their bits set.
fn assert_features(plan: &FramePlan, up: &mut HashMap<u32, usize>, finest: u8) {
    for upload in &plan.feature_uploads {
        up.insert(upload.feature, upload.indices.len());
    }
    for upload in &plan.uploads {
        let bits = upload.cut.as_ref();
        let count: u32 = bits.map_or(0, |bits| bits.iter().map(|word| word.count_ones()).sum());
        let wanted = match (upload.tile.id.level == finest, upload.tile.id.column) {
            (true, 0) if upload.tile.id.row == 0 => 8 * 6,
            (true, 1) if upload.tile.id.row == 0 => 8 * 6,
            _ => 0,
        };
        assert_eq!(count, wanted, "{}", upload.tile.id);
    }
    for feature in &plan.features {
        assert!(up[&feature.feature] > 0);
        for (&tile, column) in feature.tiles.iter().zip(0..) {
            assert_eq!(
                plan.places[tile as usize].id,
                TileId::new(finest, 0, column)
            );
        }
    }
    for (at, drawn) in (0..).zip(&plan.drawn) {
        let is_cut = plan
            .features
            .iter()
            .any(|feature| feature.tiles.contains(&at));
        assert_eq!(drawn.flags & TILE_CUT != 0, is_cut);
    }
}

#[test]
fn a_feature_is_drawn_exactly_when_its_tiles_are_finest_and_its_mesh_is_up() {
    let source: Arc<dyn TileSource> = Arc::new(with_arch(5));
    let finest = source.metadata().finest();
    let mut planner = Planner::new(Arc::clone(&source), PlannerDescriptor::default()).unwrap();
    let (mut up, mut drawn, mut ground) = (HashMap::new(), 0, 0);
    for step in 0..400 {
        let distance = 30.0 + 1500.0 * (f64::from(step) / 60.0).sin().abs();
        let view = at_arch(&planner, distance);
        let (plan, stats) = planner.plan(&view);
        assert_features(&plan, &mut up, finest);
        assert_eq!(stats.features_drawn, plan.features.len());
        drawn += plan.features.len();
        ground += usize::from(plan.features.is_empty());
        std::thread::sleep(Duration::from_micros(500));
    }
    assert!(drawn > 20 && ground > 20, "{drawn} {ground}");
}

#[test]
fn a_plan_that_waits_has_its_features_and_nearer_ones_are_finer() {
    let wait = PlannerDescriptor {
        wait_for_tiles: true,
        ..PlannerDescriptor::default()
    };
    let mut planner = Planner::new(Arc::new(with_arch(3)), wait).unwrap();
    let finest = planner.tree.finest();
    let mut up = HashMap::new();
    let mut indices = Vec::new();
    for distance in [250.0, 15.0] {
        let view = at_arch(&planner, distance);
        let (plan, _) = planner.plan(&view);
        assert_features(&plan, &mut up, finest);
        assert_eq!(plan.features.len(), 1, "{distance}");
        indices.push(up[&0]);
    }
    assert!(indices[1] > indices[0], "{indices:?}");
    planner.forget_uploads();
    let view = at_arch(&planner, 40.0);
    assert_eq!(planner.plan(&view).0.feature_uploads.len(), 1);
}

#[test]
fn a_feature_that_does_not_fit_leaves_its_ground() {
    let wait = PlannerDescriptor {
        wait_for_tiles: true,
        ..PlannerDescriptor::default()
    };
    let mut planner = Planner::new(Arc::new(with_arch(3)), wait).unwrap();
    planner.features = Some(FeaturePool::new(1 << 20, 1000, 1.0 / 16.0).unwrap());
    let view = at_arch(&planner, 40.0);
    let (plan, _) = planner.plan(&view);
    assert!(plan.features.is_empty() && plan.feature_uploads.is_empty());
    assert!(planner.take_errors()[0].contains("does not fit"));
    assert!(plan.drawn.iter().all(|drawn| drawn.flags & TILE_CUT == 0));
}

#[test]
fn a_feature_that_is_meshed_again_and_again_keeps_no_other_waiting() {
    let near = PlannerDescriptor {
        error_px: 0.05,
        ..PlannerDescriptor::default()
    };
    let mut planner = Planner::new(Arc::new(with_arches(5, 2)), near).unwrap();
    for step in 0..4000 {
        // A step is a large share of the distance: the nearest feature is due in every plan.
        let view = at_arch(&planner, 30.0 + f64::from(step % 2) * 20.0);
        let (plan, _) = planner.plan(&view);
        if plan.features.len() == 2 {
            return;
        }
        std::thread::sleep(Duration::from_micros(500));
    }
    panic!("the farther feature has no mesh");
}

#[test]
fn what_does_not_fit_beside_nearer_features_is_drawn_when_it_is_the_nearest() {
    let wait = PlannerDescriptor {
        wait_for_tiles: true,
        error_px: 0.05,
        ..PlannerDescriptor::default()
    };
    let mut planner = Planner::new(Arc::new(with_arches(3, 2)), wait).unwrap();
    let drawn = |planner: &mut Planner, south: f64| {
        let view = at_arch(planner, south);
        let (plan, stats) = planner.plan(&view);
        let ids: Vec<u32> = plan
            .features
            .iter()
            .map(|feature| feature.feature)
            .collect();
        (ids, stats)
    };
    let (both, stats) = drawn(&mut planner, 30.0);
    assert_eq!((both.as_slice(), stats.features_refused), (&[0, 1][..], 0));
    // Room for one of them, seen from near.
    let room = stats.feature_bytes[0] * 3 / 4;
    planner.features = Some(FeaturePool::new(64 << 20, room, 1.0 / 16.0).unwrap());
    for _ in 0..3 {
        // The second arch is 128 m farther south.
        for (south, nearest) in [(30.0, 0), (98.0, 1)] {
            // What is too large once made is known a plan later.
            drawn(&mut planner, south);
            let (one, stats) = drawn(&mut planner, south);
            assert_eq!((one, stats.features_refused), (vec![nearest], 1));
            assert!(stats.feature_bytes[0] <= room);
        }
    }
}
