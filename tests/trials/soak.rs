//! The service in real time for as long as `TACTUS_SOAK_HOURS` says, with a subscriber and runs without a pause: its memory,
//! its frames, its clock. `just soak 1` plays an hour; without the variable it is a few seconds.

use std::fs;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use tactus_e2e::{Process, repository};
use tactus_schema::key::Command;
use tactus_schema::pb;

use crate::bench::{Bench, Options, number};

const PRESSES: &str = "def run(rig):
    tare()
    for i in range(20):
        press(2.0 + i % 5 * 2.0, 5.0, depths_mm = [0.2, 0.4], dwell_s = 0.5)
";

/// Without the variable: enough for a run.
const SHORT: Duration = Duration::from_secs(10);

/// Memory is compared with what it was after this time, in which buffers have got their size.
const WARM: Duration = Duration::from_mins(5);

/// More growth fails the test.
const GROWTH_MAX_KIB: u64 = 10 * 1024;

/// Looks at both counts of frames; at the least difference none is on its way.
const LOOKS: usize = 30;

/// What a subscriber has got.
#[derive(Debug, Clone, Copy, Default)]
struct Got {
    first_seq: u64,
    last_seq: u64,
    frames: u64,
    lost_before: u64,
    /// Least of arrival - device time since the last sample, in ns, by the service's clock; `None` before a frame.
    offset_ns: Option<i64>,
    /// The same of the first sample.
    first_offset_ns: Option<i64>,
}

/// A line of the table.
#[derive(Debug, Clone, Copy)]
struct Sample {
    /// The service's own memory, without the pages of its program's file, which come as they are used.
    anonymous_kib: u64,
    sent: u64,
    received: u64,
    lost: u64,
    got: Got,
    runs: u64,
}

#[test]
fn memory_frames_and_clock_hold_as_long_as_the_service_runs() {
    let hours: Option<f64> = number("TACTUS_SOAK_HOURS");
    let whole = hours.map_or(SHORT, |hours| Duration::from_secs_f64(hours * 3600.0));
    let period = (whole / 12).clamp(Duration::from_secs(1), Duration::from_mins(5));
    let rig = fs::read_to_string(repository("config/rigs/pty.toml")).unwrap();
    let mut bench = Bench::start(Options { rig, start: Process::start_as_unit, ..Options::default() });
    let got = Arc::new(Mutex::new(Got::default()));
    let mut frames = bench.subscribe::<pb::Frame>();
    bench.runtime.spawn({
        let got = Arc::clone(&got);
        async move {
            while let Some(frame) = frames.recv().await {
                got.lock().unwrap().take(&frame);
            }
        }
    });

    println!(
        "{:>8}{:>14}{:>10}{:>10}{:>8}{:>12}{:>10}{:>10}{:>8}",
        "minutes", "memory KiB", "sent", "received", "lost", "subscriber", "missing", "drift ms", "runs"
    );
    let unseen = unseen(&mut bench);
    let begin = Instant::now();
    let (mut runs, mut resets) = (0, 0_u64);
    let first = sample(&mut bench, &got, runs);
    // The clocks are compared from the next sample on: this one has seen a few frames only.
    got.lock().unwrap().first_offset_ns = None;
    let (mut warm, mut next) = (first, begin + period);
    let last = loop {
        let now = Instant::now();
        if now >= next || now >= begin + whole {
            let sample = sample(&mut bench, &got, runs);
            sample.print(begin.elapsed(), &first);
            if begin.elapsed() < WARM + period / 2 {
                warm = sample;
            }
            next += period;
            if now >= begin + whole {
                break sample;
            }
        }
        if !is_running(&bench) {
            // A machine without time for the service's frames makes the supervisor stop: then it is reset, and tried again.
            if bench.try_run(PRESSES).ok {
                runs += 1;
                forget_old_runs(&bench);
            } else if bench.command(Command::Reset).ok {
                resets += 1;
            }
        }
        bench.stage.watch((now + Duration::from_secs(1)).min(begin + whole), |_, _| {});
    };
    assert_eq!(self::unseen(&mut bench), unseen, "frames that were sent and not received");
    assert_eq!((last.lost - first.lost, last.got.missing()), (0, 0), "{last:?}");
    let reply = bench.until("an answer", |_| true);
    let health = reply.health.unwrap();
    println!(
        "clock: the service tells an uncertainty of {:.1} ms; {resets} resets; grown by {} KiB since minute {:.0}",
        health.clock_uncertainty_s.unwrap_or_default() * 1e3,
        last.anonymous_kib.saturating_sub(warm.anonymous_kib),
        WARM.min(whole).as_secs_f64() / 60.0,
    );
    // What the clocks drift apart, the service tells as uncertainty.
    let drift_s = last.drift_ms().abs() * 1e-3;
    assert!(drift_s <= health.clock_uncertainty_s.unwrap() + 1e-3, "{drift_s} s of drift; {health:?}");
    if hours.is_some() {
        let grown = last.anonymous_kib.saturating_sub(warm.anonymous_kib);
        assert!(grown < GROWTH_MAX_KIB, "{grown} KiB more than after {WARM:?}");
    }
}

