//! The head of a request, within limits of size and time.

use std::{
    io::{self, ErrorKind, Read},
    time::Instant,
};

/// Bytes a head may have.
const LIMIT: usize = 16 << 10;
/// Headers a head may have.
const HEADERS: usize = 64;

/// What is looked at of a request.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Request {
    pub(crate) method: String,
    pub(crate) path: String,
    pub(crate) range: Option<String>,
    pub(crate) if_range: Option<String>,
    pub(crate) if_none_match: Option<String>,
    /// The client wants no further answer on this connection.
    pub(crate) close: bool,
    /// A body follows, which nobody reads.
    pub(crate) body: bool,
}

/// Reads the next head. `rest` holds what was read past the last one. None where the client has gone.
///
/// # Errors
/// [`ErrorKind::TimedOut`] past the deadline, [`ErrorKind::InvalidData`] where it is no request or too long.
pub(crate) fn read(
    stream: &mut impl Read,
    rest: &mut Vec<u8>,
    deadline: Instant,
) -> io::Result<Option<Request>> {
    loop {
        if let Some((request, length)) = parse(rest)? {
            rest.drain(..length);
            return Ok(Some(request));
        }
        if rest.len() >= LIMIT {
            return Err(ErrorKind::InvalidData.into());
        }
        if Instant::now() >= deadline {
            return Err(ErrorKind::TimedOut.into());
        }
        let mut piece = [0; 2048];
        match stream.read(&mut piece) {
            Ok(0) if rest.is_empty() => return Ok(None),
            Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
            Ok(count) => rest.extend_from_slice(&piece[..count]),
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
}

/// The request at the start of the bytes and its length; none where it is not all there yet.
fn parse(bytes: &[u8]) -> io::Result<Option<(Request, usize)>> {
    let mut headers = [httparse::EMPTY_HEADER; HEADERS];
    let mut head = httparse::Request::new(&mut headers);
    let length = match head.parse(bytes) {
        Ok(httparse::Status::Complete(length)) => length,
        Ok(httparse::Status::Partial) => return Ok(None),
        Err(error) => return Err(io::Error::new(ErrorKind::InvalidData, error)),
    };
    let mut request = Request {
        method: head.method.unwrap_or_default().into(),
        path: head.path.unwrap_or_default().into(),
        // HTTP/1.0 closes unless asked not to; we always do.
        close: head.version == Some(0),
        ..Request::default()
    };
    for header in head.headers.iter() {
        let value = String::from_utf8_lossy(header.value).into_owned();
        match header.name.to_ascii_lowercase().as_str() {
            "range" => request.range = Some(value),
            "if-range" => request.if_range = Some(value),
            "if-none-match" => request.if_none_match = Some(value),
            "connection" => request.close |= value.to_ascii_lowercase().contains("close"),
            "transfer-encoding" => request.body = true,
            "content-length" => request.body |= value.trim() != "0",
            _ => {}
        }
    }
    Ok(Some((request, length)))
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    fn all(text: &str) -> io::Result<Vec<Request>> {
        let mut stream = text.as_bytes();
        let mut rest = Vec::new();
        let deadline = Instant::now() + Duration::from_secs(3600);
        let mut requests = Vec::new();
        while let Some(request) = read(&mut stream, &mut rest, deadline)? {
            requests.push(request);
        }
        Ok(requests)
    }

    #[test]
    fn requests_that_follow_each_other_are_told_apart() {
        let text = "GET /a HTTP/1.1\r\nRange: bytes=1-2\r\nHost: x\r\n\r\nHEAD /b HTTP/1.1\r\nconnection: Close\r\nContent-Length: 3\r\n\r\n";
        let requests = all(text).unwrap();
        assert_eq!(requests.len(), 2);
        assert_eq!(
            (requests[0].method.as_str(), requests[0].path.as_str()),
            ("GET", "/a")
        );
        assert_eq!(requests[0].range.as_deref(), Some("bytes=1-2"));
        assert!(!requests[0].close && !requests[0].body);
        assert!(requests[1].close && requests[1].body);
    }

    #[test]
    fn cut_and_senseless_and_endless_heads_are_errors() {
        let whole = "GET /a HTTP/1.1\r\nHost: x\r\n\r\n";
        for length in 1..whole.len() {
            assert!(all(&whole[..length]).is_err(), "{length} bytes");
        }
        assert!(all("nonsense\r\n\r\n").is_err());
        assert!(all(&format!("GET /{} HTTP/1.1\r\n\r\n", "a".repeat(1 << 20))).is_err());
        let headers: String = (0..100).map(|i| format!("H{i}: 1\r\n")).collect();
        assert!(all(&format!("GET / HTTP/1.1\r\n{headers}\r\n")).is_err());
    }

    #[test]
    fn a_deadline_that_has_passed_is_an_error() {
        let error = read(&mut &b"GET"[..], &mut Vec::new(), Instant::now()).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::TimedOut);
    }
}
