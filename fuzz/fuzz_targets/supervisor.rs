//! Any sequence of frames, stage reports, times and orders, with sane and insane numbers, at a safety supervisor. Whatever came before,
//! a permit that does not surely lead up is given only within the limits, with fresh frames and zeros, and never between a violation and
//! the next reset; a broken rule leaves a fault; and a permit ends with its time and with any stop.
//!
//! With `TACTUS_TOLD=1` the sequence is printed.
#![no_main]

use std::sync::LazyLock;
use std::time::Duration;

use libfuzzer_sys::arbitrary::{Result, Unstructured};
use libfuzzer_sys::fuzz_target;
use tactus_model::Covering;
use tactus_safety::{
    Fault, HomingPermit, Permit, SAME_HEIGHT_MM, STEP_DOWN_MAX_MM, Supervisor, Target, Violation, Void,
};
use tactus_schema::pb::{StageState, StageStatus};
use tactus_schema::rig::Service;
use tactus_schema::{Frame, FrameFlags, MonoTime, Rig, TimeStamp, WallTime};

/// Operations of one sequence.
const OPERATIONS_MAX: usize = 400;

/// Permits that are kept to be checked later.
const PERMITS_MAX: usize = 16;

/// Rounding of sums of lengths.
const ROUNDING_MM: f64 = 1e-6;

static IS_TOLD: LazyLock<bool> = LazyLock::new(|| std::env::var_os("TACTUS_TOLD").is_some());

static RIG: LazyLock<Rig> =
    LazyLock::new(|| Rig::from_toml(include_str!("../../config/rigs/sim.toml")).expect("a shipped rig"));

fuzz_target!(|input: &[u8]| {
    let mut choices = Unstructured::new(input);
    let service = RIG.service.clone().expect("a rig with a service");
    let Ok(kind) = choices.arbitrary::<u8>() else { return };
    let mut play = Play::new(kind, &service);
    // A sequence ends with the input.
    for _ in 0..OPERATIONS_MAX {
        if choices.is_empty() || play.operation(&mut choices).is_err() {
            return;
        }
    }
});

/// Why the way down is shut, as the sequence so far demands it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Shut {
    /// It is not.
    No,
    /// A reset has begun and has not ended well.
    Resetting,
    /// No reset has begun since the start, a broken rule, or a fault.
    Latched,
}

/// A permit, and what may void it.
struct Given {
    permit: Leave,
    at: MonoTime,
    /// Stops before it.
    stops: u32,
    expires: bool,
}

enum Leave {
    Move(Permit),
    Homing(HomingPermit),
}

/// The supervisor, and what is known of its past.
struct Play {
    supervisor: Supervisor,
    service: Service,
    has_sensor: bool,
    now: MonoTime,
    report: Option<StageState>,
    /// The last height that the stage told.
    z_mm: Option<f64>,
    z_at_frame_mm: Option<f64>,
    frame: Option<MonoTime>,
    /// For each element of the last frame, when it was last read.
    read: Vec<Option<MonoTime>>,
    excused: Option<MonoTime>,
    depth_max_mm: f64,
    has_zero: bool,
    is_active: bool,
    shut: Shut,
    /// A silence of the sensor was told, and neither forgiven nor followed by worse.
    is_silent: bool,
    /// The stage was lost and is back, and no reset has begun since.
    was_away: bool,
    stops: u32,
    given: Vec<Given>,
}

impl Play {
    /// Bit 0: without a sensor. Bit 1: right after the start. Else a run is in progress, the tip up, and zeros are taken.
    fn new(kind: u8, service: &Service) -> Self {
        let has_sensor = kind & 1 == 0;
        let supervisor = if has_sensor {
            Supervisor::new(&RIG, service)
        } else {
            Supervisor::without_sensor(&RIG, service)
        };
        let mut play = Self {
            supervisor,
            service: service.clone(),
            has_sensor,
            now: MonoTime::from_ns(1_000_000_000),
            report: None,
            z_mm: None,
            z_at_frame_mm: None,
            frame: None,
            read: Vec::new(),
            excused: None,
            depth_max_mm: service.envelope.depth_max_mm(RIG.covering),
            has_zero: false,
            is_active: !has_sensor,
            shut: if has_sensor { Shut::Latched } else { Shut::No },
            is_silent: false,
            was_away: false,
            stops: 0,
            given: Vec::new(),
        };
        if kind & 2 == 0 {
            play.on_report([30.0, 25.0, 2.0], StageStatus::Idle);
            play.on_frame(play.now, &[100.0; 48], &[]);
            play.begin_reset();
            play.finish_reset();
            play.begin_run();
            play.set_zero(&[100.0; 48], true);
        }
        play
    }

