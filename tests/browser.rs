//! The stages compile in a browser: naga and the compilers of browsers do not refuse the same WGSL.
//!
//! A page compiles every stage and makes every pipeline on a device with WebGPU's default limits, in headless Chromium on
//! its software adapter, and posts what went wrong. Skipped with a message where there is no Chromium; with `CI=true`
//! that is a failure.

use std::{
    env,
    ffi::OsString,
    io::{BufRead, BufReader, Read, Write},
    net::{TcpListener, TcpStream},
    process::{Child, Command, Stdio},
    sync::mpsc,
    thread,
    time::Duration,
};

use serde_json::{Value, json};

const PAGE: &str = include_str!("browser/compile.html");

/// How long a browser may take to start and answer before it is taken for dead.
const PATIENCE: Duration = Duration::from_secs(240);

#[test]
fn the_stages_compile_in_a_browser() {
    let stages = stages();
    let Some(answer) = ask_browser(&json!(stages).to_string()) else {
        return;
    };
    assert_eq!(answer["faults"], json!([]));
    let expected: usize = stages
        .iter()
        .map(|stage| length(&stage["compute"]) + length(&stage["draw"]))
        .sum();
    assert_eq!(answer["pipelines"], json!(expected));
}

#[test]
fn a_browser_names_the_stage_and_line_it_refuses() {
    // Both are in the language, and naga takes the first: operators that need parentheses.
    let code = "@compute @workgroup_size(1)\nfn go() { var a = 1u; a = a * a ^ a; }";
    let broken = json!([{ "name": "broken", "code": code, "compute": ["go"], "draw": [] }]);
    assert!(naga::front::wgsl::parse_str(code).is_ok());
    let Some(answer) = ask_browser(&broken.to_string()) else {
        return;
    };
    let fault = answer["faults"][0].as_str().unwrap_or_default();
    assert!(fault.starts_with("broken: line 2: "), "{answer}");
}

/// Every stage with its text, its compute entry points, and what it draws: vertex, fragment, format of the target.
fn stages() -> Vec<Value> {
    let stage = |name: &&str| {
        let code = drumlin_shaders::stage(name).expect("a stage that is listed has a text");
        let module = naga::front::wgsl::parse_str(&code).expect("naga parses our stages");
        let compute = module
            .entry_points
            .iter()
            .filter(|entry| entry.stage == naga::ShaderStage::Compute);
        let compute: Vec<_> = compute.map(|entry| entry.name.clone()).collect();
        let draw = match *name {
            "draw" => json!([
                ["vertex", "color", "rgba8unorm"],
                ["vertex", "depth_image", "r32float"],
                ["feature_vertex", "feature_color", "rgba8unorm"],
                ["feature_vertex", "feature_depth_image", "r32float"],
            ]),
            _ => json!([]),
        };
        assert_eq!(
            module.entry_points.len(),
            compute.len() + if *name == "draw" { 6 } else { 0 },
            "{name}"
        );
        json!({ "name": name, "code": code, "compute": compute, "draw": draw })
    };
    drumlin_shaders::STAGES.iter().map(stage).collect()
}

fn length(list: &Value) -> usize {
    list.as_array().map_or(0, Vec::len)
}

/// What the page posts when it is given these stages; none, said aloud, where there is no browser.
fn ask_browser(stages: &str) -> Option<Value> {
    let Some(browser) = browser() else {
        assert!(
            env::var("CI").as_deref() != Ok("true"),
            "no Chromium: `cargo verify` installs it"
        );
        println!("skipped: no Chromium (DRUMLIN_BROWSER names one)");
        return None;
    };
    let listener = TcpListener::bind("127.0.0.1:0").expect("a free port of this machine");
    let address = listener.local_addr().expect("a listener has an address");
    let (send, answers) = mpsc::channel();
    let stages = stages.to_owned();
    thread::spawn(move || {
        for stream in listener.incoming().flatten() {
            if let Some(answer) = serve(stream, &stages) {
                // Nobody waits any more when the test has given up.
                let _ = send.send(answer);
                return;
            }
        }
    });
    let profile = tempfile::tempdir().expect("a folder for the browser's profile");
    let mut child = Running(
        Command::new(&browser)
            .args([
                "--headless",
                "--no-sandbox",
                "--disable-quic",
                "--no-first-run",
                "--disable-background-networking",
            ])
            .args([
                "--enable-unsafe-webgpu",
                "--use-webgpu-adapter=swiftshader",
                "--disable-dev-shm-usage",
            ])
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .arg(format!("http://{address}/"))
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap_or_else(|error| panic!("{}: {error}", browser.display())),
    );
    let answer = answers.recv_timeout(PATIENCE);
    child.stop();
    let answer = answer.unwrap_or_else(|_| panic!("{} did not answer", browser.display()));
    Some(serde_json::from_str(&answer).expect("the page posts JSON"))
}

/// Answers one request; what was posted, if something was.
fn serve(stream: TcpStream, stages: &str) -> Option<String> {
    let mut reader = BufReader::new(stream);
    let mut request = String::new();
    reader.read_line(&mut request).ok()?;
    let mut bytes = 0;
    loop {
        let mut line = String::new();
        reader.read_line(&mut line).ok()?;
        if let Some(length) = line.to_ascii_lowercase().strip_prefix("content-length:") {
            bytes = length.trim().parse().ok()?;
        }
        if line.trim().is_empty() {
            break;
        }
    }
    let mut body = vec![0; bytes];
    reader.read_exact(&mut body).ok()?;
    let (kind, text) = match request.split_whitespace().nth(1)? {
        "/" => ("text/html", PAGE),
        "/stages.json" => ("application/json", stages),
        _ => ("text/plain", ""),
    };
    let head = format!(
        "HTTP/1.1 200 OK\r\nContent-Type: {kind}\r\nContent-Length: {}\r\nConnection: close\r\n\r\n",
        text.len()
    );
    let mut stream = reader.into_inner();
    stream.write_all(head.as_bytes()).ok()?;
    stream.write_all(text.as_bytes()).ok()?;
    request
        .starts_with("POST ")
        .then(|| String::from_utf8_lossy(&body).into_owned())
}

/// The Chromium that `cargo verify` found or installed, else one on the path.
fn browser() -> Option<OsString> {
    env::var_os("DRUMLIN_BROWSER").or_else(|| {
        let runs = |name: &&str| {
            let mut version = Command::new(name);
            version
                .arg("--version")
                .stdout(Stdio::null())
                .stderr(Stdio::null());
            version.status().is_ok_and(|status| status.success())
        };
        ["chromium", "chromium-browser", "google-chrome"]
            .iter()
            .find(|name| runs(name))
            .map(Into::into)
    })
}

/// A browser that does not outlive the test.
struct Running(Child);

impl Running {
    fn stop(&mut self) {
        // It may have ended by itself.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.stop();
    }
}
