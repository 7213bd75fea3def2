//! What one damaged byte on the way to the stage can cost: each bit of each byte flipped, each byte lost, each byte doubled.
//! The session and the controller are the real ones, the tip is the true one, and time is kept by the test.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]
#![expect(clippy::print_stderr, reason = "the table is for people")]

use std::collections::BTreeMap;
use std::time::Duration;

use tactus_device::{SensorCodec, grbl_config, zaber_config};
use tactus_schema::Rig;
use tactus_schema::rig::StageProtocol;
use tactus_virtual::cable::Device;
use tactus_virtual::{RigControl, Truth, VirtualStage, start_devices};
use tactus_wire::stage::{Action, Session};
use tactus_wire::{grbl, zaber};
use tokio::time::Instant;

const SIM: &str = include_str!("../../../../config/rigs/sim.toml");

const ZABER: &str = "protocol = \"zaber-ascii\"
axes.x = { device = 1, axis = 1, um_per_microstep = 0.047625 }
axes.y = { device = 1, axis = 2, um_per_microstep = 0.047625 }
axes.z = { device = 2, axis = 1, um_per_microstep = 0.047625 }
";

/// The travel of a large stage, and that of one whose homing is short: it is made anew for each damage, and Zaber's is watched as
/// fast as the answers come.
const LARGE: &str = "travel_mm = [[0.0, 60.0], [0.0, 50.0], [-6.0, 30.0]]";
const SMALL: &str = "travel_mm = [[19.5, 20.5], [14.5, 15.5], [-1.0, 1.0]]";

const TOLERANCE_MM: f64 = 0.005;

/// Where the press is.
const AT_MM: [f64; 2] = [20.0, 15.0];

/// How long a stage moves unseen: the interval of reports in motion, and the latency of a report.
const UNSEEN_S: f64 = 0.020 + 0.005;

/// Deceleration of the virtual stage.
const ACCELERATION_MM_PER_S2: f64 = 500.0;

/// A move to a height at a speed.
type Leg = (f64, f64);

/// Down to 0.5 mm in steps of 0.1 mm, and up again.
const PRESS: [Leg; 9] = [
    (0.2, 1.0),
    (0.1, 1.0),
    (0.0, 1.0),
    (-0.1, 1.0),
    (-0.2, 1.0),
    (-0.3, 1.0),
    (-0.4, 1.0),
    (-0.5, 1.0),
    (2.0, 20.0),
];

/// One step down, and up again.
const SHORT_PRESS: [Leg; 2] = [(0.0, 1.0), (0.2, 20.0)];

/// From the safe height down to the approach height, at the rig file's travel speed and at its greatest load speed.
const APPROACH: [Leg; 1] = [(0.3, 20.0)];
const SLOW_APPROACH: [Leg; 1] = [(0.3, 5.0)];

#[derive(Debug, Clone, Copy, PartialEq)]
enum Damage {
    Flip { bit: u32 },
    Drop,
    Double,
}

/// What came of one damage.
#[derive(Debug, Clone, Copy, Default)]
#[expect(clippy::struct_field_names, reason = "the unit is the last word")]
struct Cost {
    /// Deeper than the deepest order.
    over_mm: f64,
    /// Sideways while the tip was in the covering.
    drag_mm: f64,
    /// Off the place anywhere.
    aside_mm: f64,
}

struct Lab<S> {
    session: S,
    stage: VirtualStage,
    control: RigControl,
    started: Instant,
    now: Instant,
    /// Bytes sent since the damage was armed, and which one is damaged, how.
    sent: usize,
    damage: Option<(usize, Damage)>,
    counts: bool,
    result: Option<bool>,
    cost: Cost,
}

impl<S: Session> Lab<S> {
    fn new(lines: &str, travel: &str, begin: impl Fn(&StageProtocol) -> S) -> Self {
        assert!(SIM.contains(LARGE));
        let toml = SIM.replace("protocol = \"grbl\"\n", lines).replace(LARGE, travel);
        let rig = Rig::from_toml(&toml).unwrap();
        let protocol = rig.service.as_ref().unwrap().stage.protocol.clone();
        let now = Instant::now();
        let codec = SensorCodec::default();
        let started = start_devices(Truth::of_rig(&rig, 1), rig.covering, &codec, now);
        let (sent, damage, counts, result, cost) = (0, None, false, None, Cost::default());
        let session = begin(&protocol);
        let (stage, control) = (started.stage, started.control);
        Self { session, stage, control, started: now, now, sent, damage, counts, result, cost }
    }