    fn operation(&mut self, choices: &mut Unstructured<'_>) -> Result<()> {
        match choices.int_in_range(0..=31)? {
            0..=5 => {
                let received = if choices.ratio(7, 8)? { self.now } else { time(choices)? };
                let (counts, bad) = reading(choices)?;
                self.on_frame(received, &counts, &bad);
            }
            6..=11 => {
                let position_mm = position(choices, self.report)?;
                let status = if choices.ratio(3, 4)? { 3 } else { choices.int_in_range(-1..=8)? };
                self.on_report(position_mm, StageStatus::try_from(status).unwrap_or_default());
            }
            12..=14 => {
                let pause = Duration::from_millis(choices.arbitrary::<u8>()?.into());
                self.now = self.now.after(pause);
                self.on_time();
            }
            15 => {
                self.now = self.now.max(time(choices)?);
                self.on_time();
            }
            16..=21 => {
                let position_mm = position(choices, self.report)?;
                let speed_mm_per_s = *choices.choose(&[1.0, 5.0, 20.0, 50.0, 51.0, 0.0, -1.0, f64::NAN])?;
                self.permit(Target { position_mm, speed_mm_per_s });
            }
            22 => self.permit_homing(),
            23 => self.check_permits(),
            24 => {
                self.tell(|| "connected".into());
                let violation = self.supervisor.on_connected();
                self.has_zero = false;
                self.stops += 1;
                self.told(violation.as_ref());
            }
            25 => match choices.int_in_range(0..=3)? {
                0 => self.begin_run(),
                1 => {
                    self.tell(|| "end".into());
                    self.supervisor.end();
                    self.is_active = false;
                    self.stops += 1;
                }
                2 => {
                    self.tell(|| "rest".into());
                    self.supervisor.rest();
                    self.is_active = false;
                    self.stops += 1;
                }
                _ => {
                    self.tell(|| "revoke".into());
                    self.supervisor.revocation().revoke();
                    self.stops += 1;
                }
            },
            26 => self.begin_reset(),
            27 => self.finish_reset(),
            28 => {
                let (counts, _) = reading(choices)?;
                let counts: Vec<_> = counts.into_iter().map(f64::from).collect();
                self.set_zero(&counts, choices.arbitrary()?);
            }
            29 => {
                let fault = if choices.arbitrary()? {
                    Fault::Defect("any".into())
                } else {
                    Fault::NotRetracted("any".into())
                };
                self.tell(|| format!("latch {fault:?}"));
                self.supervisor.latch(fault);
                self.latched();
            }
            30 => {
                self.tell(|| "forgive_silence".into());
                self.supervisor.forgive_silence(self.now);
                self.is_silent = false;
                self.excused = Some(self.now);
            }
            _ => {
                let thickness_mm =
                    *choices.choose(&[1.016, 2.54, 5.08, 20.0, 0.0, -1.0, f64::NAN, f64::INFINITY])?;
                let covering = Covering { thickness_mm };
                self.tell(|| format!("set_covering {thickness_mm}"));
                self.supervisor.set_covering(covering);
                self.depth_max_mm = self.service.envelope.depth_max_mm(covering);
            }
        }
        Ok(())
    }

    fn tell(&self, what: impl FnOnce() -> String) {
        if *IS_TOLD {
            eprintln!("{:.3} s: {}; fault {:?}", self.now.seconds(), what(), self.supervisor.fault());
        }
    }

    // --- what happens -------------------------------------------------------------------------------------------------

