//! Services on several hosts, joined by a router, and a collector that records all their rigs.
//!
//! `just hosts` sets `TACTUS_ZENOHD`, and a host is then a network namespace, the router stock, and a cut a link that is down.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test that cannot go on fails")]

use std::collections::BTreeSet;
use std::fs;
use std::io::{BufRead as _, BufReader, Write as _};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use rustix::process::Signal;
use serde_json::Value;
use tactus_e2e::{Link, Process, SmallDisk, binary, free_endpoint, repository, tactus, until, within};
use tactus_record::{Entry, Message, Timeline};
use tactus_schema::pb::run_event::Event;
use tempfile::TempDir;
use tokio::runtime::Runtime;

/// Time between two looks at files that grow.
const AGAIN: Duration = Duration::from_millis(100);

/// A service of one simulated rig on a host of its own, which a router joins to others.
struct Host {
    folder: TempDir,
    endpoint: String,
    /// In which its programs run, if it is one.
    namespace: Option<String>,
}

impl Host {
    fn new(rig: &str, router: &str, frames_kept: usize) -> Self {
        Self::at(free_endpoint(), None, (rig, router, frames_kept))
    }

    fn at(endpoint: String, namespace: Option<String>, (rig, router, kept): (&str, &str, usize)) -> Self {
        let folder = TempDir::new().unwrap();
        let shipped = fs::read_to_string(repository("config/rigs/sim.toml")).unwrap();
        let named = shipped.replace("name = \"sim\"", &format!("name = \"{rig}\""));
        fs::write(folder.path().join("rig.toml"), named).unwrap();
        let bus = format!("listen = [\"{endpoint}\"]\nconnect = [\"{router}\"]\nframes_kept = {kept}\n");
        let config = format!("rig = \"rig.toml\"\nrecordings = \"runs\"\n[bus]\n{bus}");
        fs::write(folder.path().join("tactusd.toml"), config).unwrap();
        Self { folder, endpoint, namespace }
    }

    fn start(&self, program: &str, args: &[&str]) -> Process {
        match &self.namespace {
            Some(namespace) => Process::start_in(namespace, &binary(program), self.folder.path(), args),
            None => Process::start(program, self.folder.path(), args),
        }
    }

    fn serve(&self) -> Process {
        let mut daemon = self.start("tactusd", &["--config", "tactusd.toml"]);
        daemon.wait_for("ready: frames flow");
        daemon
    }

    /// Starts `tactus` as a client of its service.
    fn tactus(&self, args: &[&str]) -> Process {
        self.start("tactus", &[&["--endpoint", &self.endpoint], args].concat())
    }

    /// Returns when a client of this host has seen so many frames; gives the number of the last one.
    fn wait_for_frames(&self, frames: usize) -> u64 {
        let mut viewer = self.tactus(&["watch", "--json"]);
        (0..frames).map(|_| seq(&viewer.wait_for("\"seq\""))).last().unwrap()
    }
}

/// Number of a frame in a line of `watch --json`.
fn seq(line: &str) -> u64 {
    let frame: Value = serde_json::from_str(line).unwrap_or_else(|error| panic!("{error}: {line}"));
    frame["seq"].as_u64().unwrap()
}

/// A router in this process.
fn router(runtime: &Runtime) -> (zenoh::Session, String) {
    let endpoint = free_endpoint();
    let mut config = zenoh::Config::default();
    config.insert_json5("mode", "\"router\"").unwrap();
    config.insert_json5("scouting/multicast/enabled", "false").unwrap();
    config.insert_json5("listen/endpoints", &format!("[\"{endpoint}\"]")).unwrap();
    (within(runtime, async { zenoh::open(config).await.unwrap() }), endpoint)
}

fn collect(folder: &Path, endpoint: &str, args: &[&str]) -> Process {
    Process::start("tactus", folder, &[&["--endpoint", endpoint], &COLLECT[..], args].concat())
}

const COLLECT: [&str; 4] = ["--json", "collect", "--out", "collected"];

