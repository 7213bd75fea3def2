//! The dashboard over HTTP, with a browser's requests; `just browser` tests it with a real one.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test that cannot go on fails")]

use std::cell::Cell;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use prost::Message as _;
use serde_json::Value;
use tactus_e2e::{Process, ServiceUnderTest, free_endpoint};
use tactus_schema::key::{Keys, Topic};
use tactus_schema::pb;
use tokio::runtime::Runtime;
use tokio::time::interval;
use zenoh::bytes::Encoding;

use crate::bench::raw_session;

const HOLD: &str = "def run(rig):\n    tare()\n    press(5.0, 5.0, depths_mm = [0.3], dwell_s = 600.0)\n";

/// A running `tactus-web`, and its address.
struct Web {
    _process: Process,
    address: String,
    /// The header of commands, with the token.
    token: String,
}

impl Web {
    fn start(lab: &ServiceUnderTest, endpoint: &str) -> Self {
        let arguments = ["--endpoint", endpoint, "--listen", "127.0.0.1:0"];
        let mut process = Process::start("tactus-web", lab.folder.path(), &arguments);
        let line = process.wait_for("http://");
        let (address, token) = line.split("http://").nth(1).unwrap().trim().split_once("/#").unwrap();
        Self { _process: process, address: address.to_owned(), token: format!("X-Tactus-Token: {token}\r\n") }
    }

    fn send(&self, request: &str, headers: &str) -> TcpStream {
        let mut socket = TcpStream::connect(&self.address).unwrap();
        // Only a hang takes a minute.
        socket.set_read_timeout(Some(Duration::from_mins(1))).unwrap();
        let host =
            if headers.contains("Host:") { String::new() } else { format!("Host: {}\r\n", self.address) };
        write!(socket, "{request} HTTP/1.0\r\n{host}{headers}Content-Length: 0\r\n\r\n").unwrap();
        socket
    }

    /// Status code, and the whole response.
    fn ask(&self, request: &str, headers: &str) -> (u16, String) {
        let mut answer = String::new();
        self.send(request, headers).read_to_string(&mut answer).unwrap();
        let status = answer.split(' ').nth(1).and_then(|code| code.parse().ok());
        (status.unwrap_or_else(|| panic!("no status: {answer}")), answer)
    }

    /// Waits for the first view that fulfils a condition.
    fn until(&self, is_it: impl Fn(&Value) -> bool) -> Value {
        let lines = BufReader::new(self.send("GET /live", "")).lines();
        let views =
            lines.map_while(Result::ok).filter_map(|line| line.strip_prefix("data: ").map(str::to_owned));
        let mut last = String::new();
        for text in views {
            let view: Value = serde_json::from_str(&text).unwrap_or_else(|error| panic!("{error}: {text}"));
            if is_it(&view) {
                return view;
            }
            last = text;
        }
        panic!("the views ended with {last}")
    }
}

#[test]
fn the_page_shows_live_frames_and_stops_a_run() {
    let lab = ServiceUnderTest::start(|rig| rig);
    let web = Web::start(&lab, &lab.endpoint);
    let (status, page) = web.ask("GET /", "");
    assert_eq!(status, 200, "{page}");
    assert!(
        page.contains("<title>Tactus</title>")
            && page.contains("content-security-policy: default-src 'none'"),
        "{page}"
    );
    for file in ["/script.js", "/style.css"] {
        assert_eq!(web.ask(&format!("GET {file}"), "").0, 200, "{file}");
    }
    let first = web.until(|view| view["frame"].is_object() && view["health"].is_object());
    assert_eq!(first["simulated"], true);
    assert_eq!(first["frame"]["counts"].as_array().unwrap().len(), 48);
    let seq = first["frame"]["seq"].as_u64();
    web.until(|view| view["frame"]["seq"].as_u64() > seq.map(|seq| seq + 30));

    let script = lab.script("hold.star", HOLD);
    let client = lab.start_tactus(&["--json", "run", &script, "--no-report"]);
    web.until(|view| {
        view["run"]["phase"] == "running" && view["stage"]["z_mm"].as_f64().is_some_and(|z_mm| z_mm < -0.2)
    });
    // The client that runs the experiment holds the lease.
    let (status, answer) = web.ask("POST /pause", &web.token);
    assert!(status == 423 && answer.contains("holds the lease"), "{answer}");
    let (status, answer) = web.ask("POST /pause", &format!("{}X-Take-Over: smoke\r\n", web.token));
    assert_eq!(status, 204, "{answer}");
    let (status, answer) =
        web.ask("POST /stop", &format!("Origin: http://{}\r\nSec-Fetch-Site: same-origin\r\n", web.address));
    assert_eq!(status, 204, "{answer}");
    let ended = web.until(|view| view["run"]["phase"] == "finished");
    assert_eq!(ended["run"]["exit_status"], "stopped");
    assert!(ended["run"]["message"].as_str().unwrap().contains("stopped by dashboard"), "{ended}");
    assert_eq!(client.wait().0, Some(1));
    assert_eq!(web.ask("POST /resume", &web.token).0, 409, "there is no run to go on with");
}