    fn on_frame(&mut self, received: MonoTime, counts: &[f32], bad: &[u32]) {
        self.tell(|| format!("frame received {received:?}, not read {bad:?}: {counts:?}"));
        let frame = Frame {
            seq: 0,
            epoch: 0,
            device_tick: None,
            received: TimeStamp { mono: received, wall: WallTime::default() },
            counts: counts.into(),
            flags: FrameFlags::default(),
            lost_before: 0,
            simulated: true,
            bad_elements: bad.into(),
            temperature_c: None,
        };
        let violation = self.supervisor.on_frame(&frame);
        let is_read = |element: usize| !bad.iter().any(|bad| *bad as usize == element);
        let unwatched = &self.service.envelope.unwatched_elements;
        // A frame that reads no watched element shows no load: it is none.
        if (0..counts.len()).any(|e| counts[e].is_finite() && is_read(e) && !unwatched.contains(&e)) {
            self.frame = Some(received);
        }
        self.read.resize(counts.len(), None);
        for element in (0..counts.len()).filter(|e| counts[*e].is_finite() && is_read(*e)) {
            self.read[element] = Some(received);
        }
        self.z_at_frame_mm = self.z_mm;
        self.told(violation.as_ref());
        // Without a zero each element is held against the rig file's baseline.
        let envelope = &self.service.envelope;
        let limit_counts = envelope.element_max_counts + envelope.baseline_band_counts;
        let mut pairs = counts.iter().zip(&RIG.baseline_counts).enumerate();
        let is_loaded = pairs.any(|(element, (counts, baseline_counts))| {
            let is_read = counts.is_finite() && !bad.iter().any(|bad| *bad as usize == element);
            is_read && f64::from(*counts) - baseline_counts > limit_counts
        });
        if is_loaded && self.is_active && !self.has_zero {
            assert!(self.supervisor.fault().is_some(), "an overload leaves a fault");
        }
    }

    fn on_report(&mut self, [x_mm, y_mm, z_mm]: [f64; 3], status: StageStatus) {
        self.tell(|| format!("report {:?} {status:?}", [x_mm, y_mm, z_mm]));
        let t_mono_ns = self.now.ns();
        let report = StageState { x_mm, y_mm, z_mm, t_mono_ns, status: status.into(), ..Default::default() };
        let stood_mm = self.report.as_ref().and_then(standing_mm);
        let was_lost =
            self.report.as_ref().is_some_and(|report| report.status() == StageStatus::Disconnected);
        if was_lost && status != StageStatus::Disconnected && self.z_mm.is_some() {
            self.was_away = true;
            self.stops += 1;
        }
        let violation = self.supervisor.on_report(&report);
        if stood_mm.is_some_and(|stood_mm| !self.stands_at(&report, stood_mm)) {
            self.stops += 1;
        }
        self.report = Some(report);
        self.told(violation.as_ref());
        let is_placed = [x_mm, y_mm, z_mm].iter().all(|mm| mm.is_finite())
            && matches!(
                status,
                StageStatus::Idle | StageStatus::Moving | StageStatus::Hold | StageStatus::Alarm
            );
        if is_placed {
            self.z_mm = Some(z_mm);
            if -z_mm > self.depth_max_mm + self.service.motion.tolerance_mm {
                assert!(self.supervisor.fault().is_some(), "{z_mm} mm is too deep and leaves a fault");
            }
        }
    }

    /// True if the stage stands within tolerance of a place.
    fn stands_at(&self, report: &StageState, [x_mm, y_mm, z_mm]: [f64; 3]) -> bool {
        standing_mm(report).is_some_and(|[here_x_mm, here_y_mm, here_z_mm]| {
            let away_mm = (here_x_mm - x_mm).hypot(here_y_mm - y_mm).hypot(here_z_mm - z_mm);
            away_mm <= self.service.motion.tolerance_mm
        })
    }