impl Got {
    fn take(&mut self, frame: &pb::Frame) {
        let received_ns = frame.t_mono_ns;
        let offset_ns = received_ns - i64::try_from(frame.device_tick.unwrap_or(0)).unwrap() * 1_000_000;
        if self.frames == 0 {
            self.first_seq = frame.seq;
        }
        self.last_seq = frame.seq;
        self.frames += 1;
        self.lost_before += u64::from(frame.lost_before);
        self.offset_ns = Some(self.offset_ns.map_or(offset_ns, |least| least.min(offset_ns)));
    }

    /// Frames that the sensor took and the subscriber never got.
    fn missing(&self) -> u64 {
        (self.last_seq + 1 - self.first_seq) - self.frames
    }
}

impl Sample {
    /// NaN if no frame came since the sample before.
    fn drift_ms(&self) -> f64 {
        let Got { offset_ns: Some(offset_ns), first_offset_ns: Some(first_offset_ns), .. } = self.got else {
            return f64::NAN;
        };
        (offset_ns - first_offset_ns) as f64 * 1e-6
    }

    fn print(&self, elapsed: Duration, first: &Self) {
        println!(
            "{:>8.1}{:>14}{:>10}{:>10}{:>8}{:>12}{:>10}{:>10.1}{:>8}",
            elapsed.as_secs_f64() / 60.0,
            self.anonymous_kib,
            self.sent - first.sent,
            self.received - first.received,
            self.lost - first.lost,
            self.got.frames,
            self.got.missing(),
            self.drift_ms(),
            self.runs,
        );
    }
}

fn sample(bench: &mut Bench, got: &Mutex<Got>, runs: u64) -> Sample {
    let status = fs::read_to_string(format!("/proc/{}/status", bench.daemon().id())).unwrap();
    let anonymous = status.lines().find_map(|line| line.strip_prefix("RssAnon:")).unwrap();
    let reply = bench.until("an answer", |_| true);
    let sent = bench.sent().frames;
    let health = reply.health.unwrap();
    let got = {
        let mut got = got.lock().unwrap();
        got.first_offset_ns = got.first_offset_ns.or(got.offset_ns);
        let now = *got;
        // The next sample has the least of its own time.
        got.offset_ns = None;
        now
    };
    Sample {
        anonymous_kib: anonymous.trim().trim_end_matches(" kB").parse().unwrap(),
        sent,
        received: health.frames,
        lost: health.frames_lost,
        got,
        runs,
    }
}

/// Frames that the sensor sent and the service did not receive.
fn unseen(bench: &mut Bench) -> i64 {
    let look = |_| {
        let health = bench.until("an answer", |_| true).health.unwrap();
        // After the answer: what is on its way makes the difference greater, never less.
        i64::try_from(bench.sent().frames).unwrap() - i64::try_from(health.frames).unwrap()
    };
    (0..LOOKS).map(look).min().unwrap()
}

fn is_running(bench: &Bench) -> bool {
    let state = bench.until("an answer", |_| true).state.unwrap();
    !matches!(state.phase(), pb::RunPhase::Idle | pb::RunPhase::Finished)
}

/// A day of recordings does not fit into every machine's temporary folder.
fn forget_old_runs(bench: &Bench) {
    let folder = bench.folder.path().join("runs");
    let mut runs: Vec<_> = fs::read_dir(folder).unwrap().map(|run| run.unwrap().path()).collect();
    runs.sort();
    for run in runs.iter().rev().skip(20) {
        fs::remove_dir_all(run).unwrap();
    }
}
