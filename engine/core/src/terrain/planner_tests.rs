//! Laws of the planner on random journeys, over a data set that a test makes up.

use std::collections::HashMap;

use super::*;
use crate::{
    geo::TileId,
    reference::shared::NONE,
    stream::{Retry, mix, synthetic::Synthetic},
};

/// A GPU's memory, as far as it matters: which tile each slot and which picture each layer holds.
#[derive(Default)]
struct Pool {
    slots: HashMap<u32, TileId>,
    layers: HashMap<u32, u8>,
}

impl Pool {
    /// Carries out a plan's uploads and checks that it draws nothing that is not there.
    fn carry_out(&mut self, plan: &FramePlan, planner: &Planner) {
        for upload in &plan.uploads {
            assert!(upload.slot < planner.pool().slots);
            self.slots.insert(upload.slot, upload.tile.id);
        }
        for upload in &plan.color_uploads {
            assert!(upload.layer < planner.pool().color_layers);
            self.layers.insert(upload.layer, upload.texels[0]);
        }
        assert_eq!(plan.drawn.len(), plan.places.len());
        for (drawn, place) in plan.drawn.iter().zip(&plan.places) {
            assert_eq!(self.slots.get(&drawn.slot), Some(&place.id));
            assert_eq!(
                self.slots.get(&drawn.parent_slot).copied(),
                place.id.parent()
            );
            assert_eq!(drawn.parent_slot == NONE, place.id == TileId::ROOT);
            if drawn.color_slot != NONE {
                let up = drawn.color_scale.log2().round();
                assert_eq!(
                    f32::from(self.layers[&drawn.color_slot]),
                    f32::from(place.id.level) + up
                );
            }
        }
    }
}

fn assert_cover_and_balance(plan: &FramePlan, planner: &Planner) {
    let grid = planner.tree.grid();
    let finest = planner.tree.finest();
    let [rows, columns] = grid.tiles(finest);
    let span = |id: TileId| {
        let up = finest - id.level;
        let range = |at: u32, end: u32| [at << up, ((at + 1) << up).min(end)];
        [range(id.row, rows), range(id.column, columns)]
    };
    let mut owner = vec![None; (rows * columns) as usize];
    for place in &plan.places {
        let [row, column] = span(place.id);
        for at in (row[0]..row[1])
            .flat_map(|row| (column[0]..column[1]).map(move |column| row * columns + column))
        {
            assert_eq!(owner[at as usize].replace(place.id), None, "drawn twice");
        }
    }
    let level = |row: u32, column: u32| {
        owner[(row * columns + column) as usize]
            .expect("covered")
            .level
    };
    for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
        for (south, east) in [(0, 1), (1, 0), (1, 1)] {
            if row + south < rows && column + east < columns {
                assert!(level(row, column).abs_diff(level(row + south, column + east)) < 2);
            }
            if column > 0 && row + 1 < rows {
                assert!(level(row, column).abs_diff(level(row + 1, column - 1)) < 2);
            }
        }
    }
}

fn assert_budgets(stats: &FrameStats, planner: &Planner) {
    let descriptor = &planner.descriptor;
    assert!(stats.ram_bytes <= descriptor.ram_budget_bytes, "{stats:?}");
    assert!(stats.slots_used <= planner.pool().slots);
    assert!(stats.tiles_drawn <= planner.pool().max_drawn as usize);
    assert!(descriptor.wait_for_tiles || stats.uploaded_bytes <= descriptor.upload_budget_bytes);
    assert!(stats.in_flight <= descriptor.in_flight as usize);
}

fn descriptor() -> PlannerDescriptor {
    PlannerDescriptor {
        ram_budget_bytes: 24 << 20,
        vram_budget_bytes: 48 << 20,
        upload_budget_bytes: 1 << 20,
        retry: Retry {
            first_millis: 1,
            longest_millis: 20,
        },
        ..PlannerDescriptor::default()
    }
}

fn planner(source: Synthetic, descriptor: PlannerDescriptor) -> Planner {
    Planner::new(Arc::new(source), descriptor).unwrap()
}

/// A camera that wanders, turns, dives and now and then jumps.
struct Journey {
    seed: u64,
    step: u32,
    at: [f64; 3],
    heading: f64,
}

impl Journey {
    fn new(seed: u64) -> Self {
        Self {
            seed,
            step: 0,
            at: [0.0, 0.0, 400.0],
            heading: 0.0,
        }
    }

    fn random(&mut self) -> f64 {
        self.seed += 1;
        (mix(self.seed.wrapping_mul(0x9e37_79b9)) % 10_000) as f64 / 5_000.0 - 1.0
    }

