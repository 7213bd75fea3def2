//! The program `tactus-mock` at pseudo-terminals, in real time, through the production drivers.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::Duration;

use rustix::process::{Pid, Signal, kill_process};
use tactus_device::transport::Connect;
use tactus_device::transport::serial::SerialConnector;
use tactus_device::{
    ArrayExpectation, Clock, DrivenStage, HomingPermit, Permit, SensorCodec, SensorDriver, SensorEvent,
    Stage, StageOptions, Target,
};
use tactus_safety::Supervisor;
use tactus_schema::rig::{GrblAxes, StageProtocol};
use tactus_schema::{Frame, MonoTime, Rig, pb};
use tactus_virtual::TerminalPort;
use tactus_wire::weiss::{self as wire, Decoder};
use tokio::io::AsyncReadExt;

const CONFIG: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../config/rigs/pty.toml");

/// The running program; killed when dropped.
struct Mock {
    child: Child,
    commands: ChildStdin,
    answers: BufReader<ChildStdout>,
}

impl Mock {
    fn start(arguments: &[&str]) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_tactus-mock"))
            .args(["rig", "--config", CONFIG])
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let commands = child.stdin.take().unwrap();
        let answers = BufReader::new(child.stdout.take().unwrap());
        Self { child, commands, answers }
    }

    fn line(&mut self) -> String {
        let mut line = String::new();
        self.answers.read_line(&mut line).unwrap();
        line.trim_end().to_owned()
    }

    fn command(&mut self, command: &str) -> String {
        writeln!(self.commands, "{command}").unwrap();
        self.line()
    }

    /// Sends SIGTERM; true if the program then ended with status 0.
    fn terminate(&mut self) -> bool {
        let process = Pid::from_child(&self.child);
        kill_process(process, Signal::TERM).unwrap();
        self.child.wait().unwrap().success()
    }
}

impl Drop for Mock {
    fn drop(&mut self) {
        // It has already ended if the test succeeded.
        drop(self.child.kill());
        drop(self.child.wait());
    }
}

fn bench() -> Rig {
    Rig::from_toml(&fs::read_to_string(CONFIG).unwrap()).unwrap()
}

fn open_sensor(path: &Path) -> SensorDriver {
    let connector = SerialConnector::new(path, 115_200);
    SensorDriver::start(
        SensorCodec::default(),
        Box::new(connector),
        ArrayExpectation::of(&bench()),
        Clock::real(),
    )
}

/// The next frames.
async fn frames(sensor: &mut SensorDriver, count: usize) -> Vec<Frame> {
    let mut frames = Vec::new();
    while frames.len() < count {
        if let SensorEvent::Frame(frame) = sensor.next().await {
            assert_eq!(frame.counts.len(), 48);
            frames.push(frame);
        }
    }
    frames
}

/// Waits until the sensor is lost, and then for frames.
async fn frames_after_loss(sensor: &mut SensorDriver, count: usize) -> Vec<Frame> {
    while !matches!(sensor.next().await, SensorEvent::Lost(_)) {}
    frames(sensor, count).await
}

#[test]
fn it_prints_its_paths_takes_commands_and_ends_cleanly() {
    let folder = tempfile::tempdir().unwrap();
    let links = folder.path().join("mock");
    let mut mock = Mock::start(&["--seed", "1", "--link-dir", links.to_str().unwrap()]);
    for device in ["sensor", "stage"] {
        let line = mock.line();
        let path = line.strip_prefix(&format!("{device} ")).unwrap();
        assert!(path.starts_with("/dev/pts/"), "{line}");
        assert_eq!(fs::read_link(links.join(device)).unwrap(), PathBuf::from(path));
    }
    assert_eq!(mock.command("sensor stall 1s"), "ok");
    assert_eq!(mock.command("sensor stuck 48"), "error: element 48: elements are 0 to 47");
    assert!(mock.command("stage fly").starts_with("error: the stage has no fault \"fly\"; there is: "));
    let before = fs::read_link(links.join("stage")).unwrap();
    assert_eq!(mock.command("stage renumber"), "ok");
    while fs::read_link(links.join("stage")).unwrap() == before {
        std::thread::yield_now();
    }
    assert!(mock.terminate());
    assert_eq!(fs::read_dir(&links).unwrap().count(), 0, "the links are gone");
}

#[test]
fn its_paths_come_as_json_and_its_mistakes_with_their_place() {
    let mut mock = Mock::start(&["--json"]);
    let paths: serde_json::Value = serde_json::from_str(&mock.line()).unwrap();
    assert!(paths["sensor"].as_str().unwrap().starts_with("/dev/pts/"));
    assert!(mock.terminate());
    let folder = tempfile::tempdir().unwrap();
    let script = folder.path().join("faults.toml");
    fs::write(&script, "[[fault]]\nat_s = 1\ncommand = \"sensor explode\"\n").unwrap();
    let run = Command::new(env!("CARGO_BIN_EXE_tactus-mock"))
        .args(["rig", "--config", CONFIG, "--faults", script.to_str().unwrap()])
        .output()
        .unwrap();
    let words = String::from_utf8(run.stderr).unwrap();
    assert!(!run.status.success());
    assert!(words.contains("faults.toml") && words.contains("fault[0].command"), "{words}");
    fs::write(folder.path().join("sensor"), "precious").unwrap();
    let run = Command::new(env!("CARGO_BIN_EXE_tactus-mock"))
        .args(["rig", "--config", CONFIG, "--link-dir", folder.path().to_str().unwrap()])
        .output()
        .unwrap();
    let words = String::from_utf8(run.stderr).unwrap();
    assert!(!run.status.success() && words.contains("is no link"), "{words}");
    assert_eq!(fs::read_to_string(folder.path().join("sensor")).unwrap(), "precious");
}