    fn on_time(&mut self) {
        self.tell(|| "time".into());
        let violation = self.supervisor.on_time(self.now);
        self.told(violation.as_ref());
        let is_near = self.z_mm.is_some_and(|z_mm| z_mm < self.service.motion.approach_height_mm);
        let silent_s = seconds_since(self.now, self.frame.max(self.excused));
        if self.has_sensor && is_near && silent_s > self.silence_max_s() {
            assert!(self.supervisor.fault().is_some(), "a silence of {silent_s} s leaves a fault");
        }
    }

    /// Keeps what a violation demands.
    fn told(&mut self, violation: Option<&Violation>) {
        let Some(violation) = violation else { return };
        self.tell(|| format!("-> {violation}"));
        assert!(!violation.to_string().is_empty() && !violation.rule().is_empty());
        if violation.is_silence() {
            self.is_silent = true;
            self.stops += 1;
        } else {
            self.latched();
        }
        assert!(self.supervisor.fault().is_some(), "{violation}: a broken rule leaves a fault");
        self.check_permits();
    }

    fn latched(&mut self) {
        self.shut = Shut::Latched;
        self.is_silent = false;
        self.stops += 1;
    }

    // --- orders -------------------------------------------------------------------------------------------------------

    fn begin_run(&mut self) {
        self.tell(|| "begin_run".into());
        self.supervisor.begin_run();
        self.has_zero = false;
        self.is_active = true;
    }

    fn begin_reset(&mut self) {
        self.tell(|| "begin_reset".into());
        self.supervisor.begin_reset(self.now);
        self.shut = Shut::Resetting;
        self.is_silent = false;
        self.was_away = false;
        self.has_zero = false;
        self.is_active = true;
        self.excused = Some(self.now);
    }

    fn finish_reset(&mut self) {
        let finished = self.supervisor.finish_reset(self.now);
        self.tell(|| format!("finish_reset -> {finished:?}"));
        if finished.is_ok() {
            assert!(self.shut != Shut::Latched && !self.is_silent, "a reset ends only what it began with");
            assert!(!self.was_away, "a reset does not end with a stage that was away since it began");
            assert!(self.is_fresh(), "a reset ends with frames");
            assert_eq!(self.report.map(|report| report.status()), Some(StageStatus::Idle));
            self.shut = Shut::No;
        }
    }

    fn set_zero(&mut self, counts: &[f64], is_reference: bool) {
        let set = if is_reference {
            self.supervisor.set_reference(counts)
        } else {
            self.supervisor.set_tare(counts)
        };
        self.tell(|| format!("zero, reference {is_reference}: {counts:?} -> {set:?}"));
        if set.is_err() {
            return;
        }
        let envelope = &self.service.envelope;
        for (element, (counts, baseline_counts)) in counts.iter().zip(&RIG.baseline_counts).enumerate() {
            let away_counts = (counts - baseline_counts).abs();
            // An element that was not read has no zero, and its number says nothing.
            let is_zero = away_counts <= envelope.baseline_band_counts || !counts.is_finite();
            assert!(is_zero || self.is_silent_element(element), "{counts} counts are no zero");
        }
        self.has_zero |= is_reference && counts.iter().any(|counts| counts.is_finite());
    }

    // --- permits ------------------------------------------------------------------------------------------------------

    fn permit(&mut self, to: Target) {
        let permit = self.supervisor.permit(to, self.now);
        self.tell(|| format!("permit {to:?} -> {:?}", permit.as_ref().map(drop)));
        let Ok(permit) = permit else { return };
        assert_eq!(permit.target(), to);
        let report = self.report.expect("a permit needs a report");
        assert_eq!(report.status(), StageStatus::Idle, "a permit needs a stage that stands");
        let from_mm = [report.x_mm, report.y_mm, report.z_mm];
        let is_up = self.leads_up(from_mm, to);
        if !is_up {
            self.check_way(from_mm, to);
        }
        assert!(to.speed_mm_per_s > 0.0 && to.speed_mm_per_s <= self.service.envelope.speed_max_mm_per_s);
        self.keep(Leave::Move(permit), !is_up);
    }