    fn elapsed(&self) -> Duration {
        self.now - self.started
    }

    fn act(&mut self, actions: Vec<Action<S::Error>>) {
        for action in actions {
            match action {
                Action::Send(bytes) | Action::Move(bytes) => {
                    let bytes = self.damaged(bytes);
                    self.stage.receive(&bytes, self.now);
                }
                Action::Done(result) => self.result = Some(result.is_ok()),
                Action::Failed(_) => self.result = Some(false),
                Action::Connected(_) | Action::Report(_) | Action::Suspect { .. } => {}
            }
        }
    }

    fn damaged(&mut self, bytes: Vec<u8>) -> Vec<u8> {
        // Zaber's devices are asked for their position all the time.
        if !self.counts || String::from_utf8_lossy(&bytes).contains("get pos") {
            return bytes;
        }
        let first = self.sent;
        self.sent += bytes.len();
        let Some((at, damage)) = self.damage.filter(|(at, _)| (first..self.sent).contains(at)) else {
            return bytes;
        };
        let mut bytes = bytes;
        let at = at - first;
        match damage {
            Damage::Flip { bit } => bytes[at] ^= 1 << bit,
            Damage::Drop => drop(bytes.remove(at)),
            Damage::Double => bytes.insert(at, bytes[at]),
        }
        bytes
    }

    /// Lets time pass until the command has ended, at most so long.
    fn run(&mut self, longest: Duration) {
        let until = self.now + longest;
        while self.result.is_none() {
            self.stage.wake(self.now);
            let bytes = self.stage.output(self.now);
            if !bytes.is_empty() {
                let now = self.elapsed();
                let actions = self.session.receive(now, &bytes);
                self.act(actions);
                continue;
            }
            self.watch();
            let timer = self.session.deadline().map(|due| self.started + due);
            let Some(next) = self.stage.next_wake().into_iter().chain(timer).min() else { break };
            if next > until {
                break;
            }
            self.now = self.now.max(next);
            if timer.is_some_and(|timer| timer <= self.now) {
                let now = self.elapsed();
                let actions = self.session.timer(now);
                self.act(actions);
            }
        }
        if self.result.is_none() {
            self.now = until;
        }
    }

    /// Notes how far the tip is aside.
    fn watch(&mut self) {
        if self.counts {
            let [x, y, z] = self.control.tip_at_mm(self.now);
            let aside_mm = (x - AT_MM[0]).hypot(y - AT_MM[1]);
            self.cost.aside_mm = self.cost.aside_mm.max(aside_mm);
            if z < 0.0 {
                self.cost.drag_mm = self.cost.drag_mm.max(aside_mm);
            }
        }
    }

    fn command(&mut self, begin: impl Fn(&mut S, Duration) -> Vec<Action<S::Error>>) -> bool {
        self.result = None;
        let now = self.elapsed();
        let actions = begin(&mut self.session, now);
        self.act(actions);
        self.run(Duration::from_secs(30));
        self.result == Some(true)
    }

    fn go(&mut self, z_mm: f64, speed_mm_per_s: f64) -> bool {
        let target_mm = [AT_MM[0], AT_MM[1], z_mm];
        self.command(|session, now| session.move_to(now, target_mm, speed_mm_per_s))
    }

    /// Connects, homes and stands above the place.
    fn prepare(&mut self, z_mm: f64) {
        let now = self.elapsed();
        let actions = self.session.start(now);
        self.act(actions);
        self.run(Duration::from_secs(2));
        assert!(self.command(S::home), "homing");
        assert!(self.go(z_mm, 20.0), "the way there");
    }

    /// Makes the legs until one fails, and sees what follows within two seconds. Gives the cost, and whether all were done.
    fn play(mut self, from_mm: f64, legs: &[Leg], damage: Option<(usize, Damage)>) -> (Self, bool) {
        self.prepare(from_mm);
        (self.counts, self.damage) = (true, damage);
        let done = legs.iter().all(|(z_mm, speed)| self.go(*z_mm, *speed));
        let deepest_mm = legs.iter().map(|(z_mm, _)| -z_mm).fold(-from_mm, f64::max);
        self.result = None;
        self.run(Duration::from_secs(2));
        self.cost.over_mm = self.control.deepest_by_mm(self.now) - deepest_mm;
        (self, done)
    }
}

