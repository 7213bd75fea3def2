//! kill -9 of the service at random instants of a real-time run, from homing to the closing of its recording.
//!
//! `TACTUS_TRIALS=200` says how many; `just kill-trials` plays them. `TACTUS_SEED` chooses other instants.

use std::path::Path;
use std::time::{Duration, Instant};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rustix::process::Signal;
use serde_json::Value;
use tactus_e2e::tactus;
use tactus_record::{Entry, Message};
use tactus_schema::key::Command;
use tactus_schema::pb::{self, run_event::Event};

use crate::bench::{Bench, Options, Seen, TRIES_MAX, number, trials};

/// One press, slow enough that its parts can be told apart.
const PRESS: &str = "def run(rig):\n    tare()\n    press(5.0, 5.0, depths_mm = [0.3], dwell_s = 0.3)\n";

/// Below this height the way down goes in steps that are confirmed one by one.
const APPROACH_HEIGHT_MM: f64 = 0.3;

/// A tip whose service has died goes no deeper than this below its last confirmed depth.
const STEP_MM: f64 = 0.1;

/// The stage's own resolution and tolerance.
const TOLERANCE_MM: f64 = 0.006;

/// Bytes that were sent just before the kill reach the stage within this time, and it begins to move.
const UNDER_WAY: Duration = Duration::from_millis(500);

/// What a killed service may lose of its recording.
const LOSS_MAX_MS: u32 = 1000;

/// Part of a run, which begins with something that shows on the stage's line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Part {
    Homing,
    Approach,
    Loading,
    Dwell,
    Retract,
    Closing,
}

const PARTS: [Part; 6] =
    [Part::Homing, Part::Approach, Part::Loading, Part::Dwell, Part::Retract, Part::Closing];

impl Part {
    /// About how long it lasts.
    fn lasts(self) -> Duration {
        Duration::from_millis(match self {
            Self::Homing => 400,
            Self::Approach | Self::Retract => 120,
            Self::Loading => 800,
            Self::Dwell => 500,
            Self::Closing => 150,
        })
    }
}

/// What one trial showed.
#[derive(Debug, Clone, Copy)]
struct Shown {
    part: Part,
    /// Below the last confirmed depth, in mm; in the air below the height of approach, in homing below its start.
    deeper_mm: f64,
    /// Frames that the sensor had sent and the recording lacks, as time.
    lost_ms: Option<u32>,
}

#[test]
fn a_service_that_is_killed_at_any_instant_leaves_the_tip_the_recording_and_the_next_start_safe() {
    let count = trials().unwrap_or(PARTS.len());
    let mut random = ChaCha8Rng::seed_from_u64(number("TACTUS_SEED").unwrap_or(0));
    let mut bench = Bench::start(Options::default());
    let mut shown = Vec::new();
    for nth in 0..count {
        let part = PARTS[nth % PARTS.len()];
        let after = part.lasts().mul_f64(random.random());
        shown.push(trial(&mut bench, part, after));
    }
    println!(
        "{:<12}{:>7}{:>20}{:>26}{:>22}",
        "part", "kills", "deeper mm, greatest", "recordings left open", "lost ms, greatest"
    );
    for part in PARTS {
        let of_part: Vec<_> = shown.iter().filter(|shown| shown.part == part).collect();
        let deepest = of_part.iter().map(|shown| shown.deeper_mm).fold(f64::NEG_INFINITY, f64::max);
        let losses: Vec<_> = of_part.iter().filter_map(|shown| shown.lost_ms).collect();
        let lost = losses.iter().max().map_or_else(|| "-".to_owned(), ToString::to_string);
        println!(
            "{:<12}{:>7}{deepest:>20.3}{:>26}{lost:>22}",
            format!("{part:?}"),
            of_part.len(),
            losses.len()
        );
    }
}

