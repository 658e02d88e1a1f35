//! What to read next, and what became of what was asked for.
//!
//! Requests are ordered by what they gain on the screen: a tile's gain is how far its parent's error is above the
//! tolerance, the visible ones first. Few are under way at a time, so that the order stays fresh; what nobody wants any
//! more is cancelled. A tile that failed is tried again later and later.

use std::{sync::Arc, time::Duration};

use super::{
    COLOR_BYTES, ColorLife, ColorPool, Job, Life, Loaded, Loader, NO_NODE, TILE_BYTES, Ticket,
    Tree, Wanted, residency::Residency,
};
use crate::geo::TileId;

/// When to try again after a failure.
#[derive(Clone, Copy, Debug)]
pub struct Retry {
    /// Milliseconds after the first failure; they double with each.
    pub first_millis: u64,
    /// The longest wait.
    pub longest_millis: u64,
}

impl Retry {
    /// The time of the next try. Up to a quarter is added, by tile and try, so that tiles that failed together are not
    /// tried together.
    #[must_use]
    pub fn at(&self, now: u64, attempts: u32, id: TileId) -> u64 {
        let wait =
            (self.first_millis << attempts.saturating_sub(1).min(20)).min(self.longest_millis);
        let address = u64::from(id.level) << 56 ^ u64::from(id.row) << 28 ^ u64::from(id.column);
        now + wait + mix(address ^ u64::from(attempts) << 50) % (wait / 4 + 1)
    }
}

