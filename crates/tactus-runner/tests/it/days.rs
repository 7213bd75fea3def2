//! Days of acquisition in virtual time, at the rig's rate, with a run and some faults every hour: no frame is lost uncounted, no
//! number is wrong, and nothing grows.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]
#![expect(clippy::print_stdout, reason = "the figures are what `just simulated-days` is for")]

use std::fs;
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use tactus_device::{Clock, SensorCodec};
use tactus_engine::{Engine, Publish, Unrecorded};
use tactus_runner::{devices, embedded::Truth};
use tactus_schema::pb::{self, ExitStatus};
use tactus_schema::{Frame, FrameFlags, Rig};
use tactus_virtual::RigControl;
use tokio::time::{Instant, sleep_until};

use crate::order;

const SIM: &str = include_str!("../../../../config/rigs/sim.toml");

const DIGITACTS: &str = include_str!("../../../../config/links/digitacts.toml");

/// Days of one test; `TACTUS_DAYS` sets another number. So many are enough for a 32-bit clock of microseconds to wrap.
const DAYS: f64 = 0.06;

/// The process may grow by this much after the first day.
const GROWTH_MAX_MIB: f64 = 10.0;

const HOUR: Duration = Duration::from_hours(1);

/// In each hour, so many seconds after its start. The run is over by then.
const FAULTS: [(u64, &str); 6] = [
    (600, "sensor drop-frames 5"),
    (1200, "sensor stall 700ms"),
    (1800, "from-sensor flip-bits 3"),
    (2400, "sensor burst 4"),
    (3000, "sensor duplicate"),
    (3300, "stage stall 300ms"),
];

const SCRIPT: &str = "def run(rig):
    tare()
    for depth in [0.2, 0.5, 0.7]:
        press(8.1, 5.9, [depth], speed_mm_per_s = 1.0)
    wait(1.0)
";

/// A sensor whose clock drifts and wraps.
#[derive(Debug, Clone, Copy)]
struct Sensor {
    name: &'static str,
    drift_ppm: f64,
    /// Its clock wraps at 32 bits.
    tick_s: f64,
}

/// Losses are counted by the clock, which wraps after half an hour, because it is set so.
const BY_CLOCK: Sensor = Sensor { name: "weiss-dsa", drift_ppm: 50.0, tick_s: 1e-3 };

/// Losses are counted by the device's own count, which wraps every 8.5 s; the clock wraps every 71.6 min.
const BY_COUNT: Sensor = Sensor { name: "declared", drift_ppm: -50.0, tick_s: 1e-6 };

impl Sensor {
    fn codec(self) -> SensorCodec {
        if self.tick_s > 1e-4 {
            return SensorCodec::default();
        }
        let text = DIGITACTS.replace("tick_ns = 1_000_000", "tick_ns = 1_000");
        let raw: tactus_wire::declared::RawFormat = toml::from_str(&text).unwrap();
        SensorCodec::Declared { format: Arc::new(raw.check().unwrap()) }
    }
}

/// What has come.
#[derive(Debug, Clone, Copy, Default)]
struct Received {
    frames: u64,
    lost: u64,
    epochs: u64,
    next_seq: u64,
    /// Host's time of the last frame less the device's, s.
    offset_s: f64,
}

/// Keeps the books.
#[derive(Debug)]
struct Ledger {
    sensor: Sensor,
    received: Mutex<Received>,
}

impl Publish for Ledger {
    fn frame(&self, frame: &Frame) {
        let mut received = self.received.lock().unwrap();
        let lost = u64::from(frame.lost_before);
        assert_eq!(frame.seq, received.next_seq + lost, "{frame:?}");
        received.next_seq = frame.seq + 1;
        received.frames += 1;
        received.lost += lost;
        received.epochs += u64::from(frame.flags.contains(FrameFlags::NEW_EPOCH));
        let device_s = frame.device_tick.unwrap().0 as f64 * self.sensor.tick_s;
        received.offset_s = frame.received.mono.seconds() - device_s;
    }

    fn sensor_info(&self, _: &pb::SensorInfo) {}
    fn stage(&self, _: &pb::StageState) {}
    fn event(&self, _: &pb::RunEvent) {}
    fn state(&self, _: &pb::RunState) {}
    fn safety(&self, _: &pb::SafetyEvent) {}
}

