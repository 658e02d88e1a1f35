//! The update thread: plans are made beside the drawing, and the drawing never waits for one.
//!
//! ```text
//! frame n:    submit view n, take plan n − 1 (made for view n − 1), aim it at view n, draw
//! ```
//!
//! A plan is handed over before the next is begun, so none is lost, their order is the order of their uploads, and each
//! holds the upload budget. While none is ready the caller aims the last one at its new view and draws that.
//!
//! Stepped, there is no thread: each view gets its own plan, and the caller waits for it.

use std::thread::JoinHandle;

use crossbeam::channel::{Receiver, Sender, bounded};

use super::{FramePlan, FrameStats, Planner, PoolSizes};
use crate::{pyramid::PyramidError, stream::View};

/// A plan and what it cost.
#[derive(Debug)]
pub struct Planned {
    /// The plan, aimed at the view it was asked for with.
    pub plan: FramePlan,
    /// What it cost and lacks, for the view it was made for.
    pub stats: FrameStats,
    /// What went wrong since the plan before, each thing once.
    pub errors: Vec<String>,
    epoch: u32,
}

/// Makes plans, on a thread of its own or on the caller's.
#[derive(Debug)]
pub struct Updater {
    pool: PoolSizes,
    error_px: Option<f64>,
    /// Devices lost so far.
    epoch: u32,
    pace: Pace,
}

#[derive(Debug)]
enum Pace {
    Stepped(Box<Maker>, Option<Box<FramePlan>>),
    Paced(Option<Worker>),
}

/// The planner, wherever it works, and which device it counts on.
#[derive(Debug)]
struct Maker {
    planner: Planner,
    epoch: u32,
}

#[derive(Clone, Copy, Debug)]
struct Order {
    view: View,
    error_px: Option<f64>,
    epoch: u32,
}

#[derive(Debug)]
struct Worker {
    orders: Sender<Order>,
    stale: Receiver<Order>,
    plans: Receiver<Planned>,
    spare: Sender<FramePlan>,
    thread: JoinHandle<()>,
}

impl Updater {
    /// Plans for exactly the view that is asked for, on the caller's thread.
    #[must_use]
    pub fn stepped(planner: Planner) -> Self {
        Self {
            pool: planner.pool(),
            error_px: None,
            epoch: 0,
            pace: Pace::Stepped(Box::new(Maker { planner, epoch: 0 }), None),
        }
    }

    /// Plans on a thread of its own.
    ///
    /// # Errors
    ///
    /// When the system gives no thread.
    pub fn paced(planner: Planner) -> Result<Self, PyramidError> {
        let pool = planner.pool();
        let (orders, inbox) = bounded(1);
        let stale = inbox.clone();
        // Nothing is kept between the two: a plan waits until it is taken, and only then the next is begun.
        let (outbox, plans) = bounded(0);
        let (spare, spares) = bounded(2);
        let maker = Maker { planner, epoch: 0 };
        let work = move || work(maker, &inbox, &spares, &outbox);
        let thread = std::thread::Builder::new()
            .name("drumlin-update".into())
            .spawn(work);
        let thread = thread.map_err(|error| {
            PyramidError::Refused(format!("starting the update thread: {error}"))
        })?;
        let worker = Worker {
            orders,
            stale,
            plans,
            spare,
            thread,
        };
        Ok(Self {
            pool,
            error_px: None,
            epoch: 0,
            pace: Pace::Paced(Some(worker)),
        })
    }

    /// What the GPU's buffers must hold.
    #[must_use]
    pub fn pool(&self) -> PoolSizes {
        self.pool
    }

    /// Changes the largest screen-space error, from the next view on.
    pub fn set_error_px(&mut self, error_px: f64) {
        self.error_px = Some(error_px);
    }

    /// The pool is empty, its device was lost: from the next view on all is uploaded again. Plans under way are dropped,
    /// for they count on the pool as it was.
    pub fn device_lost(&mut self) {
        self.epoch = self.epoch.wrapping_add(1);
    }

    /// Says what the camera sees now and takes a plan, aimed at it; none while the next one is being made.
    pub fn update(&mut self, view: &View) -> Option<Planned> {
        let order = Order {
            view: *view,
            error_px: self.error_px.take(),
            epoch: self.epoch,
        };
        match &mut self.pace {
            Pace::Stepped(maker, spare) => {
                Some(maker.make(order, *spare.take().unwrap_or_default()))
            }
            Pace::Paced(worker) => {
                let worker = worker.as_ref()?;
                worker.submit(order);
                let mut planned = worker.plans.try_recv().ok()?;
                if planned.epoch != self.epoch {
                    return None;
                }
                planned.plan.aim(view);
                Some(planned)
            }
        }
    }