    fn next(&mut self) -> View {
        self.step += 1;
        self.heading += 0.1 * self.random();
        if self.step.is_multiple_of(40) {
            self.at = [
                4000.0 * self.random(),
                3000.0 * self.random(),
                80.0 + 300.0 * self.random().abs(),
            ];
        }
        let (sin, cos) = self.heading.sin_cos();
        self.at[0] = (self.at[0] + 15.0 * cos).clamp(-5000.0, 5000.0);
        self.at[1] = (self.at[1] + 15.0 * sin).clamp(-4000.0, 4000.0);
        self.at[2] = (self.at[2] + 10.0 * self.random()).clamp(20.0, 2000.0);
        let target = [self.at[0] + cos, self.at[1] + sin, self.at[2] - 0.2];
        let view = View::looking_at(self.at, target, 1.0, [1280, 720]);
        View {
            time: f64::from(self.step) / 60.0,
            ..view
        }
    }
}

fn fly(planner: &mut Planner, journey: &mut Journey, plans: u32) -> Vec<FrameStats> {
    let (mut pool, mut plan) = (Pool::default(), FramePlan::default());
    let fly = |_| {
        let stats = planner.plan_into(&journey.next(), &mut plan);
        pool.carry_out(&plan, planner);
        assert_cover_and_balance(&plan, planner);
        assert_budgets(&stats, planner);
        std::thread::sleep(Duration::from_micros(300));
        stats
    };
    (0..plans).map(fly).collect()
}

/// Plans of one view until nothing is missing.
fn rest(planner: &mut Planner, view: &View, plans: u32) -> u32 {
    (0..plans)
        .find(|_| {
            std::thread::sleep(Duration::from_millis(1));
            let (_, stats) = planner.plan(view);
            assert_budgets(&stats, planner);
            stats.tiles_missing == 0 && stats.colors_missing == 0
        })
        .expect("the cut is complete at last")
}

#[test]
fn on_a_journey_budgets_hold_and_the_drawn_cut_covers_and_is_balanced() {
    for seed in 0..3 {
        let mut source = Synthetic::new(8000, 6000, seed);
        source.delay = Duration::from_micros(100);
        let mut planner = planner(source, descriptor());
        let mut journey = Journey::new(seed);
        let stats = fly(&mut planner, &mut journey, 150);
        assert!(
            stats.iter().any(|stats| stats.tiles_missing > 0),
            "tiles are late"
        );
        assert!(
            stats.iter().any(|stats| stats.tiles_drawn > 30),
            "there is something to draw"
        );
        rest(&mut planner, &journey.next(), 2000);
    }
}

#[test]
fn over_budget_the_target_rises_and_comes_back() {
    let mut planner = planner(
        Synthetic::new(8000, 6000, 9),
        PlannerDescriptor {
            error_px: 0.05,
            ..descriptor()
        },
    );
    let mut journey = Journey::new(9);
    let stats = fly(&mut planner, &mut journey, 150);
    assert!(stats.iter().any(|stats| stats.tolerance_px > 0.1));
    let view = journey.next();
    rest(&mut planner, &view, 2000);
    let mut factors: Vec<_> = (0..300)
        .map(|_| planner.plan(&view).1.tolerance_px)
        .collect();
    factors.drain(..200);
    assert!(
        factors.iter().all(|factor| *factor == factors[0]),
        "a camera at rest sees a picture at rest"
    );
    planner.set_error_px(30.0);
    let far = View::looking_at([0.0, 0.0, 60_000.0], [0.0; 3], 0.5, [640, 360]);
    for step in 0..600 {
        let eye = [f64::from(step), 0.0, 60_000.0];
        planner.plan(&View { eye, ..far });
    }
    assert_eq!(planner.plan(&far).1.tolerance_px, 30.0);
}

#[test]
fn failures_are_tried_again_until_all_is_there() {
    let mut source = Synthetic::new(8000, 6000, 4);
    source.failures = 10;
    let mut planner = planner(source, descriptor());
    let mut journey = Journey::new(4);
    fly(&mut planner, &mut journey, 100);
    rest(&mut planner, &journey.next(), 4000);
    assert!(planner.scheduler.failures() > 0);
    assert!(!planner.take_errors().is_empty() && planner.take_errors().is_empty());
}

#[test]
fn a_plan_that_waits_lacks_nothing_and_is_the_same_every_time() {
    let fly = || {
        let mut source = Synthetic::new(8000, 6000, 5).with_imagery(3);
        source.failures = 5;
        let wait = PlannerDescriptor {
            wait_for_tiles: true,
            vram_budget_bytes: 96 << 20,
            ..descriptor()
        };
        let (mut planner, mut journey) = (planner(source, wait), Journey::new(5));
        let mut pool = Pool::default();
        let plan = |_| {
            let (plan, stats) = planner.plan(&journey.next());
            pool.carry_out(&plan, &planner);
            assert_budgets(&stats, &planner);
            assert_eq!(
                (
                    stats.tiles_missing,
                    stats.colors_missing,
                    stats.given_up,
                    stats.missing_share
                ),
                (0, 0, 0, 0.0)
            );
            plan
        };
        (0..30).map(plan).collect::<Vec<_>>()
    };
    for (a, b) in fly().iter().zip(fly()) {
        assert!(a.frame == b.frame && a.places == b.places);
        assert!(a.drawn == b.drawn);
    }
}

