//! A pyramid over HTTP, as a client on the wire sees it.

use std::{
    fs,
    io::{BufRead, BufReader, Read, Write},
    net::TcpStream,
    path::Path,
    process::{Child, Command, Stdio},
};

use crate::support::{binary, drumlin_fails, drumlin_ok, folder, rainier_pyramid};

/// A server of its own, ended with the test.
struct Server {
    process: Child,
    host: String,
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Status, head in small letters, and body.
type Answer = (u16, String, Vec<u8>);

impl Server {
    fn of(pyramid: &Path) -> Self {
        let mut process = Command::new(binary("drumlin"))
            .arg("serve")
            .arg(pyramid)
            .args(["--port", "0"])
            .stdout(Stdio::piped())
            .spawn()
            .expect("drumlin starts");
        let mut line = String::new();
        let out = process.stdout.take().expect("its output");
        BufReader::new(out)
            .read_line(&mut line)
            .expect("an address");
        let host = line
            .trim()
            .trim_start_matches("http://")
            .trim_end_matches('/');
        assert!(host.starts_with("127.0.0.1:"), "{line}");
        Self {
            host: host.to_owned(),
            process,
        }
    }

    /// Sends bytes and reads until the server closes.
    fn raw(&self, request: &[u8]) -> Vec<u8> {
        let mut stream = TcpStream::connect(&self.host).expect("a connection");
        // A server that has heard enough may close before all is sent.
        let _ = stream.write_all(request);
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        answer
    }

    fn ask(&self, method: &str, path: &str, headers: &str) -> Answer {
        let request =
            format!("{method} {path} HTTP/1.1\r\nHost: x\r\nConnection: close\r\n{headers}\r\n");
        let answer = self.raw(request.as_bytes());
        let end = answer
            .windows(4)
            .position(|four| four == b"\r\n\r\n")
            .expect("a head");
        let head = String::from_utf8_lossy(&answer[..end]).to_lowercase();
        let status = head[9..12].parse().expect("a status");
        (status, head, answer[end + 4..].to_vec())
    }
}

fn header<'a>(head: &'a str, name: &str) -> Option<&'a str> {
    head.lines()
        .find_map(|line| line.strip_prefix(name)?.strip_prefix(": "))
}

#[test]
fn files_and_parts_of_them_are_served_from_folders_and_archives() {
    let pyramid = rainier_pyramid();
    let zip = folder("serve").join("a.zip");
    drumlin_ok([
        std::ffi::OsStr::new("pack"),
        pyramid.as_os_str(),
        zip.as_os_str(),
    ]);
    let shard = "/tile/4/c/0/0/0";
    let want = fs::read(pyramid.join(&shard[1..])).expect("a shard");
    let mut tags = Vec::new();
    for served in [pyramid, &zip] {
        let server = Server::of(served);
        let (status, head, body) = server.ask("GET", "/zarr.json", "");
        assert_eq!(
            (status, header(&head, "content-type")),
            (200, Some("application/json"))
        );
        assert_eq!(Some(body), fs::read(pyramid.join("zarr.json")).ok());
        assert_eq!(header(&head, "access-control-allow-origin"), Some("*"));
        let (status, head, body) = server.ask("GET", shard, "");
        assert!(status == 200 && body == want);
        let tag = header(&head, "etag").expect("a tag").to_owned();
        let (status, head, body) = server.ask("GET", shard, "Range: bytes=10-19\r\n");
        assert!(status == 206 && body == want[10..20]);
        assert_eq!(
            header(&head, "content-range"),
            Some(format!("bytes 10-19/{}", want.len()).as_str())
        );
        let (status, head, body) = server.ask("HEAD", shard, "");
        assert!(status == 200 && body.is_empty());
        assert_eq!(
            header(&head, "content-length"),
            Some(want.len().to_string().as_str())
        );
        let (status, ..) = server.ask("GET", shard, "Range: bytes=999999999-\r\n");
        assert_eq!(status, 416);
        let (status, _, body) = server.ask("GET", shard, &format!("If-None-Match: {tag}\r\n"));
        assert!(status == 304 && body.is_empty());
        // A part of another pyramid's file is no use: the whole is sent.
        let (status, _, body) =
            server.ask("GET", shard, "Range: bytes=0-1\r\nIf-Range: \"other\"\r\n");
        assert!(status == 200 && body == want);
        let (status, head, _) = server.ask("OPTIONS", shard, "Origin: https://example.com\r\n");
        assert_eq!(status, 204);
        assert!(
            header(&head, "access-control-allow-headers").is_some_and(|all| all.contains("range"))
        );
        tags.push(tag);
    }
    // An archive is the same pyramid as its folder.
    assert_eq!(tags[0], tags[1]);
}

#[test]
fn nothing_but_the_pyramid_is_served_and_nonsense_ends_the_connection_alone() {
    let server = Server::of(rainier_pyramid());
    for path in [
        "/",
        "/../Cargo.toml",
        "/tile/../../../../../../etc/passwd",
        "/%2e%2e/zarr.json",
        "/tile/4/c/99999999999999999999/0/0",
        "/tile/4/c/4294967295/0/0",
        "/tile/77/zarr.json",
    ] {
        let (status, _, body) = server.ask("GET", path, "");
        assert!(status == 404 && body.is_empty(), "{path}: {status}");
    }
    assert_eq!(server.ask("DELETE", "/zarr.json", "").0, 405);
    assert_eq!(
        server.ask("POST", "/zarr.json", "Content-Length: 5\r\n").0,
        405
    );
    assert!(
        server
            .raw(b"\x16\x03\x01nonsense\r\n\r\n")
            .starts_with(b"HTTP/1.1 400 ")
    );
    assert!(
        server.raw(&[b'a'; 100_000]).starts_with(b"HTTP/1.1 400 ")
            || server.raw(b"x y z\r\n\r\n").starts_with(b"HTTP/1.1 400 ")
    );
    // Two requests on one connection.
    let twice =
        "GET /zarr.json HTTP/1.1\r\n\r\nHEAD /zarr.json HTTP/1.1\r\nConnection: close\r\n\r\n";
    let answer = server.raw(twice.as_bytes());
    let answer = String::from_utf8_lossy(&answer);
    assert_eq!(answer.matches("HTTP/1.1 200 OK").count(), 2);
    assert_eq!(server.ask("GET", "/zarr.json", "").0, 200);
}

#[test]
fn what_cannot_be_served_is_told() {
    let server = Server::of(rainier_pyramid());
    let port = server.host.rsplit(':').next().expect("a port");
    let pyramid = rainier_pyramid().to_str().expect("a plain name");
    let line = drumlin_fails(3, ["serve", pyramid, "--port", port]);
    assert!(line.contains(port), "{line}");
    drumlin_fails(3, ["serve", "nowhere.zarr"]);
    drumlin_fails(2, ["serve", pyramid, "--port", "65536"]);
}