    /// Gives back the memory of a plan that is no longer drawn.
    pub fn recycle(&mut self, plan: FramePlan) {
        match &mut self.pace {
            Pace::Stepped(_, spare) => *spare = Some(Box::new(plan)),
            Pace::Paced(Some(worker)) => {
                // When there is enough of it already, it goes.
                let _ = worker.spare.try_send(plan);
            }
            Pace::Paced(None) => {}
        }
    }
}

impl Drop for Updater {
    fn drop(&mut self) {
        if let Pace::Paced(worker) = &mut self.pace
            && let Some(Worker {
                orders,
                stale,
                plans,
                spare,
                thread,
            }) = worker.take()
        {
            drop((orders, stale, plans, spare));
            // A thread that panicked has nothing left to say.
            let _ = thread.join();
        }
    }
}

impl Worker {
    /// Puts an order in place of one that was not taken up yet; what that one set still holds.
    fn submit(&self, mut order: Order) {
        while let Err(error) = self.orders.try_send(order) {
            if error.is_disconnected() {
                return;
            }
            if let Ok(old) = self.stale.try_recv() {
                order.error_px = order.error_px.or(old.error_px);
            }
        }
    }
}

fn work(
    mut maker: Maker,
    orders: &Receiver<Order>,
    spares: &Receiver<FramePlan>,
    plans: &Sender<Planned>,
) {
    for order in orders {
        let planned = maker.make(order, spares.try_recv().unwrap_or_default());
        if plans.send(planned).is_err() {
            return;
        }
    }
}

impl Maker {
    fn make(&mut self, order: Order, mut plan: FramePlan) -> Planned {
        if let Some(error_px) = order.error_px {
            self.planner.set_error_px(error_px);
        }
        if std::mem::replace(&mut self.epoch, order.epoch) != order.epoch {
            self.planner.forget_uploads();
        }
        let stats = self.planner.plan_into(&order.view, &mut plan);
        let (errors, epoch) = (self.planner.take_errors(), self.epoch);
        Planned {
            plan,
            stats,
            errors,
            epoch,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::{sync::Arc, time::Duration};

    use super::*;
    use crate::{stream::synthetic::Synthetic, terrain::PlannerDescriptor};

    fn planner() -> Planner {
        let mut source = Synthetic::new(4000, 3000, 2);
        source.delay = Duration::from_micros(200);
        Planner::new(Arc::new(source), PlannerDescriptor::default()).unwrap()
    }

    fn view(step: u32) -> View {
        let eye = [f64::from(step), 0.0, 200.0];
        View::looking_at(eye, [eye[0] + 10.0, 5.0, 190.0], 1.0, [640, 480])
    }

    #[test]
    fn plans_come_in_order_with_all_their_uploads_and_aimed_at_now() {
        let mut updater = Updater::paced(planner()).unwrap();
        let mut slots = std::collections::HashMap::new();
        let mut taken = 0;
        for step in 0..2000 {
            std::thread::sleep(Duration::from_micros(200));
            let Some(planned) = updater.update(&view(step)) else {
                continue;
            };
            taken += 1;
            for upload in &planned.plan.uploads {
                slots.insert(upload.slot, upload.tile.id);
            }
            for (drawn, place) in planned.plan.drawn.iter().zip(&planned.plan.places) {
                assert_eq!(slots[&drawn.slot], place.id);
                assert_eq!(
                    f64::from(drawn.origin[0]),
                    place.bounds.min[0] - f64::from(step)
                );
            }
            updater.recycle(planned.plan);
            if planned.stats.tiles_missing == 0 && taken > 50 {
                return;
            }
        }
        panic!("{taken} plans, and tiles are missing");
    }

    #[test]
    fn after_the_device_is_lost_no_plan_counts_on_it() {
        let mut updater = Updater::paced(planner()).unwrap();
        for step in 0..200 {
            std::thread::sleep(Duration::from_micros(300));
            updater.update(&view(step));
        }
        updater.device_lost();
        let planned = (200..4000).find_map(|step| {
            std::thread::sleep(Duration::from_micros(300));
            updater.update(&view(step))
        });
        let plan = planned.unwrap().plan;
        assert!(!plan.drawn.is_empty());
        for drawn in &plan.drawn {
            assert!(plan.uploads.iter().any(|upload| upload.slot == drawn.slot));
        }
    }

    #[test]
    fn stepped_every_view_has_its_plan() {
        let mut updater = Updater::stepped(planner());
        updater.set_error_px(7.0);
        for step in 0..10 {
            let planned = updater.update(&view(step)).unwrap();
            assert_eq!(planned.plan.frame.unwrap().tolerance, 7.0);
        }
    }

    #[test]
    fn an_updater_with_a_plan_in_hand_is_dropped_without_ado() {
        let mut updater = Updater::paced(planner()).unwrap();
        updater.update(&view(0));
        std::thread::sleep(Duration::from_millis(10));
        updater.update(&view(1));
    }
}