    /// True if a move surely leads straight up. Numbers that are no numbers lead nowhere surely.
    fn leads_up(&self, [from_x_mm, from_y_mm, from_z_mm]: [f64; 3], to: Target) -> bool {
        let [x_mm, y_mm, z_mm] = to.position_mm;
        let aside_mm = (x_mm - from_x_mm).hypot(y_mm - from_y_mm);
        aside_mm <= self.service.motion.tolerance_mm && z_mm >= from_z_mm - SAME_HEIGHT_MM - ROUNDING_MM
    }

    /// What must hold of a way that does not surely lead up.
    fn check_way(&self, from_mm: [f64; 3], to: Target) {
        let (envelope, motion) = (&self.service.envelope, &self.service.motion);
        let [x_mm, y_mm, z_mm] = to.position_mm;
        assert_eq!(self.shut, Shut::No, "{from_mm:?} to {to:?}: {:?}", self.supervisor.fault());
        assert!(!self.is_silent, "{from_mm:?} to {to:?}: the sensor was silent");
        assert!(!self.was_away, "{from_mm:?} to {to:?}: the stage was away");
        let depth_max_mm = self.depth_max_mm.min(envelope.depth_max_mm) + SAME_HEIGHT_MM + ROUNDING_MM;
        assert!(-z_mm <= depth_max_mm, "{to:?} is too deep: {depth_max_mm} mm");
        assert!(z_mm <= envelope.z_max_mm + ROUNDING_MM);
        if self.has_sensor {
            for (mm, [least_mm, most_mm]) in [(x_mm, envelope.x_mm), (y_mm, envelope.y_mm)] {
                assert!(mm >= least_mm - ROUNDING_MM && mm <= most_mm + ROUNDING_MM, "{to:?} is outside");
            }
            assert!(self.is_fresh(), "{to:?} without a fresh frame");
        } else {
            let is_high = z_mm >= motion.safe_height_mm - motion.tolerance_mm - ROUNDING_MM;
            assert!(is_high || self.is_fresh(), "{to:?} without a sensor");
        }
        if z_mm < motion.approach_height_mm - SAME_HEIGHT_MM {
            assert!(self.has_zero, "{to:?} without a zero");
            let step_mm = from_mm[2] - z_mm;
            assert!(
                step_mm <= STEP_DOWN_MAX_MM + 2.0 * ROUNDING_MM,
                "{from_mm:?} to {to:?} is no small step"
            );
            let seen_mm = self.z_at_frame_mm.map_or(f64::NAN, |z_mm| z_mm.min(motion.approach_height_mm));
            let unseen_mm = seen_mm - z_mm;
            let most_mm = 2.0 * STEP_DOWN_MAX_MM + motion.tolerance_mm + ROUNDING_MM;
            assert!(unseen_mm <= most_mm, "{to:?} is {unseen_mm} mm below what the last frame has shown");
        }
        let aside_mm = (x_mm - from_mm[0]).hypot(y_mm - from_mm[1]);
        let lowest_mm = motion.approach_height_mm - motion.tolerance_mm - ROUNDING_MM;
        assert!(
            aside_mm <= motion.tolerance_mm || (z_mm >= lowest_mm && from_mm[2] >= lowest_mm),
            "{from_mm:?} to {to:?} leads sideways in the covering"
        );
    }

    fn permit_homing(&mut self) {
        let permit = self.supervisor.permit_homing(self.now);
        self.tell(|| format!("permit_homing -> {:?}", permit.as_ref().map(drop)));
        let Ok(permit) = permit else { return };
        assert!(self.shut != Shut::Latched && !self.is_silent, "homing: {:?}", self.supervisor.fault());
        assert!(!self.has_sensor || self.is_fresh(), "homing without frames");
        self.keep(Leave::Homing(permit), true);
    }

    /// A permit voids those before it.
    fn keep(&mut self, permit: Leave, expires: bool) {
        self.stops += 1;
        if self.given.len() == PERMITS_MAX {
            self.given.remove(0);
        }
        self.given.push(Given { permit, at: self.now, stops: self.stops, expires });
        self.check_permits();
    }