/// Leave to move anywhere: a supervisor that takes the stage to stand there already.
fn permit(target: Target) -> Permit {
    let [x_mm, y_mm, z_mm] = target.position_mm;
    let status = pb::StageStatus::Idle.into();
    let mut supervisor = supervisor();
    // Some tests go deeper than the rig allows.
    let _too_deep = supervisor.on_report(&pb::StageState { x_mm, y_mm, z_mm, status, ..Default::default() });
    supervisor.permit(target, MonoTime::default()).unwrap()
}

/// Leave to home, which does not expire in a test.
fn homing() -> HomingPermit {
    supervisor().permit_homing(MonoTime::default().after(Duration::from_secs(1_000_000))).unwrap()
}

fn supervisor() -> Supervisor {
    let rig = Rig::from_toml(include_str!("../../../../config/rigs/sim.toml")).unwrap();
    Supervisor::without_sensor(&rig, rig.service.as_ref().unwrap())
}

#[tokio::test]
async fn the_production_drivers_work_with_it() {
    let folder = tempfile::tempdir().unwrap();
    let mut mock = Mock::start(&["--seed", "1", "--link-dir", folder.path().to_str().unwrap()]);
    let _paths = [mock.line(), mock.line()];
    let mut sensor = open_sensor(&folder.path().join("sensor"));
    let before = frames(&mut sensor, 5).await;

    let connector = SerialConnector::new(folder.path().join("stage"), 115_200);
    let options = StageOptions { tolerance_mm: 0.005, simulated: true };
    let protocol = StageProtocol::Grbl(GrblAxes::default());
    let (stage, mut reports) = DrivenStage::start(Box::new(connector), &protocol, options, Clock::real());
    tokio::spawn(async move { while reports.recv().await.is_some() {} });
    stage.state().wait_for(|state| state.status() != pb::StageStatus::Disconnected).await.unwrap();
    stage.home(homing()).await.unwrap();
    let target = Target { position_mm: [2.0, 2.0, 28.0], speed_mm_per_s: 20.0 };
    let reached = stage.move_to(permit(target)).await.unwrap();
    assert!(reached.iter().zip(target.position_mm).all(|(got, want)| (got - want).abs() < 0.005));
    let truth: serde_json::Value = serde_json::from_str(&mock.command("truth")).unwrap();
    let tip_mm = ["x_mm", "y_mm", "z_mm"].map(|axis| truth[axis].as_f64().unwrap());
    assert!(tip_mm.iter().zip(reached).all(|(there, got)| (there - got).abs() < 0.001), "{truth}");
    assert_eq!(truth["moving"], false);

    for (command, epochs) in [("sensor disconnect 200ms", 1), ("sensor renumber", 2)] {
        assert_eq!(mock.command(command), "ok");
        let after = frames_after_loss(&mut sensor, 5).await;
        assert_eq!(after[0].epoch, before[0].epoch + epochs, "{command}");
    }
    assert!(mock.terminate());
}

/// The freed number of an unplugged pseudo-terminal may be another program's next one: a link that stayed would lead hosts
/// there.
#[tokio::test]
async fn while_it_is_unplugged_there_is_no_link() {
    let folder = tempfile::tempdir().unwrap();
    let link = folder.path().join("sensor");
    let mut port = TerminalPort::new(Some(link.clone())).unwrap();
    assert_eq!(fs::read_link(&link).unwrap(), port.path().unwrap());
    port.close();
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    drop(port.open().unwrap());
    assert_eq!(fs::read_link(&link).unwrap(), port.path().unwrap());
}

#[tokio::test]
async fn a_host_that_comes_later_reads_nothing_old() {
    let mut mock = Mock::start(&["--seed", "1"]);
    let path = mock.line().strip_prefix("sensor ").unwrap().to_owned();
    let mut sensor = open_sensor(Path::new(&path));
    let [last] = &frames(&mut sensor, 1).await[..] else { panic!("one frame") };
    let last_ms = last.device_tick.unwrap().0;
    drop(sensor);
    // The device continues to send frames, for two seconds by another device's clock.
    let mut other = Mock::start(&["--seed", "2"]);
    let mut elsewhere = open_sensor(Path::new(other.line().strip_prefix("sensor ").unwrap()));
    frames(&mut elsewhere, 60).await;
    let mut host = SerialConnector::new(path, 115_200).connect().await.unwrap();
    let (mut decoder, mut buffer) = (Decoder::new(), [0; 256]);
    let first_ms = loop {
        let count = host.read(&mut buffer).await.unwrap();
        decoder.push(&buffer[..count]);
        if let Some(Ok(packet)) = decoder.next_packet() {
            break u64::from(wire::DecodedFrame::parse(&packet, 48).unwrap().timestamp_ms);
        }
    };
    assert!(first_ms > last_ms + 1000, "{last_ms} {first_ms}");
    assert!(mock.terminate() && other.terminate());
}