/// Ends the collector, and returns its exit code and what it says of the rig.
fn ended(collector: Process, rig: &str) -> (Option<i32>, Value) {
    collector.signal(Signal::INT);
    let (code, said) = collector.wait();
    let summary = said.lines().find(|line| line.starts_with('{')).unwrap_or_else(|| panic!("{said}"));
    let summary: Value = serde_json::from_str(summary).unwrap();
    let of = |one: &&Value| one["rig"] == rig;
    let totals = summary["rigs"].as_array().unwrap().iter().find(of);
    (code, totals.unwrap_or_else(|| panic!("no {rig}: {said}")).clone())
}

/// The recordings in a folder, in order.
fn recordings(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    let mut found: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    found.retain(|path| path.extension().is_some_and(|extension| extension == "mcap"));
    found.sort();
    found
}

/// Numbers of the recorded frames, and frames that gaps say are lost.
fn recorded(files: &[PathBuf]) -> (Vec<u64>, u64) {
    let (mut seqs, mut lost) = (Vec::new(), 0);
    for file in files {
        for entry in tactus_record::read(file).unwrap() {
            match entry.unwrap() {
                Entry::Message { message: Message::Frame(frame), .. } => seqs.push(frame.seq),
                Entry::Message { message: Message::Event(event), .. } => {
                    if let Some(Event::Gap(gap)) = &event.event {
                        lost += gap.frames_lost;
                    }
                }
                Entry::Message { .. } | Entry::Run(_) | Entry::Attachment(_) => {}
            }
        }
    }
    (seqs, lost)
}

/// Returns once the rig's collected files have that frame.
fn wait_until_collected(folder: &Path, rig: &str, seq: u64) {
    let collected = folder.join("collected").join(rig);
    // A file that is just being created is no recording yet.
    let has = |file: &PathBuf| {
        tactus_record::read(file).is_ok() && recorded(std::slice::from_ref(file)).0.last() >= Some(&seq)
    };
    until(&format!("frame {seq} of {rig} is collected"), || {
        std::thread::sleep(AGAIN);
        recordings(&collected).last().is_some_and(has).then_some(())
    });
}

/// All frames that the files have, each once and in order; what is missing between them.
fn missing(seqs: &[u64]) -> u64 {
    assert!(seqs.is_sorted_by(|one, next| one < next), "{seqs:?}");
    let (first, last) = (seqs.first().unwrap(), seqs.last().unwrap());
    last - first + 1 - seqs.len() as u64
}