    fn check_permits(&mut self) {
        for Given { permit, at, stops, expires } in &self.given {
            let checked = match permit {
                Leave::Move(permit) => permit.check(self.now),
                Leave::Homing(permit) => permit.check(self.now),
            };
            let is_old = self.now.since(*at).as_secs_f64() > (1.0 / RIG.array.rate_hz()).max(0.03) + 1e-6;
            let expected = if *stops != self.stops {
                Err(Void::Revoked)
            } else if *expires && is_old {
                Err(Void::Expired)
            } else if *expires && self.now != *at {
                // Somewhere on the way to its end.
                continue;
            } else {
                Ok(())
            };
            assert_eq!(checked, expected, "a permit after {:?}", self.now.since(*at));
        }
    }

    // --- limits -------------------------------------------------------------------------------------------------------

    fn is_fresh(&self) -> bool {
        seconds_since(self.now, self.frame) <= self.silence_max_s()
    }

    /// True if frames have come for long without this element.
    fn is_silent_element(&self, element: usize) -> bool {
        let last_frame = self.frame.unwrap_or_default();
        self.read.get(element).is_some_and(|read| seconds_since(last_frame, *read) > self.silence_max_s())
    }

    fn silence_max_s(&self) -> f64 {
        (3.0 / RIG.array.rate_hz()).max(0.03)
    }
}

/// Where the stage stands, if it stands somewhere.
fn standing_mm(report: &StageState) -> Option<[f64; 3]> {
    let place_mm = [report.x_mm, report.y_mm, report.z_mm];
    (report.status() == StageStatus::Idle && place_mm.iter().all(|mm| mm.is_finite())).then_some(place_mm)
}

fn seconds_since(now: MonoTime, last: Option<MonoTime>) -> f64 {
    last.map_or(f64::INFINITY, |last| now.since(last).as_secs_f64())
}

// --- numbers ----------------------------------------------------------------------------------------------------------

fn time(choices: &mut Unstructured<'_>) -> Result<MonoTime> {
    Ok(MonoTime::from_ns(choices.arbitrary()?))
}

/// A place within the rig, near the last one, or nowhere.
fn position(choices: &mut Unstructured<'_>, last: Option<StageState>) -> Result<[f64; 3]> {
    let last_mm = last.map_or([30.0, 25.0, 2.0], |last| [last.x_mm, last.y_mm, last.z_mm]);
    let mut position_mm = [0.0; 3];
    for (mm, last_mm) in position_mm.iter_mut().zip(last_mm) {
        *mm = match choices.int_in_range(0..=7)? {
            0 => insane(choices)?,
            1 => f64::from(choices.arbitrary::<i16>()?) * 0.001,
            2 | 3 => last_mm + f64::from(choices.arbitrary::<i8>()?) * 0.001,
            4 => last_mm - 0.1,
            _ => last_mm,
        };
    }
    Ok(position_mm)
}

fn insane(choices: &mut Unstructured<'_>) -> Result<f64> {
    if choices.arbitrary()? {
        let odd = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -0.0, f64::MAX, f64::MIN, f64::MIN_POSITIVE];
        return Ok(*choices.choose(&odd)?);
    }
    choices.arbitrary()
}

/// Counts of a frame with the elements that were not read: mostly of all elements at rest, with a few that stand out.
fn reading(choices: &mut Unstructured<'_>) -> Result<(Vec<f32>, Vec<u32>)> {
    let elements = if choices.ratio(7, 8)? { 48 } else { choices.int_in_range(0..=60)? };
    let rest = if choices.ratio(7, 8)? { 100.0 } else { f32::from(choices.arbitrary::<i16>()?) };
    let mut counts = vec![rest; elements];
    for _ in 0..choices.int_in_range(0..=3)? {
        let element = choices.int_in_range(0..=59)?;
        let value = if choices.ratio(3, 4)? {
            f32::from(choices.arbitrary::<i16>()?)
        } else {
            choices.arbitrary()?
        };
        if let Some(counts) = counts.get_mut(element) {
            *counts = value;
        }
    }
    let mut bad = Vec::new();
    for _ in 0..choices.int_in_range(0..=2)? {
        bad.push(choices.int_in_range(0..=70)?);
    }
    Ok((counts, bad))
}