fn trial(bench: &mut Bench, part: Part, after: Duration) -> Shown {
    let before_mm = bench.truth()["z_mm"].as_f64().unwrap();
    let (mut run, mut confirmed_mm) = (None, None);
    if part == Part::Homing {
        let until_homing = |_| {
            let resetting = bench.send(Command::Reset);
            let homes = |_, seen: &Seen| matches!(seen, Seen::Home).then_some(());
            bench.stage.unless(|| resetting.is_finished(), homes)
        };
        assert!((0..TRIES_MAX).find_map(until_homing).is_some(), "no reset came to homing");
    } else {
        // A machine without time for the frames lets the supervisor end the run before that part.
        let until_part = |_| {
            bench.reset();
            bench.stage.forget();
            run = Some((bench.run(PRESS), Instant::now()));
            until(bench, part)
        };
        confirmed_mm = (0..TRIES_MAX).find_map(until_part);
        assert!(confirmed_mm.is_some(), "no run came to {part:?}");
    }
    // A report of a stage that stands still is a confirmation.
    bench.stage.watch(Instant::now() + after, |_, seen| {
        if let Seen::Report { state, z_mm } = seen
            && state == "Idle"
        {
            confirmed_mm = Some(*z_mm);
        }
    });
    let sent = bench.sent();
    bench.daemon().signal(Signal::KILL);
    let killed = Instant::now();
    bench.take_daemon().wait();
    bench.stage.watch(killed, |at, seen| {
        if let Seen::Report { state, z_mm } = seen
            && state == "Idle"
            && at < killed
        {
            confirmed_mm = Some(*z_mm);
        }
    });

    bench.stage.pass(UNDER_WAY);
    let rest = bench.truth_at_rest();
    let rest_mm = rest["z_mm"].as_f64().unwrap();
    let (from_mm, allowed_mm) = match (part, confirmed_mm) {
        // Homing goes up only.
        (Part::Homing, _) => (before_mm, 0.0),
        (_, Some(confirmed_mm)) if confirmed_mm <= APPROACH_HEIGHT_MM => (confirmed_mm, STEP_MM),
        // In the air the tip may go on to the height of approach.
        _ => (APPROACH_HEIGHT_MM, 0.0),
    };
    let deeper_mm = from_mm - rest_mm;
    assert!(
        deeper_mm <= allowed_mm + TOLERANCE_MM,
        "{part:?} after {after:?}: {deeper_mm} mm deeper than {from_mm} mm"
    );

    let left = run.map(|(recording, accepted)| {
        (left_behind(bench.folder.path(), &recording, sent.last_ms, killed - accepted), recording)
    });
    bench.restart();
    let status = bench.until("an answer", |_| true);
    let state = status.state.unwrap();
    assert_eq!(state.fault, "nothing has been reset since the service started");
    assert_eq!(state.phase(), pb::RunPhase::Idle);
    let lost_ms = left.and_then(|(lost_ms, recording)| {
        let info = info(bench.folder.path(), &recording);
        let status = info["exit_status"].as_str().unwrap().to_owned();
        assert_eq!(status, if lost_ms.is_some() { "crashed" } else { "done" }, "{part:?}: {info}");
        lost_ms
    });
    assert_eq!(bench.truth(), rest, "{part:?}: the new service moved the stage");
    Shown { part, deeper_mm, lost_ms }
}

/// Waits until a part of the run begins; returns the height that was last confirmed, infinite if none was. `None` if the run
/// ends before.
fn until(bench: &Bench, part: Part) -> Option<f64> {
    let (mut has_pressed, mut confirmed_mm) = (false, f64::INFINITY);
    bench.stage.unless(
        || bench.is_finished(),
        |_, seen| {
            let Seen::Report { state, z_mm } = seen else { return None };
            if state == "Idle" {
                has_pressed |= *z_mm < -0.29;
                confirmed_mm = *z_mm;
            }
            let begins = match part {
                Part::Homing => true,
                Part::Approach => *z_mm < 1.99,
                Part::Loading => *z_mm < APPROACH_HEIGHT_MM - 0.01,
                Part::Dwell => has_pressed,
                Part::Retract => has_pressed && *z_mm > -0.28,
                Part::Closing => has_pressed && *z_mm > 1.9,
            };
            begins.then_some(confirmed_mm)
        },
    )
}

/// How much of what the sensor had sent at the kill the recording lacks, in ms; `None` if the run was over and the recording
/// closed.
fn left_behind(folder: &Path, recording: &Path, sent_ms: u32, since_accepted: Duration) -> Option<u32> {
    let mut last_ms = None;
    let mut is_over = false;
    for entry in tactus_record::read(recording).unwrap().map_while(Result::ok) {
        match entry {
            Entry::Message { message: Message::Frame(frame), .. } => last_ms = frame.device_tick,
            Entry::Message { message: Message::Event(event), .. } => {
                is_over |= matches!(event.event, Some(Event::Finished(_)));
            }
            Entry::Message { .. } | Entry::Run(_) | Entry::Attachment(_) => {}
        }
    }
    let info = tactus(folder, &["--json", "record", "info", &recording.display().to_string()]);
    if is_over && info.code == Some(0) {
        return None;
    }
    assert_eq!(info.code, Some(3), "{info:?}");
    let since_ms = u32::try_from(since_accepted.as_millis()).unwrap();
    let lost_ms = last_ms.map_or(since_ms, |last| sent_ms.saturating_sub(u32::try_from(last.0).unwrap()));
    assert!(lost_ms.min(since_ms) <= LOSS_MAX_MS, "{lost_ms} ms of frames are lost");
    Some(lost_ms.min(since_ms))
}

fn info(folder: &Path, recording: &Path) -> Value {
    let info = tactus(folder, &["--json", "record", "info", &recording.display().to_string()]);
    assert_eq!(info.code, Some(0), "{info:?}");
    info.json()
}
