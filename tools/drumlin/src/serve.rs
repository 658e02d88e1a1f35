//! `drumlin serve`: the files of a pyramid over HTTP, for whoever streams it from elsewhere.
//!
//! Serves folders and archives alike, by the folder's names, and nothing else that lies on the disk: a route is made of
//! fixed words and whole numbers. Plain HTTP/1.1 on a thread a connection; anything that faces the world belongs behind
//! a web server that speaks TLS.

mod connection;
mod range;
mod request;
mod route;

use std::{
    io,
    net::{IpAddr, Ipv4Addr, SocketAddr, TcpListener},
    path::PathBuf,
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
    time::Duration,
};

use anyhow::{Context, Result};
use clap::Args;
use drumlin_core::pyramid::Pyramid;
use drumlin_terminal::{outcome::Outcome, print};
use serde_json::json;

use self::connection::{Served, converse};

/// Connections beyond which new ones are closed at once.
const CONNECTIONS: usize = 256;
/// Wait after an error of accepting, so that a system without file handles is not asked in a circle.
const PAUSE: Duration = Duration::from_millis(50);

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The pyramid; one that is replaced on the disk must be served anew
    #[arg(value_name = "PYRAMID")]
    pyramid: PathBuf,
    /// The port; 0 takes a free one
    #[arg(long, value_name = "PORT", default_value_t = 8080)]
    port: u16,
    /// The address to listen at; 0.0.0.0 is every one this machine has
    #[arg(long, value_name = "ADDRESS", default_value_t = IpAddr::V4(Ipv4Addr::LOCALHOST))]
    address: IpAddr,
    /// The address for programs on standard output
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<Outcome> {
    let served = Arc::new(Served::new(Pyramid::open(&arguments.pyramid)?)?);
    let asked = SocketAddr::new(arguments.address, arguments.port);
    let listener =
        TcpListener::bind(asked).with_context(|| format!("{asked}: listening failed"))?;
    let url = format!("http://{}/", listener.local_addr()?);
    print(&if arguments.json {
        format!("{}\n", json!({ "url": url }))
    } else {
        format!("{url}\n")
    })?;
    listen(&listener, &served)
}

/// Until the process is ended.
fn listen(listener: &TcpListener, served: &Arc<Served>) -> ! {
    let open = Arc::new(AtomicUsize::new(0));
    loop {
        let Ok((stream, _)) = listener.accept() else {
            thread::sleep(PAUSE);
            continue;
        };
        let place = Place::take(&open);
        let Some(place) = place else { continue };
        let served = Arc::clone(served);
        let spawned = thread::Builder::new().spawn(move || {
            let _place = place;
            // A connection that breaks is the client's affair.
            let _: io::Result<()> = converse(&stream, &served);
        });
        if spawned.is_err() {
            thread::sleep(PAUSE);
        }
    }
}

/// One of the connections there may be; given back when dropped.
struct Place(Arc<AtomicUsize>);

impl Place {
    fn take(open: &Arc<AtomicUsize>) -> Option<Self> {
        let place = Self(Arc::clone(open));
        (open.fetch_add(1, Ordering::Relaxed) < CONNECTIONS).then_some(place)
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}
