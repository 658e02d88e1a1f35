//! Loader threads: read, check and decode tiles, away from everything that must not wait.
//!
//! Requests and answers go through bounded channels. A request holds a ticket; there are as many as may be under way,
//! so neither channel ever blocks its sender. A ticket's generation is raised to cancel it: a loader looks before it
//! reads, and answers at once when nobody waits any more.

use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
    thread::JoinHandle,
    time::Duration,
};

use crossbeam::channel::{Receiver, Sender, bounded};

use super::{TileSource, mip_chain};
use crate::{
    geo::TileId,
    pyramid::{PyramidError, Summary, Tile, feature::FeatureGroup},
};

/// The right to have one request under way.
pub type Ticket = u32;

/// What to read.
#[derive(Debug)]
pub enum Job {
    /// A tile; its parent, but for the root.
    Tile(Option<Arc<Tile>>),
    /// A tile's imagery.
    Color,
}

/// What came of it.
#[derive(Debug)]
pub enum Loaded {
    /// A tile, and the features that stand in the place of some of its patches.
    Tile(Arc<Tile>, Arc<[FeatureGroup]>),
    /// Imagery as [`mip_chain`] makes it, or that there is none.
    Color(Option<Arc<[u8]>>),
    /// An error, of a tile or of imagery.
    Failed(PyramidError),
    /// Nobody waited any more, and nothing was read.
    Cancelled,
}

struct Request {
    ticket: Ticket,
    generation: u64,
    id: TileId,
    job: Job,
}

/// The threads and the channels to them.
#[derive(Debug)]
pub struct Loader {
    requests: Option<Sender<Request>>,
    answers: Receiver<(Ticket, Loaded)>,
    generations: Arc<[AtomicU64]>,
    free: Vec<Ticket>,
    threads: Vec<JoinHandle<()>>,
}

impl Loader {
    /// Starts the threads; at most `in_flight` requests are under way.
    ///
    /// # Errors
    ///
    /// When the system gives no thread.
    pub fn new(
        source: &Arc<dyn TileSource>,
        threads: usize,
        in_flight: u32,
    ) -> Result<Self, PyramidError> {
        let (requests, inbox) = bounded(in_flight as usize);
        let (outbox, answers) = bounded(in_flight as usize);
        let generations: Arc<[AtomicU64]> = (0..in_flight).map(|_| AtomicU64::new(0)).collect();
        let mut loader = Self {
            requests: Some(requests),
            answers,
            generations,
            free: (0..in_flight).rev().collect(),
            threads: Vec::new(),
        };
        for index in 0..threads.max(1) {
            let (source, generations) = (Arc::clone(source), Arc::clone(&loader.generations));
            let (inbox, outbox) = (Receiver::clone(&inbox), Sender::clone(&outbox));
            let thread = std::thread::Builder::new().name(format!("drumlin-loader-{index}"));
            let thread = thread.spawn(move || serve(&*source, &generations, &inbox, &outbox));
            let thread = thread.map_err(|error| {
                PyramidError::Refused(format!("starting a loader thread: {error}"))
            })?;
            loader.threads.push(thread);
        }
        Ok(loader)
    }

    /// Requests under way.
    #[must_use]
    pub fn in_flight(&self) -> usize {
        self.generations.len() - self.free.len()
    }

    /// True when one more request may be made.
    #[must_use]
    pub fn has_room(&self) -> bool {
        !self.free.is_empty()
    }

    /// Asks for a tile; none when too much is under way.
    pub fn request(&mut self, id: TileId, job: Job) -> Option<Ticket> {
        let ticket = self.free.pop()?;
        let generation = self.generations[ticket as usize].load(Ordering::Relaxed);
        let sent = self.requests.as_ref().map(|requests| {
            requests.try_send(Request {
                ticket,
                generation,
                id,
                job,
            })
        });
        if matches!(sent, Some(Ok(()))) {
            return Some(ticket);
        }
        self.free.push(ticket);
        None
    }

    /// Nobody waits for this any more. The ticket comes back with its answer.
    pub fn cancel(&self, ticket: Ticket) {
        self.generations[ticket as usize].fetch_add(1, Ordering::Relaxed);
    }