#[test]
fn imagery_falls_back_to_the_ancestors_and_arrives() {
    let source = Synthetic::new(8000, 6000, 6).with_imagery(5);
    let mut planner = planner(
        source,
        PlannerDescriptor {
            vram_budget_bytes: 96 << 20,
            ..descriptor()
        },
    );
    let mut journey = Journey::new(6);
    fly(&mut planner, &mut journey, 100);
    let view = journey.next();
    rest(&mut planner, &view, 2000);
    let (plan, _) = planner.plan(&view);
    assert!(plan.drawn.iter().all(|drawn| drawn.color_slot != NONE));
    assert!(plan.drawn.iter().any(|drawn| drawn.color_scale == 1.0));
    assert!(plan.drawn.iter().any(|drawn| drawn.color_scale < 1.0));
}

#[test]
fn what_the_view_does_not_see_is_listed_too() {
    let mut planner = planner(Synthetic::new(8000, 6000, 7), descriptor());
    let mut journey = Journey::new(7);
    let view = journey.next();
    rest(&mut planner, &view, 2000);
    let (plan, stats) = planner.plan(&view);
    assert!(stats.tiles_visible > 0 && stats.tiles_visible < stats.tiles_drawn);
    assert_cover_and_balance(&plan, &planner);
}

#[test]
fn aiming_is_as_planning() {
    let mut planner = planner(Synthetic::new(4000, 3000, 8), descriptor());
    let view = View::looking_at([100.3, 20.7, 300.9], [0.0; 3], 1.0, [640, 480]);
    rest(&mut planner, &view, 2000);
    let (mut plan, _) = planner.plan(&View {
        eye: [90.0, 30.0, 310.0],
        ..view
    });
    plan.aim(&view);
    let (wanted, _) = planner.plan(&view);
    for (drawn, place) in plan.drawn.iter().zip(&plan.places) {
        let same = wanted.places.iter().position(|other| other.id == place.id);
        let Some(same) = same.map(|same| &wanted.drawn[same]) else {
            continue;
        };
        assert_eq!(
            (drawn.origin, drawn.z_min, drawn.flags),
            (same.origin, same.z_min, same.flags)
        );
    }
}

#[test]
fn a_camera_that_flies_straight_finds_its_tiles_read_ahead() {
    let missing = |prefetch_seconds: f64| {
        let mut source = Synthetic::new(16_000, 2000, 3);
        source.delay = Duration::from_millis(1);
        let mut planner = planner(
            source,
            PlannerDescriptor {
                prefetch_seconds,
                ..descriptor()
            },
        );
        let view = |step: u32| {
            let x = -5000.0 + 20.0 * f64::from(step);
            let view = View::looking_at([x, 0.0, 150.0], [x + 10.0, 0.0, 147.0], 1.0, [640, 360]);
            View {
                time: f64::from(step) / 30.0,
                ..view
            }
        };
        rest(&mut planner, &view(0), 2000);
        let plan = |step| {
            std::thread::sleep(Duration::from_millis(3));
            planner.plan(&view(step)).1.tiles_missing
        };
        (1..120).map(plan).sum::<usize>()
    };
    let (without, with) = (missing(0.0), missing(1.0));
    assert!(with * 2 < without, "{with} of {without}");
}

#[test]
fn bad_budgets_and_bad_views_are_refused() {
    let new = |descriptor| Planner::new(Arc::new(Synthetic::new(300, 300, 1)), descriptor);
    assert!(
        new(PlannerDescriptor {
            ram_budget_bytes: 1 << 20,
            ..descriptor()
        })
        .is_err()
    );
    assert!(
        new(PlannerDescriptor {
            vram_budget_bytes: 1 << 20,
            ..descriptor()
        })
        .is_err()
    );
    assert!(
        new(PlannerDescriptor {
            upload_budget_bytes: 1 << 10,
            ..descriptor()
        })
        .is_err()
    );
    assert!(
        new(PlannerDescriptor {
            error_px: f64::NAN,
            ..descriptor()
        })
        .is_err()
    );
    let mut planner = new(descriptor()).unwrap();
    let view = View::looking_at([f64::NAN; 3], [0.0; 3], 1.0, [64, 64]);
    assert!(planner.plan(&view).0.drawn.is_empty());
}

#[test]
fn after_the_device_is_lost_all_is_uploaded_again_from_memory() {
    let source = Synthetic::new(8000, 6000, 8).with_imagery(4);
    let mut planner = planner(
        source,
        PlannerDescriptor {
            vram_budget_bytes: 96 << 20,
            ..descriptor()
        },
    );
    let view = Journey::new(8).next();
    rest(&mut planner, &view, 2000);
    let before = planner.plan(&view).0;
    planner.forget_uploads();
    let mut pool = Pool::default();
    for _ in 0..2000 {
        std::thread::sleep(Duration::from_millis(1));
        let (plan, stats) = planner.plan(&view);
        pool.carry_out(&plan, &planner);
        if stats.tiles_missing == 0 && stats.colors_missing == 0 {
            let ids =
                |plan: &FramePlan| plan.places.iter().map(|place| place.id).collect::<Vec<_>>();
            assert_eq!(ids(&plan), ids(&before));
            return;
        }
    }
    panic!("tiles are missing");
}