#[test]
fn rigs_of_all_hosts_are_collected_and_a_cut_leaves_no_gap() {
    let runtime = Runtime::new().unwrap();
    let (_router, router) = router(&runtime);
    let link = Link::to(&router).unwrap();
    let folder = TempDir::new().unwrap();
    let left = Host::new("left", &router, 1_800);
    let _left = left.serve();
    // It comes late, and gets what is kept.
    let before = left.wait_for_frames(15);
    let mut collector = collect(folder.path(), &link.endpoint, &["--roll-min", "0.05"]);
    collector.wait_for("left: found");

    // Another host comes, and everything reaches both through the router.
    let right = Host::new("right", &router, 1_800);
    let mut serving_right = right.serve();
    collector.wait_for("right: found");
    let status = tactus(folder.path(), &["--endpoint", &router, "status", "--json"]);
    let rigs: Vec<_> =
        status.json()["rigs"].as_array().unwrap().iter().map(|rig| rig["rig"].clone()).collect();
    assert_eq!(rigs, ["left", "right"], "{status:?}");
    let web = ["--endpoint", &router, "--rig", "right", "--listen", "127.0.0.1:0"];
    assert_the_dashboard_shows_frames(&mut Process::start("tactus-web", folder.path(), &web));
    wait_until_collected(folder.path(), "right", 0);
    let at_router = ["--endpoint", &router, "--rig", "right"];
    let reset = tactus(folder.path(), &[&at_router[..], &["reset"]].concat());
    assert_eq!(reset.code, Some(0), "{reset:?}");
    fs::write(folder.path().join("reads.star"), "def run(rig):\n    tare()\n    wait(6.0)\n").unwrap();
    let run = [&at_router[..], &["run", "reads.star", "--no-report"]].concat();
    let run = Process::start("tactus", folder.path(), &run);
    serving_right.wait_for("run accepted");
    right.wait_for_frames(30);

    link.cut();
    collector.wait_for("gone");
    left.wait_for_frames(90);
    link.restore();
    collector.wait_for("there again");
    let (code, said) = run.wait();
    assert_eq!(code, Some(0), "{said}");
    for (rig, host) in [("left", &left), ("right", &right)] {
        wait_until_collected(folder.path(), rig, host.wait_for_frames(15));
    }

    let (code, totals) = ended(collector, "left");
    assert_eq!(
        (code, &totals["frames_lost"], &totals["problem"]),
        (Some(0), &0.into(), &Value::Null),
        "{totals}"
    );
    for rig in ["left", "right"] {
        let files = recordings(&folder.path().join("collected").join(rig));
        let (seqs, lost) = recorded(&files);
        assert_eq!((missing(&seqs), lost), (0, 0), "{rig}");
        assert!(rig == "right" || seqs[0] < before, "{seqs:?}");
        // Files end at the time that was asked for, and each stands by itself.
        assert!(files.len() > 1, "{files:?}");
        for file in files {
            let info =
                tactus(folder.path(), &["record", "info", "--json", &file.display().to_string()]).json();
            assert_eq!((&info["rig"], &info["exit_status"]), (&rig.into(), &"done".into()), "{info}");
            assert_eq!(info["completeness"]["state"], "complete", "{info}");
            let table = file.with_extension("parquet").display().to_string();
            let exported = tactus(folder.path(), &["export", &file.display().to_string(), "--out", &table]);
            assert_eq!(exported.code, Some(0), "{exported:?}");
        }
    }
    assert_each_file_has_the_run_of_its_frames(&recordings(&folder.path().join("collected/right")));

    // One stop at the router reaches the rigs of all hosts.
    let stopped = tactus(folder.path(), &["--endpoint", &router, "stop", "--json"]);
    assert_eq!(stopped.code, Some(0), "{stopped:?}");
    assert!(["left", "right"].iter().all(|rig| stopped.out.contains(rig)), "{stopped:?}");
}

/// Live frames, one after another.
fn assert_the_dashboard_shows_frames(web: &mut Process) {
    let line = web.wait_for("http://");
    let (address, _) = line.split("http://").nth(1).unwrap().split_once("/#").unwrap();
    let mut socket = TcpStream::connect(address).unwrap();
    // Only a hang takes a minute.
    socket.set_read_timeout(Some(Duration::from_mins(1))).unwrap();
    write!(socket, "GET /live HTTP/1.0\r\nHost: {address}\r\n\r\n").unwrap();
    let lines: Vec<String> = BufReader::new(socket)
        .lines()
        .map_while(Result::ok)
        .scan(0, |frames, line| {
            *frames += usize::from(line == "event: frame");
            (*frames <= 3).then_some(line)
        })
        .collect();
    let frames = lines.windows(2).filter(|pair| pair[0] == "event: frame");
    let seqs: Vec<u64> = frames
        .map(|pair| {
            let told: Value = serde_json::from_str(pair[1].trim_start_matches("data: ")).unwrap();
            told["seq"].as_u64().unwrap_or_else(|| panic!("{told}"))
        })
        .collect();
    assert!(seqs.len() == 3 && seqs.is_sorted_by(|one, next| one < next), "{seqs:?}");
}

