//! The dashboard over HTTP, with a browser's requests; `just browser` tests it with a real one.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test that cannot go on fails")]

use std::cell::Cell;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use prost::Message as _;
use serde_json::{Value, json};
use tactus_e2e::{Process, ServiceUnderTest, free_endpoint, raw_session, within};
use tactus_schema::key::{Keys, Topic};
use tactus_schema::pb;
use tokio::runtime::Runtime;
use tokio::time::interval;
use zenoh::bytes::Encoding;

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
        self.send_with(request, headers, "")
    }

    fn send_with(&self, request: &str, headers: &str, body: &str) -> TcpStream {
        let mut socket = TcpStream::connect(&self.address).unwrap();
        // Only a hang takes a minute.
        socket.set_read_timeout(Some(Duration::from_mins(1))).unwrap();
        let host =
            if headers.contains("Host:") { String::new() } else { format!("Host: {}\r\n", self.address) };
        let length = body.len();
        write!(socket, "{request} HTTP/1.0\r\n{host}{headers}Content-Length: {length}\r\n\r\n{body}")
            .unwrap();
        socket
    }

    /// Status code, and the whole response.
    fn ask(&self, request: &str, headers: &str) -> (u16, String) {
        read_answer(self.send(request, headers))
    }

    /// Status code and body of a request with the token and a body.
    fn order(&self, path: &str, body: &Value) -> (u16, String) {
        let body = if body.is_null() { String::new() } else { body.to_string() };
        let (status, answer) = read_answer(self.send_with(&format!("POST {path}"), &self.token, &body));
        let (_, text) = answer.split_once("\r\n\r\n").unwrap();
        (status, text.to_owned())
    }
    /// Waits until what a page knows fulfils a condition: `rig` and `view` put together, the `frame`, the `log` so far.
    fn until(&self, is_it: impl Fn(&Value) -> bool) -> Value {
        let mut known = json!({ "log": [], "frame": null });
        let mut kind = String::new();
        for line in BufReader::new(self.send("GET /live", "")).lines().map_while(Result::ok) {
            if let Some(event) = line.strip_prefix("event: ") {
                event.clone_into(&mut kind);
            }
            let Some(text) = line.strip_prefix("data: ") else { continue };
            let told: Value = serde_json::from_str(text).unwrap_or_else(|error| panic!("{error}: {text}"));
            match kind.as_str() {
                "frame" => known["frame"] = told,
                "log" => known["log"].as_array_mut().unwrap().extend(told.as_array().unwrap().clone()),
                "rig" | "view" => {
                    known.as_object_mut().unwrap().extend(told.as_object().unwrap().clone());
                    if known["problem"] != "" {
                        known["frame"] = Value::Null;
                    }
                }
                other => panic!("an event {other}: {text}"),
            }
            if is_it(&known) {
                return known;
            }
        }
        panic!("the views ended with {known}")
    }
}

fn read_answer(mut socket: TcpStream) -> (u16, String) {
    let mut answer = Vec::new();
    socket.read_to_end(&mut answer).unwrap();
    let answer = String::from_utf8_lossy(&answer).into_owned();
    let status = answer.split(' ').nth(1).and_then(|code| code.parse().ok());
    (status.unwrap_or_else(|| panic!("no status: {answer}")), answer)
}

