//! One connection: requests in, answers out, until either side has enough.

use std::{
    io::{self, ErrorKind, Write},
    net::TcpStream,
    time::{Duration, Instant},
};

use anyhow::Result;
use drumlin_core::pyramid::{Pyramid, StoreError};

use super::{
    range::{Asked, asked},
    request::{self, Request},
    route,
};

/// Bytes read and sent at a time.
const PIECE: u64 = 1 << 20;
/// A client that sends or takes nothing for so long has gone.
const SILENCE: Duration = Duration::from_secs(10);
/// The head of a request is there within this, or never.
const HEAD: Duration = Duration::from_secs(20);

/// A pyramid, and the tag of all its files: another pyramid's is another.
pub(crate) struct Served {
    pyramid: Pyramid,
    tag: String,
}

impl Served {
    /// Reads the root and the manifest, which has the hash of every shard.
    ///
    /// # Errors
    /// Where one of them cannot be read.
    pub(crate) fn new(pyramid: Pyramid) -> Result<Self> {
        let mut hasher = blake3::Hasher::new();
        for key in ["zarr.json", "manifest/shards.jsonl"] {
            let bytes = pyramid.store().size(key)?;
            hasher.update(&pyramid.store().read(key, 0..bytes)?);
        }
        let tag = format!("\"{}\"", &hasher.finalize().to_hex()[..32]);
        Ok(Self { pyramid, tag })
    }
}

/// Answers requests until the connection ends.
///
/// # Errors
/// Where it broke, or the client was too slow.
pub(crate) fn converse(mut stream: &TcpStream, served: &Served) -> io::Result<()> {
    stream.set_read_timeout(Some(SILENCE))?;
    stream.set_write_timeout(Some(SILENCE))?;
    stream.set_nodelay(true)?;
    let mut rest = Vec::new();
    loop {
        let read = request::read(&mut stream, &mut rest, Instant::now() + HEAD);
        let request = match read {
            Ok(Some(request)) => request,
            Ok(None) => return Ok(()),
            Err(error) => {
                if error.kind() == ErrorKind::InvalidData {
                    answer(&mut stream, "400 Bad Request", &[], 0, true)?;
                }
                return Err(error);
            }
        };
        // What follows a body cannot be found without reading it.
        let close = request.close || request.body;
        respond(&mut stream, served, &request, close)?;
        if close {
            return Ok(());
        }
    }
}

fn respond(
    out: &mut impl Write,
    served: &Served,
    request: &Request,
    close: bool,
) -> io::Result<()> {
    match request.method.as_str() {
        "GET" | "HEAD" => {}
        "OPTIONS" => {
            let allowed = [
                ("Access-Control-Allow-Methods", "GET, HEAD, OPTIONS"),
                (
                    "Access-Control-Allow-Headers",
                    "Range, If-Range, If-None-Match",
                ),
                ("Access-Control-Max-Age", "86400"),
            ];
            return answer(out, "204 No Content", &allowed, 0, close);
        }
        _ => {
            let allowed = [("Allow", "GET, HEAD, OPTIONS")];
            return answer(out, "405 Method Not Allowed", &allowed, 0, close);
        }
    }
    let store = served.pyramid.store();
    let found = route::key(&request.path).map(|key| (store.size(&key), key));
    let (bytes, key) = match found {
        None | Some((Err(StoreError::Missing { .. }), _)) => {
            return answer(out, "404 Not Found", &[], 0, close);
        }
        Some((Err(_), _)) => return answer(out, "500 Internal Server Error", &[], 0, close),
        Some((Ok(bytes), key)) => (bytes, key),
    };
    let tag = ("ETag", served.tag.as_str());
    let matches = |tags: &String| tags.contains(&served.tag) || tags.trim() == "*";
    if request.if_none_match.as_ref().is_some_and(matches) {
        return answer(out, "304 Not Modified", &[tag], 0, close);
    }
    // A part of something else is no use to the client.
    let current = request
        .if_range
        .as_deref()
        .is_none_or(|tag| tag.trim() == served.tag);
    let kind = ("Content-Type", content_type(&key));
    let ranges = ("Accept-Ranges", "bytes");
    let range = match asked(request.range.as_deref().filter(|_| current), bytes) {
        Asked::Outside => {
            let place = format!("bytes */{bytes}");
            let headers = [tag, ("Content-Range", &place)];
            return answer(out, "416 Range Not Satisfiable", &headers, 0, close);
        }
        Asked::Whole => {
            answer(out, "200 OK", &[tag, kind, ranges], bytes, close)?;
            0..bytes
        }
        Asked::Part(range) => {
            let place = format!("bytes {}-{}/{bytes}", range.start, range.end - 1);
            let headers = [tag, kind, ranges, ("Content-Range", &place)];
            answer(
                out,
                "206 Partial Content",
                &headers,
                range.end - range.start,
                close,
            )?;
            range
        }
    };
    if request.method == "HEAD" {
        return Ok(());
    }
    let mut next = range.start;
    while next < range.end {
        let end = range.end.min(next + PIECE);
        // The head has gone out: all that can be done is to break off.
        let piece = store.read(&key, next..end).map_err(io::Error::other)?;
        if piece.len() as u64 != end - next {
            return Err(ErrorKind::UnexpectedEof.into());
        }
        out.write_all(&piece)?;
        next = end;
    }
    Ok(())
}

fn content_type(key: &str) -> &'static str {
    if key.ends_with(".json") {
        "application/json"
    } else if key.ends_with(".jsonl") {
        "application/jsonl"
    } else {
        "application/octet-stream"
    }
}

/// Writes the head of an answer whose body has so many bytes.
fn answer(
    out: &mut impl Write,
    status: &str,
    headers: &[(&str, &str)],
    bytes: u64,
    close: bool,
) -> io::Result<()> {
    let mut head = format!(
        "HTTP/1.1 {status}\r\n\
         Access-Control-Allow-Origin: *\r\n\
         Access-Control-Expose-Headers: Content-Range, ETag, Accept-Ranges\r\n\
         X-Content-Type-Options: nosniff\r\n"
    );
    for (name, value) in headers {
        head += &format!("{name}: {value}\r\n");
    }
    // These two have no body, and the standard wants no length of one.
    if !status.starts_with("204") && !status.starts_with("304") {
        head += &format!("Content-Length: {bytes}\r\n");
    }
    if close {
        head += "Connection: close\r\n";
    }
    head += "\r\n";
    out.write_all(head.as_bytes())
}