/// Tries every damage of every byte of the legs, and gives the worst cost of each kind.
fn every_damage<S: Session>(
    lab: impl Fn() -> Lab<S>,
    from_mm: f64,
    legs: &[Leg],
) -> BTreeMap<&'static str, Cost> {
    let (clean, done) = lab().play(from_mm, legs, None);
    assert!(done && clean.cost.over_mm < 0.002, "{:?}", clean.cost);
    let mut worst = BTreeMap::new();
    for at in 0..clean.sent {
        let flips = (0..8).map(|bit| Damage::Flip { bit });
        for damage in flips.chain([Damage::Drop, Damage::Double]) {
            let (tried, _) = lab().play(from_mm, legs, Some((at, damage)));
            let kind = match damage {
                Damage::Flip { .. } => "bit flipped",
                Damage::Drop => "byte lost",
                Damage::Double => "byte doubled",
            };
            let cost: &mut Cost = worst.entry(kind).or_default();
            cost.over_mm = cost.over_mm.max(tried.cost.over_mm);
            cost.drag_mm = cost.drag_mm.max(tried.cost.drag_mm);
            cost.aside_mm = cost.aside_mm.max(tried.cost.aside_mm);
        }
    }
    worst
}

fn grbl_lab() -> Lab<grbl::Session> {
    Lab::new("protocol = \"grbl\"\n", LARGE, |protocol| {
        let StageProtocol::Grbl(axes) = protocol else { unreachable!("the rig's stage is grbl") };
        grbl::Session::new(grbl_config(axes, TOLERANCE_MM)).unwrap()
    })
}

fn zaber_lab() -> Lab<zaber::Session> {
    Lab::new(ZABER, SMALL, |protocol| {
        let StageProtocol::Zaber(axes) = protocol else { unreachable!("the rig's stage is zaber") };
        zaber::Session::new(zaber_config(axes, TOLERANCE_MM)).unwrap()
    })
}

/// The stated bound at a speed: what the check of the way allows, the way until the next report, and the deceleration.
fn bound_mm(speed_mm_per_s: f64) -> f64 {
    2.0 * TOLERANCE_MM
        + speed_mm_per_s * UNSEEN_S
        + speed_mm_per_s * speed_mm_per_s / (2.0 * ACCELERATION_MM_PER_S2)
        + 0.002
}

fn check(name: &str, worst: &BTreeMap<&'static str, Cost>, bound_mm: f64, drag_bound_mm: f64) {
    for (kind, cost) in worst {
        let Cost { over_mm, drag_mm, aside_mm } = *cost;
        let row = format!(
            "{name}, {kind}: {over_mm:.3} mm too deep, {drag_mm:.3} mm dragged, {aside_mm:.3} mm aside; bound {bound_mm:.3}"
        );
        eprintln!("{row}");
        assert!(over_mm <= bound_mm && drag_mm <= drag_bound_mm, "{row}");
    }
}

#[test]
fn one_damaged_byte_of_a_press_costs_less_than_the_stated_bound_with_grbl() {
    check("grbl press at 1 mm/s", &every_damage(grbl_lab, 0.3, &PRESS), bound_mm(1.0), bound_mm(20.0));
}

#[test]
fn one_damaged_byte_of_an_approach_costs_less_than_the_stated_bound_with_grbl() {
    check(
        "grbl approach at 20 mm/s",
        &every_damage(grbl_lab, 2.0, &APPROACH),
        bound_mm(20.0),
        bound_mm(20.0),
    );
    check(
        "grbl approach at 5 mm/s",
        &every_damage(grbl_lab, 2.0, &SLOW_APPROACH),
        bound_mm(5.0),
        bound_mm(5.0),
    );
}

#[test]
fn one_damaged_byte_costs_nothing_with_checksums() {
    check("zaber press at 1 mm/s", &every_damage(zaber_lab, 0.1, &SHORT_PRESS), 0.003, 0.003);
}