/// A file that begins within a run has all of the run's events before it.
#[track_caller]
fn assert_each_file_has_the_run_of_its_frames(files: &[PathBuf]) {
    let timelines: Vec<_> = files.iter().map(|file| Timeline::read(file).unwrap()).collect();
    assert!(!timelines.iter().any(Timeline::lacks_events), "{files:?}");
    let of_run = |timeline: &Timeline| -> Vec<u64> {
        let own = timeline.run().run_id.clone();
        timeline.events().iter().filter(|event| event.run_id != own).map(|event| event.seq).collect()
    };
    let with_run: Vec<_> = timelines.iter().map(of_run).filter(|seqs| !seqs.is_empty()).collect();
    assert!(with_run.len() > 1, "the run is in one file: {files:?}");
    for seqs in with_run {
        assert!(seqs.iter().copied().eq(0..seqs.len() as u64), "{seqs:?}");
    }
}

#[test]
fn what_is_no_longer_kept_after_a_cut_is_counted_told_and_recorded() {
    let runtime = Runtime::new().unwrap();
    let (_router, router) = router(&runtime);
    let link = Link::to(&router).unwrap();
    let folder = TempDir::new().unwrap();
    let host = Host::new("left", &router, 20);
    let _daemon = host.serve();
    // A name that nobody has.
    let mut collector = collect(folder.path(), &link.endpoint, &["left", "nobody"]);
    collector.wait_for("left: found");
    let before = host.wait_for_frames(5);
    wait_until_collected(folder.path(), "left", before);

    link.cut();
    collector.wait_for("left: gone");
    host.wait_for_frames(60);
    link.restore();
    collector.wait_for("frames before");
    let last = host.wait_for_frames(5);
    wait_until_collected(folder.path(), "left", last);

    let (code, totals) = ended(collector, "left");
    let (seqs, lost) = recorded(&recordings(&folder.path().join("collected/left")));
    assert_eq!(code, Some(3), "{totals}");
    assert!(lost >= 30, "{totals}");
    assert_eq!((missing(&seqs), totals["frames_lost"].as_u64()), (lost, Some(lost)), "{totals}");
}

#[test]
fn a_service_that_starts_again_gets_a_new_file_from_its_first_frame_on() {
    let runtime = Runtime::new().unwrap();
    let (_router, router) = router(&runtime);
    let folder = TempDir::new().unwrap();
    let host = Host::new("left", &router, 1_800);
    let daemon = host.serve();
    let mut collector = collect(folder.path(), &router, &[]);
    collector.wait_for("left: found");
    wait_until_collected(folder.path(), "left", host.wait_for_frames(5));
    daemon.signal(Signal::TERM);
    let (code, said) = daemon.wait();
    assert_eq!(code, Some(0), "{said}");
    collector.wait_for("left: gone");

    let rig = host.folder.path().join("rig.toml");
    let other_covering =
        fs::read_to_string(&rig).unwrap().replacen("thickness_mm = 1.016", "thickness_mm = 2.54", 1);
    fs::write(&rig, other_covering).unwrap();
    let _daemon = host.serve();
    collector.wait_for("started again");
    wait_until_collected(folder.path(), "left", host.wait_for_frames(30));
    let (code, totals) = ended(collector, "left");
    let files = recordings(&folder.path().join("collected/left"));
    assert_eq!((code, files.len(), &totals["frames_lost"]), (Some(0), 2, &0.into()), "{totals}");
    let coverings_mm = files.iter().map(|file| Timeline::read(file).unwrap().rig().covering.thickness_mm);
    assert_eq!(coverings_mm.collect::<Vec<_>>(), [1.016, 2.54], "each file has the rig of its service");
    assert_eq!(totals["restarts"], 1, "{totals}");
    let (seqs, lost) = recorded(&files[1..]);
    assert_eq!((seqs[0], missing(&seqs), lost), (0, 0, 0), "{seqs:?}");
}