async fn acquire(sensor: Sensor, days: f64) {
    let rig = Rig::from_toml(SIM).unwrap();
    let service = rig.service.clone().unwrap();
    let (clock, started) = (Clock::paused(), Instant::now());
    let opened = devices::open(&rig, &service, sensor.codec(), || Truth::of_rig(&rig, 1), clock);
    let control = opened.control.unwrap();
    let ledger = Arc::new(Ledger { sensor, received: Mutex::default() });
    let engine = Engine::start(rig, opened.devices, clock, Arc::clone(&ledger) as _).unwrap();
    inject(&control, &format!("sensor clock-drift {}", sensor.drift_ppm));
    if sensor.tick_s > 1e-4 {
        inject(&control, "sensor clock-jump -1800s");
    }
    engine.reset().await.unwrap();

    // Between two frames, so that none is under way.
    let at = |hour: u32, second: u64| started + HOUR * hour + Duration::from_millis(second * 1000 + 13);
    sleep_until(at(0, 60)).await;
    let (first, samplings, since) = (*ledger.received.lock().unwrap(), control.samplings(), Instant::now());
    let (mut settled_kib, mut lost) = (None, first.lost);
    let hours = (days * 24.0).ceil().max(1.0);
    for hour in 0.. {
        if f64::from(hour) >= hours {
            break;
        }
        sleep_until(at(hour, 61)).await;
        let order = order(&engine, format!("hour-{hour}"), SCRIPT);
        let outcome = engine.run(order, Box::new(Unrecorded)).await.unwrap();
        assert_eq!((outcome.exit_status, outcome.presses), (ExitStatus::Done, 3), "hour {hour}: {outcome:?}");
        for (second, line) in FAULTS {
            sleep_until(at(hour, second)).await;
            inject(&control, line);
        }
        sleep_until(at(hour, 3599)).await;
        let received = *ledger.received.lock().unwrap();
        check(&received, &engine, hour);
        // The device's clock drifts from the host's as it should, however often it has wrapped.
        let drifted_s = -sensor.drift_ppm * 1e-6 * since.elapsed().as_secs_f64();
        let told_s = received.offset_s - first.offset_s;
        assert!((told_s - drifted_s).abs() < 0.04, "hour {hour}: {told_s} s instead of {drifted_s} s");
        assert_eq!(received.next_seq - first.next_seq, control.samplings() - samplings, "hour {hour}");
        // Five frames were dropped, one was damaged, and a stall of 0.7 s takes 21.
        let lost_now = received.lost - lost;
        assert!((26..=28).contains(&lost_now), "hour {hour}: {lost_now} frames were lost");
        lost = received.lost;
        if (hour + 1) % 24 == 0 || f64::from(hour + 1) >= hours {
            let kib = resident_kib();
            let settled_kib = *settled_kib.get_or_insert(kib);
            println!(
                "{}: {:.2} days, {} frames, {} lost, {:.1} MiB, grown by {:.1} MiB since the first day",
                sensor.name,
                f64::from(hour + 1) / 24.0,
                received.frames,
                received.lost,
                kib / 1024.0,
                (kib - settled_kib) / 1024.0
            );
            assert!((kib - settled_kib) / 1024.0 < GROWTH_MAX_MIB, "{settled_kib} KiB, now {kib} KiB");
        }
    }
}

/// What holds at any time.
fn check(received: &Received, engine: &Engine, hour: u32) {
    assert_eq!(received.frames + received.lost, received.next_seq, "hour {hour}");
    let pulse = *engine.pulse().borrow();
    assert_eq!((pulse.frames, pulse.frames_lost), (received.frames, received.lost), "hour {hour}");
    let [least_s, greatest_s] = pulse.clock_offset_s.unwrap();
    assert!(greatest_s - least_s < 0.02, "hour {hour}: {least_s} s to {greatest_s} s");
    // The clock and its wraps are one epoch.
    assert_eq!(received.epochs, 1, "hour {hour}");
    assert!(pulse.sensor_connected && engine.is_acquiring() && engine.fault().is_none(), "hour {hour}");
}

fn inject(control: &RigControl, line: &str) {
    control.inject(line.parse().unwrap()).unwrap();
}

/// Resident memory of this process.
fn resident_kib() -> f64 {
    let status = fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).unwrap();
    line.trim().trim_end_matches(" kB").parse().unwrap()
}

#[test]
fn days_pass_without_an_uncounted_frame_a_wrong_number_or_growth() {
    let days = std::env::var("TACTUS_DAYS").ok().and_then(|days| days.parse().ok()).unwrap_or(DAYS);
    thread::scope(|scope| {
        for sensor in [BY_CLOCK, BY_COUNT] {
            scope.spawn(move || {
                let runtime =
                    tokio::runtime::Builder::new_current_thread().enable_time().start_paused(true).build();
                runtime.unwrap().block_on(acquire(sensor, days));
            });
        }
    });
}