/// Sum of the rises above the zero that all viewers share.
fn sum_of_rises(known: &Value) -> f64 {
    let numbers = |value: &Value| -> Vec<f64> {
        value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
    };
    let (counts, zero) = (numbers(&known["frame"]["counts"]), numbers(&known["zero"]["counts"]));
    counts.iter().zip(zero).map(|(counts, zero)| counts - zero).sum()
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
    for file in ["/stop.js", "/main.js", "/style.css", "/vendor/uPlot.esm.js", "/vendor/LICENCES.txt"] {
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
fn a_page_that_opens_in_mid_press_has_the_runs_zero_and_the_last_minutes() {
    let lab = ServiceUnderTest::start(|rig| rig);
    let early = Web::start(&lab, &lab.endpoint);
    let known = early.until(|known| known["frame"].is_object() && known["zero"].is_object());
    assert_eq!(known["zero"]["source"], "rig file", "{known}");
    let script = lab.script("hold.star", HOLD);
    let client = lab.start_tactus(&["--json", "run", &script, "--no-report"]);
    let deep = |known: &Value| known["frame"]["tip_mm"][2].as_f64().is_some_and(|z_mm| z_mm < -0.29);
    let is_pressed = |known: &Value| deep(known) && known["zero"]["source"] == "tare";
    let seen = early.until(is_pressed);
    assert!(sum_of_rises(&seen) > 100.0, "{seen}");
    // A page, and a dashboard, that begin now show the same zero.
    let late = Web::start(&lab, &lab.endpoint);
    for web in [&early, &late] {
        let known = web.until(is_pressed);
        assert_eq!(known["zero"], seen["zero"]);
        assert!(sum_of_rises(&known) > 100.0, "{known}");
        assert_eq!(known["run"]["run_id"], known["zero"]["run_id"]);
        let log = known["log"].to_string();
        assert!(log.contains("hold started by") && log.contains("a new zero"), "{log}");
    }
    // The last minutes: more than the frame that a page begins with.
    let mut history = Vec::new();
    early.send("GET /history", "").read_to_end(&mut history).unwrap();
    let body = history.windows(4).position(|four| four == b"\r\n\r\n").unwrap() + 4;
    let number =
        |at: usize| u32::from_le_bytes(history[body + at..body + at + 4].try_into().unwrap()) as usize;
    assert_eq!(number(0), 48);
    assert!(number(4) > 30, "{}", number(4));
    assert_eq!(history.len() - body, 8 + number(4) * (32 + 4 * 48));
    // A zero under load would be wrong.
    let (status, answer) = early.order("/zero", &Value::Null);
    assert!(status == 409 && answer.contains("a run is in progress"), "{answer}");
    assert_eq!(early.ask("POST /stop", "").0, 204);
    early.until(|known| known["run"]["phase"] == "finished");
    assert_eq!(client.wait().0, Some(1));
    assert_eq!(early.ask("POST /zero", "").0, 401, "what all viewers see changes with the token only");
    // The zero is the mean of half a second: all of it with the tip up.
    let up = Cell::new((0, 0));
    early.until(|known| {
        let (seq, frames) = up.get();
        let is_up = known["frame"]["tip_mm"][2].as_f64().is_some_and(|z_mm| z_mm > 1.0);
        let now = known["frame"]["seq"].as_u64().unwrap_or(0);
        up.set((now, if is_up { frames + u64::from(now > seq) } else { 0 }));
        up.get().1 > 20
    });
    assert_eq!(early.order("/zero", &Value::Null).0, 204);
    let known = early.until(|known| known["zero"]["source"] == "taken here" && known["frame"].is_object());
    assert!(sum_of_rises(&known).abs() < 200.0, "{known}");
}

#[test]
fn an_experiment_is_listed_checked_and_run_from_the_page() {
    let lab = ServiceUnderTest::start(|rig| rig);
    let web = Web::start(&lab, &lab.endpoint);
    web.until(|known| known["description"].is_object());
    assert_eq!(web.ask("POST /experiments", "").0, 401);
    let (status, listed) = web.order("/experiments", &Value::Null);
    assert_eq!(status, 200, "{listed}");
    let listed: Value = serde_json::from_str(&listed).unwrap();
    let image = listed.as_array().unwrap().iter().find(|each| each["name"] == "image").unwrap();
    let depth =
        image["parameters"].as_array().unwrap().iter().find(|each| each["name"] == "depth_mm").unwrap();
    assert_eq!((&depth["kind"], &depth["unit"]), (&json!("float"), &json!("mm")));

    // The verdict is of the rig that will run.
    let form = |depth_mm: f64| json!({ "experiment": "image", "parameters": { "depth_mm": depth_mm, "coverings_mm": [1.016] } });
    assert_eq!(web.ask("POST /plan", "").0, 401);
    let (status, verdict) = web.order("/plan", &form(0.1));
    let verdict: Value =
        serde_json::from_str(&verdict).unwrap_or_else(|error| panic!("{status} {error}: {verdict}"));
    assert_eq!((&verdict["possible"], &verdict["presses"]), (&json!(true), &json!(1)), "{verdict}");
    assert!(verdict["duration_s"].as_f64().unwrap() > 0.5, "{verdict}");
    let (_, verdict) = web.order("/plan", &form(0.9));
    let verdict: Value = serde_json::from_str(&verdict).unwrap();
    assert!(
        verdict["possible"] == false && verdict["message"].as_str().unwrap().contains("depth"),
        "{verdict}"
    );
    for (body, status, words) in [
        (form(-1.0), 409, "depth_mm"),
        (json!({ "experiment": "../secrets" }), 409, "no experiment"),
        (json!({ "experiment": "image", "script": "def run(rig): pass" }), 400, "unknown field"),
    ] {
        let (given, answer) = web.order("/plan", &body);
        assert!(given == status && answer.contains(words), "{given} {answer}");
        assert_eq!(web.order("/run", &body).0, status, "{body}");
    }
    // Nothing has moved, and nobody has the lease.
    let known = web.until(|known| known["health"]["lease_holder"] == "");
    assert_eq!(known["run"]["run_id"], "", "{known}");

    let run = json!({ "experiment": "image", "parameters": { "coverings_mm": [1.016] }, "seed": "7", "who": "ada" });
    let (status, answer) = web.order("/run", &run);
    assert_eq!(status, 204, "{answer}");
    let ended = web.until(|known| known["run"]["phase"] == "finished");
    assert_eq!(
        (&ended["run"]["exit_status"], &ended["run"]["who"]),
        (&json!("done"), &json!("ada")),
        "{ended}"
    );
    let (status, answer) = web.order("/move", &json!({ "x_mm": 3.0, "y_mm": 2.0 }));
    assert_eq!(status, 204, "{answer}");
    let moved =
        web.until(|known| known["run"]["experiment"] == "move-to" && known["run"]["phase"] == "finished");
    let at = |known: &Value, axis: &str| known["stage"][axis].as_f64().unwrap();
    assert!((at(&moved, "x_mm") - 23.0).abs() < 0.01 && (at(&moved, "z_mm") - 2.0).abs() < 0.01, "{moved}");
    let (status, answer) = web.order("/move", &json!({ "x_mm": 300.0, "y_mm": 2.0 }));
    assert!(status == 409 && answer.contains("envelope"), "{status} {answer}");
}

#[test]
fn frames_of_another_publisher_are_not_shown() {
    const FAKE_SEQ: u64 = 1_000_000_000;
    let lab = ServiceUnderTest::start(|rig| rig);
    let web = Web::start(&lab, &lab.endpoint);
    web.until(|view| view["frame"].is_object());
    let runtime = Runtime::new().unwrap();
    let rogue = within(&runtime, raw_session(&lab.endpoint));
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
    within(&runtime, publishing).unwrap();
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