#[test]
fn a_collector_that_starts_again_records_no_frame_twice() {
    let runtime = Runtime::new().unwrap();
    let (_router, router) = router(&runtime);
    let folder = TempDir::new().unwrap();
    let host = Host::new("left", &router, 1_800);
    let _daemon = host.serve();
    for _ in 0..2 {
        let mut collector = collect(folder.path(), &router, &[]);
        collector.wait_for("left: found");
        wait_until_collected(folder.path(), "left", host.wait_for_frames(30));
        let (code, totals) = ended(collector, "left");
        assert_eq!(code, Some(0), "{totals}");
    }
    let files = recordings(&folder.path().join("collected/left"));
    let (seqs, lost) = recorded(&files);
    assert_eq!((files.len(), missing(&seqs), lost), (2, 0, 0), "what was sent between the two is still kept");
}

#[test]
fn two_rigs_of_one_name_are_named_and_neither_is_recorded() {
    let runtime = Runtime::new().unwrap();
    let (_router, router) = router(&runtime);
    let folder = TempDir::new().unwrap();
    let hosts = ["here", "there"].map(|_| Host::new("twin", &router, 1_800));
    let _daemons = hosts.each_ref().map(Host::serve);
    // Both have joined the router once it refuses the name.
    let status = ["--endpoint", &router, "--rig", "twin", "status"];
    let refused = || tactus(folder.path(), &status).err.contains("several programs");
    until("the name is refused", || refused().then_some(()));
    let mut collector = collect(folder.path(), &router, &[]);
    collector.wait_for("several programs");
    let (code, totals) = ended(collector, "twin");
    assert_eq!((code, &totals["frames"]), (Some(3), &0.into()), "{totals}");
    assert!(totals["problem"].as_str().unwrap().contains("name of its own"), "{totals}");
}

#[test]
fn a_full_disk_ends_the_collector_and_its_file_says_so() {
    let folder = TempDir::new().unwrap();
    let Some(disk) = SmallDisk::mount(folder.path().join("collected")) else {
        return eprintln!("not tested: this user may not mount a disk");
    };
    // Its router is not there.
    let host = Host::new("left", &free_endpoint(), 1_800);
    let _daemon = host.serve();
    let mut collector = collect(folder.path(), &host.endpoint, &[]);
    collector.wait_for("left: found");
    wait_until_collected(folder.path(), "left", host.wait_for_frames(5));
    let fill = disk.fill();
    let (code, said) = collector.wait();
    assert!(code == Some(1) && said.contains("No space left"), "{code:?}: {said}");
    fs::remove_file(fill).unwrap();
    let file = recordings(&disk.path().join("left")).remove(0).display().to_string();
    let info = tactus(folder.path(), &["record", "info", "--json", &file]).json();
    assert_eq!(
        (&info["exit_status"], &info["completeness"]["state"]),
        (&"failed".into(), &"complete".into()),
        "{info}"
    );
}

/// Two hosts with a cable between them: network namespaces, which nothing else reaches.
struct Cable {
    near: String,
    far: String,
}

const NEAR: &str = "10.97.0.1/24";
const FAR: &str = "10.97.0.2/24";
const ROUTER: &str = "tcp/10.97.0.2:7447";

impl Cable {
    fn new() -> Self {
        let id = std::process::id();
        let cable = Self { near: format!("tactus-near-{id}"), far: format!("tactus-far-{id}") };
        for host in [&cable.near, &cable.far] {
            ip(&["netns", "add", host]);
        }
        let ends = ["type", "veth", "peer", "name", "cable", "netns", &cable.far];
        ip(&[&["link", "add", "cable", "netns", &cable.near], &ends[..]].concat());
        for (host, address) in [(&cable.near, NEAR), (&cable.far, FAR)] {
            ip(&["-n", host, "address", "add", address, "dev", "cable"]);
            ip(&["-n", host, "link", "set", "cable", "up"]);
            ip(&["-n", host, "link", "set", "lo", "up"]);
        }
        cable
    }

    /// What has passed it so far, both ways, with all headers.
    fn bytes(&self) -> u64 {
        let output = Command::new("ip")
            .args(["-n", &self.near, "-s", "-j", "link", "show", "cable"])
            .output()
            .unwrap();
        let shown: Value = serde_json::from_slice(&output.stdout).unwrap();
        ["rx", "tx"].iter().map(|way| shown[0]["stats64"][way]["bytes"].as_u64().unwrap()).sum()
    }