/// Mixes the bits of a number: the finaliser of splitmix64.
pub(crate) fn mix(mut number: u64) -> u64 {
    number = (number ^ number >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    number = (number ^ number >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    number ^ number >> 31
}

#[derive(Clone, Copy, Debug)]
struct Flight {
    id: TileId,
    is_color: bool,
}

/// The requests under way and the order of those to come.
#[derive(Debug)]
pub struct Scheduler {
    loader: Loader,
    retry: Retry,
    flights: Vec<Option<Flight>>,
    tiles_in_flight: usize,
    colors_in_flight: usize,
    /// Pictures that may be under way or wait for their layer.
    color_limit: usize,
    queue: Vec<(f32, TileId, u32)>,
    /// What went wrong since somebody looked; the last few.
    errors: Vec<String>,
    failures: u64,
    behind: bool,
}

/// Tries after which a plan that waits for its tiles goes on without one, and counts it as given up.
pub(crate) const PATIENCE: u32 = 8;

impl Scheduler {
    /// Errors that are kept until somebody looks.
    const ERRORS: usize = 16;

    /// Nothing is under way; `color_limit` pictures at most will be, or wait for their layer.
    #[must_use]
    pub fn new(loader: Loader, tickets: u32, retry: Retry, color_limit: usize) -> Self {
        Self {
            loader,
            retry,
            flights: vec![None; tickets as usize],
            tiles_in_flight: 0,
            colors_in_flight: 0,
            color_limit,
            queue: Vec::new(),
            errors: Vec::new(),
            failures: 0,
            behind: false,
        }
    }

    /// Requests under way.
    #[must_use]
    pub fn in_flight(&self) -> usize {
        self.loader.in_flight()
    }

    /// True when the last plan could not ask for all it lacks.
    #[must_use]
    pub fn is_behind(&self) -> bool {
        self.behind
    }

    /// True when one more picture may be asked for.
    #[must_use]
    pub fn has_color_room(&self, colors: &ColorPool) -> bool {
        self.colors_in_flight + colors.ready() < self.color_limit
    }

    /// Reads that failed so far.
    #[must_use]
    pub fn failures(&self) -> u64 {
        self.failures
    }

    /// What went wrong since the last call.
    pub fn take_errors(&mut self) -> Vec<String> {
        std::mem::take(&mut self.errors)
    }

    /// Bytes set aside for what is under way and for pictures that wait for their layer.
    #[must_use]
    pub fn reserved_bytes(&self, colors: &ColorPool) -> u64 {
        let pictures = (self.colors_in_flight + colors.ready()) as u64;
        self.tiles_in_flight as u64 * TILE_BYTES + pictures * COLOR_BYTES
    }

    /// Takes one answer, waiting for it at most so long; false when there was none.
    pub(crate) fn receive(
        &mut self,
        tree: &mut Tree,
        room: &mut Residency,
        colors: &mut ColorPool,
        now: u64,
        wait: Duration,
    ) -> bool {
        let Some((ticket, loaded)) = self.loader.answer(wait) else {
            return false;
        };
        let Some(flight) = self.flights[ticket as usize].take() else {
            return true;
        };
        if flight.is_color {
            self.colors_in_flight -= 1;
        } else {
            self.tiles_in_flight -= 1;
        }
        let Some(place) = tree.find(flight.id) else {
            return true;
        };
        match loaded {
            Loaded::Tile(tile, features) if tile.id == flight.id => {
                if tree.node(place).tile().is_none() {
                    tree.arrive(place, tile);
                    tree.node_mut(place).features = features;
                    room.ram_bytes += tree.node(place).byte_count();
                }
            }
            Loaded::Color(texels) => self.color_came(tree, colors, place, ticket, texels),
            Loaded::Failed(error) => self.failed(tree, place, ticket, error.to_string(), now),
            Loaded::Tile(tile, _) => self.failed(
                tree,
                place,
                ticket,
                format!("{}: read as {}", flight.id, tile.id),
                now,
            ),
            Loaded::Cancelled => {}
        }
        true
    }

    fn color_came(
        &mut self,
        tree: &mut Tree,
        colors: &mut ColorPool,
        place: u32,
        ticket: Ticket,
        texels: Option<Arc<[u8]>>,
    ) {
        if !matches!(tree.node(place).color, ColorLife::Requested { ticket: asked, .. } if asked == ticket)
        {
            return;
        }
        match texels {
            Some(texels) => colors.arrive(tree, place, texels),
            None => tree.node_mut(place).color = ColorLife::Nothing,
        }
    }

    fn failed(&mut self, tree: &mut Tree, place: u32, ticket: Ticket, error: String, now: u64) {
        let node = tree.node_mut(place);
        if let Life::Requested {
            ticket: asked,
            attempts,
        } = node.life
            && asked == ticket
        {
            let attempts = attempts + 1;
            node.life = Life::Failed {
                attempts,
                retry_at: self.retry.at(now, attempts, node.id),
            };
        }
        if let ColorLife::Requested {
            ticket: asked,
            attempts,
        } = node.color
            && asked == ticket
        {
            let attempts = attempts + 1;
            node.color = ColorLife::Failed {
                attempts,
                retry_at: self.retry.at(now, attempts, node.id),
            };
        }
        self.failures += 1;
        if self.errors.len() < Self::ERRORS && !self.errors.contains(&error) {
            self.errors.push(error);
        }
    }

    /// Cancels what neither plan `plan` nor the one before looked at.
    pub(crate) fn cancel_stale(&mut self, tree: &mut Tree, plan: u64) {
        for (ticket, flight) in (0..).zip(&self.flights) {
            let Some(place) = flight.and_then(|flight| tree.find(flight.id)) else {
                continue;
            };
            let node = tree.node_mut(place);
            match (node.life.clone(), &node.color) {
                (
                    Life::Requested {
                        ticket: asked,
                        attempts,
                    },
                    _,
                ) if asked == ticket && node.used + 1 < plan => {
                    node.life = if attempts > 0 {
                        Life::Failed {
                            attempts,
                            retry_at: 0,
                        }
                    } else {
                        Life::Absent
                    };
                }
                (
                    _,
                    &ColorLife::Requested {
                        ticket: asked,
                        attempts,
                    },
                ) if asked == ticket && node.color_wanted + 1 < plan => {
                    node.color = if attempts > 0 {
                        ColorLife::Failed {
                            attempts,
                            retry_at: 0,
                        }
                    } else {
                        ColorLife::Absent
                    };
                }
                _ => continue,
            }
            self.loader.cancel(ticket);
        }
    }

    /// Asks for the wanted tiles that are not there, most urgent first, as far as there is room.
    pub(crate) fn request_tiles(
        &mut self,
        tree: &mut Tree,
        wanted: &Wanted,
        room: &mut Residency,
        colors: &mut ColorPool,
        now: u64,
        plan: Requester,
    ) {
        self.queue.clear();
        for &place in &wanted.nodes {
            let node = tree.node(place);
            if node.parent != NO_NODE && is_due(&node.life, now) {
                self.queue
                    .push((tree.node(node.parent).gain, node.id, place));
            }
        }
        self.queue
            .sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let queue = std::mem::take(&mut self.queue);
        let mut asked = 0;
        for &(_, id, place) in &queue {
            let bytes = self.reserved_bytes(colors) + TILE_BYTES;
            if self.tiles_in_flight >= plan.in_flight
                || !room.make_room(tree, colors, bytes, plan.number, plan.since)
            {
                break;
            }
            let Some(parent) = tree.node(tree.node(place).parent).tile().cloned() else {
                continue;
            };
            let Some(ticket) = self.fly(id, Job::Tile(Some(parent))) else {
                break;
            };
            let node = tree.node_mut(place);
            let attempts = if let Life::Failed { attempts, .. } = node.life {
                attempts
            } else {
                0
            };
            node.life = Life::Requested { ticket, attempts };
            asked += 1;
        }
        self.behind = asked < queue.len();
        self.queue = queue;
    }

    /// Asks for the wanted pictures that are not there.
    pub(crate) fn request_colors(
        &mut self,
        tree: &mut Tree,
        room: &mut Residency,
        colors: &mut ColorPool,
        now: u64,
        plan: Requester,
    ) {
        let wanted = std::mem::take(&mut colors.wanted);
        for &place in &wanted {
            let (due, attempts) = match tree.node(place).color {
                ColorLife::Absent => (true, 0),
                ColorLife::Failed { attempts, retry_at } => (retry_at <= now, attempts),
                _ => (false, 0),
            };
            let bytes = self.reserved_bytes(colors) + COLOR_BYTES;
            if !due {
                continue;
            }
            if !self.has_color_room(colors)
                || !room.make_room(tree, colors, bytes, plan.number, plan.since)
            {
                break;
            }
            let Some(ticket) = self.fly(tree.node(place).id, Job::Color) else {
                break;
            };
            tree.node_mut(place).color = ColorLife::Requested { ticket, attempts };
        }
        colors.wanted = wanted;
    }

    fn fly(&mut self, id: TileId, job: Job) -> Option<Ticket> {
        let is_color = matches!(job, Job::Color);
        let ticket = self.loader.request(id, job)?;
        self.flights[ticket as usize] = Some(Flight { id, is_color });
        if is_color {
            self.colors_in_flight += 1;
        } else {
            self.tiles_in_flight += 1;
        }
        Some(ticket)
    }
}

/// Who asks: a plan, and what may leave RAM for it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Requester {
    /// The plan's number: what it wants stays.
    pub(crate) number: u64,
    /// What was looked at in this plan or later stays too.
    pub(crate) since: u64,
    /// Tiles that may be under way.
    pub(crate) in_flight: usize,
}

fn is_due(life: &Life, now: u64) -> bool {
    match life {
        Life::Absent => true,
        Life::Failed { retry_at, .. } => *retry_at <= now,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waits_double_up_to_the_longest_and_differ_by_tile() {
        let retry = Retry {
            first_millis: 100,
            longest_millis: 2000,
        };
        let id = TileId::new(3, 1, 2);
        for (attempts, wait) in [(1, 100), (2, 200), (3, 400), (10, 2000), (60, 2000)] {
            let at = retry.at(5000, attempts, id);
            assert!((5000 + wait..=5000 + wait + wait / 4).contains(&at));
        }
        let times: std::collections::HashSet<_> = (0..50)
            .map(|row| retry.at(0, 3, TileId::new(6, row, 0)))
            .collect();
        assert!(times.len() > 20);
    }
}