#[test]
fn frames_of_another_publisher_are_not_shown() {
    const FAKE_SEQ: u64 = 1_000_000_000;
    let lab = ServiceUnderTest::start(|rig| rig);
    let web = Web::start(&lab, &lab.endpoint);
    web.until(|view| view["frame"].is_object());
    let runtime = Runtime::new().unwrap();
    let rogue = runtime.block_on(raw_session(&lab.endpoint));
    let is_shown = Arc::new(AtomicBool::new(false));
    let publishing = runtime.spawn({
        let is_shown = Arc::clone(&is_shown);
        async move {
            let fake = pb::Frame { seq: FAKE_SEQ, counts: vec![9999.0; 48], ..Default::default() };
            let encoding = Encoding::APPLICATION_PROTOBUF.with_schema("tactus.v1.Frame");
            let key = Keys::new("bench").topic(Topic::SensorFrame);
            let mut pace = interval(Duration::from_millis(5));
            while !is_shown.load(Ordering::SeqCst) {
                rogue.put(&key, fake.encode_to_vec()).encoding(encoding.clone()).await.unwrap();
                pace.tick().await;
            }
            rogue.close().await.unwrap();
        }
    });
    let views = Cell::new(0);
    web.until(|view| {
        assert!(view["frame"]["seq"].as_u64().is_none_or(|seq| seq < FAKE_SEQ), "{view}");
        views.set(views.get() + 1);
        views.get() == 80
    });
    is_shown.store(true, Ordering::SeqCst);
    runtime.block_on(publishing).unwrap();
}

#[test]
fn pages_of_other_sites_command_and_read_nothing() {
    let lab = ServiceUnderTest::start_only(|rig| rig);
    let web = Web::start(&lab, &lab.endpoint);
    web.until(|view| view["run"]["fault"].as_str().is_some_and(|fault| !fault.is_empty()));
    for headers in
        ["Origin: http://elsewhere.example\r\n", "Origin: null\r\n", "Sec-Fetch-Site: cross-site\r\n"]
    {
        let (status, answer) = web.ask("POST /reset", &format!("{}{headers}", web.token));
        assert_eq!(status, 403, "{headers}: {answer}");
    }
    for path in ["GET /", "GET /live", "POST /stop"] {
        let (status, answer) = web.ask(path, "Host: elsewhere.example\r\n");
        assert_eq!(status, 403, "{path}: {answer}");
    }
    web.until(|view| view["run"]["fault"].as_str().is_some_and(|fault| !fault.is_empty()));
    for token in ["", "X-Tactus-Token: 0123\r\n"] {
        let (status, answer) = web.ask("POST /reset", token);
        assert!(status == 401 && answer.contains("token"), "{answer}");
    }
    assert_eq!(web.ask("POST /stop", "").0, 204, "a stop wants no token");
    assert_eq!(web.ask("POST /reset", &web.token).0, 204);
    web.until(|view| view["run"]["fault"] == "");
    assert_eq!(web.ask("POST /fire", "").0, 404);
    assert_eq!(web.ask("GET /stop", "").0, 405, "looking at an address changes nothing");
}

#[test]
fn without_a_service_it_says_so_and_finds_it_when_it_comes() {
    let mut lab = ServiceUnderTest::start(|rig| rig);
    let nobody = Web::start(&lab, &free_endpoint());
    let view = nobody
        .until(|view| view["problem"].as_str().is_some_and(|problem| problem.contains("no service at")));
    assert_eq!(view["frame"], Value::Null);
    let (status, answer) = nobody.ask("POST /stop", "");
    assert!(status == 409 && answer.contains("STOP WAS NOT CONFIRMED"), "{answer}");
    let (status, answer) = nobody.ask("POST /pause", &nobody.token);
    assert!(status == 409 && answer.contains("no service at"), "{answer}");

    let web = Web::start(&lab, &lab.endpoint);
    web.until(|view| view["frame"].is_object());
    lab.daemon.kill();
    web.until(|view| view["problem"].as_str().is_some_and(|problem| !problem.is_empty()));
    lab.daemon = Process::start("tactusd", lab.folder.path(), &["--config", "tactusd.toml"]);
    lab.daemon.wait_for("ready");
    web.until(|view| view["frame"].is_object());
}

#[test]
fn a_stop_finds_a_place_among_a_thousand_connections_that_ask_nothing() {
    let lab = ServiceUnderTest::start(|rig| rig);
    let web = Web::start(&lab, &lab.endpoint);
    web.until(|view| view["frame"].is_object());
    let script = lab.script("hold.star", HOLD);
    let client = lab.start_tactus(&["--json", "run", &script, "--no-report"]);
    web.until(|view| view["run"]["phase"] == "running");
    let mut idle = Vec::new();
    // As many as this process may open, 1,000 at most.
    while idle.len() < 900
        && let Ok(mut socket) = TcpStream::connect(&web.address)
    {
        // Half a request: its headers never end.
        socket.write_all(b"POST /stop HTTP/1.1\r\nHost: ").unwrap();
        idle.push(socket);
    }
    assert!(idle.len() >= 512, "{}", idle.len());
    let (status, answer) = web.ask("POST /stop", "");
    assert_eq!(status, 204, "{answer}");
    assert_eq!(client.wait().0, Some(1));
}