    fn set(&self, state: &str) {
        ip(&["-n", &self.near, "link", "set", "cable", state]);
    }
}

impl Drop for Cable {
    fn drop(&mut self) {
        for host in [&self.near, &self.far] {
            drop(Command::new("ip").args(["netns", "delete", host]).status());
        }
    }
}

fn ip(args: &[&str]) {
    let status = Command::new("ip").args(args).status().unwrap();
    assert!(status.success(), "ip {args:?}: {status}");
}

#[test]
#[ignore = "it makes network namespaces and needs zenohd: `just hosts`"]
fn a_host_that_is_cut_off_for_half_a_minute_loses_nothing_that_is_kept_and_nothing_silently() {
    let zenohd = std::env::var_os("TACTUS_ZENOHD").expect("TACTUS_ZENOHD is the router's program");
    let cable = Cable::new();
    let lab = TempDir::new().unwrap();
    let in_lab = |program: &Path, args: &[&str]| Process::start_in(&cable.far, program, lab.path(), args);
    let _router = in_lab(Path::new(&zenohd), &["--no-multicast-scouting", "--listen", ROUTER]);
    // A minute, and 20 s.
    for (rig, kept, is_whole) in [("long", 1_800, true), ("short", 600, false)] {
        let local = "tcp/127.0.0.1:7447".to_owned();
        let host = Host::at(local, Some(cable.near.clone()), (rig, ROUTER, kept));
        let mut daemon = host.serve();
        // Its own recording is what the collected one is compared with.
        let reset = host.tactus(&["reset"]).wait();
        assert_eq!(reset.0, Some(0), "{}", reset.1);
        fs::write(host.folder.path().join("reads.star"), "def run(rig):\n    tare()\n    wait(75.0)\n")
            .unwrap();
        // The service has joined the router by now or does so soon.
        let status = ["--endpoint", ROUTER, "status", "--rig", rig];
        until("it has joined", || (in_lab(&binary("tactus"), &status).wait().0 == Some(0)).then_some(()));
        let args = [&["--endpoint", ROUTER], &COLLECT[..], &[rig]].concat();
        let mut collector = in_lab(&binary("tactus"), &args);
        collector.wait_for("found");
        // At rest, with one who hears everything: what a rig costs the network.
        host.wait_for_frames(60);
        let before = cable.bytes();
        host.wait_for_frames(300);
        println!("{} bytes/s on the cable at 30 Hz", (cable.bytes() - before) / 10);
        let run = host.tactus(&["run", "reads.star", "--no-report"]);
        daemon.wait_for("run accepted");
        host.wait_for_frames(60);

        cable.set("down");
        host.wait_for_frames(30 * 30);
        cable.set("up");

        let (code, said) = run.wait();
        assert_eq!(code, Some(0), "{said}");
        let runs = fs::read_dir(host.folder.path().join("runs")).unwrap();
        let run = runs.map(|run| run.unwrap().path()).find(|path| path.is_dir()).unwrap();
        let own: BTreeSet<_> = recorded(&recordings(&run)).0.into_iter().collect();
        wait_until_collected(lab.path(), rig, *own.last().unwrap());
        let (code, totals) = ended(collector, rig);
        let (seqs, lost) = recorded(&recordings(&lab.path().join("collected").join(rig)));
        println!("{totals}");
        assert_eq!((missing(&seqs), totals["frames_lost"].as_u64()), (lost, Some(lost)), "{totals}");
        assert_eq!((lost == 0, code), (is_whole, Some(if is_whole { 0 } else { 3 })), "{totals}");
        let collected: BTreeSet<_> = seqs.into_iter().collect();
        let not_collected = own.difference(&collected).count() as u64;
        assert!(not_collected <= lost && own.len() > 60 * 30, "{not_collected} of {}, {totals}", own.len());
    }
}