    /// The next answer, waiting for it at most so long.
    pub fn answer(&mut self, wait: Duration) -> Option<(Ticket, Loaded)> {
        let answer = if wait.is_zero() {
            self.answers.try_recv().ok()
        } else {
            self.answers.recv_timeout(wait).ok()
        };
        if let Some((ticket, _)) = answer {
            self.free.push(ticket);
        }
        answer
    }
}

impl Drop for Loader {
    fn drop(&mut self) {
        for generation in self.generations.iter() {
            generation.fetch_add(1, Ordering::Relaxed);
        }
        self.requests = None;
        for thread in self.threads.drain(..) {
            // A thread that panicked has nothing left to say.
            let _ = thread.join();
        }
    }
}

fn serve(
    source: &dyn TileSource,
    generations: &[AtomicU64],
    inbox: &Receiver<Request>,
    outbox: &Sender<(Ticket, Loaded)>,
) {
    for request in inbox {
        let current = generations[request.ticket as usize].load(Ordering::Relaxed);
        let loaded = if current == request.generation {
            // A panic is a bug of the source; it costs a tile and not the flight.
            catch_unwind(AssertUnwindSafe(|| read(source, &request))).unwrap_or_else(|_| {
                Loaded::Failed(PyramidError::Tile {
                    tile: request.id,
                    what: "reading it panicked".into(),
                })
            })
        } else {
            Loaded::Cancelled
        };
        if outbox.send((request.ticket, loaded)).is_err() {
            return;
        }
    }
}

fn read(source: &dyn TileSource, request: &Request) -> Loaded {
    let loaded = match &request.job {
        Job::Tile(parent) => read_tile(source, request.id, parent.as_deref()),
        Job::Color => read_color(source, request.id),
    };
    loaded.unwrap_or_else(Loaded::Failed)
}

fn read_tile(
    source: &dyn TileSource,
    id: TileId,
    parent: Option<&Tile>,
) -> Result<Loaded, PyramidError> {
    let tile = source.load(id, parent)?;
    let is_finest = id.level == source.metadata().finest();
    let features = if is_finest && tile.summary.flags & Summary::FEATURE != 0 {
        source.load_features(id)?
    } else {
        Vec::new()
    };
    Ok(Loaded::Tile(Arc::new(tile), features.into()))
}

fn read_color(source: &dyn TileSource, id: TileId) -> Result<Loaded, PyramidError> {
    let Some(texels) = source.load_color(id)? else {
        return Ok(Loaded::Color(None));
    };
    let picture = mip_chain(&texels).ok_or_else(|| PyramidError::Tile {
        tile: id,
        what: format!("imagery of {} bytes and not 256 × 256 × 4", texels.len()),
    })?;
    Ok(Loaded::Color(Some(picture)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stream::synthetic::Synthetic;

    fn source(delay: u64) -> Arc<dyn TileSource> {
        let mut source = Synthetic::new(1025, 1025, 1);
        source.delay = Duration::from_millis(delay);
        Arc::new(source)
    }

    #[test]
    fn no_more_is_under_way_than_allowed() {
        let mut loader = Loader::new(&source(5), 2, 3).unwrap();
        let tickets: Vec<_> = (0..5)
            .map(|_| loader.request(TileId::ROOT, Job::Color))
            .collect();
        assert_eq!(tickets.iter().flatten().count(), 3);
        assert_eq!(loader.in_flight(), 3);
        for _ in 0..3 {
            assert!(loader.answer(Duration::from_secs(60)).is_some());
        }
        assert_eq!(loader.in_flight(), 0);
    }

    #[test]
    fn a_cancelled_request_is_not_read() {
        let mut loader = Loader::new(&source(20), 1, 4).unwrap();
        let tickets: Vec<_> = (0..4)
            .filter_map(|_| loader.request(TileId::ROOT, Job::Color))
            .collect();
        tickets[1..]
            .iter()
            .for_each(|&ticket| loader.cancel(ticket));
        let answers: Vec<_> = (0..4)
            .filter_map(|_| loader.answer(Duration::from_secs(60)))
            .collect();
        assert!(matches!(answers[0].1, Loaded::Color(Some(_))));
        assert!(
            answers[2..]
                .iter()
                .all(|(_, loaded)| matches!(loaded, Loaded::Cancelled))
        );
    }
}
