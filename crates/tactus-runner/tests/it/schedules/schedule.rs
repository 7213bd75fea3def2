//! What is played: a list of events, made from a seed or read from a text.

use std::fmt::{self, Write as _};
use std::str::FromStr;
use std::time::Duration;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tactus_schema::Rig;
use tactus_virtual::schedule;

const SIM: &str = include_str!("../../../../../config/rigs/sim.toml");

const ZABER: &str = "protocol = \"zaber-ascii\"
axes.x = { device = 1, axis = 1, um_per_microstep = 0.047625 }
axes.y = { device = 1, axis = 2, um_per_microstep = 0.047625 }
axes.z = { device = 2, axis = 1, um_per_microstep = 0.047625 }
";

/// Runs of one schedule.
pub(super) const RUNS: u32 = 3;

/// Faults come within this time; most schedules are over by then.
const FAULTS_SPAN: Duration = Duration::from_secs(90);

/// The deepest that the covering of the rigs, of 1.016 mm, allows is 0.7112 mm.
const DEEPEST_MM: f64 = 0.71;

/// Coverings that scripts ask for, and a depth that only the thickest allows.
const COVERINGS_MM: [f64; 3] = [0.508, 1.016, 2.032];
const DEEP_MM: f64 = 1.4;

/// A seed, a rig, and what happens to it. Its text is one line; reading it gives the same schedule.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Schedule {
    /// Of the virtual devices.
    pub(super) seed: u64,
    pub(super) stand: Stand,
    pub(super) events: Vec<Event>,
}

/// Which rig is played with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Stand {
    Grbl,
    Zaber,
    /// Its limits of force are so low that presses exceed them.
    Frail,
    /// Its limit of the sum is.
    FrailSum,
}

/// Something that happens. Times are since the rig was switched on.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Event {
    /// A fault of the devices or their links, as a line.
    Fault(Duration, String),
    /// The host does nothing for a time: it was suspended, or busy.
    Hang(Duration, Duration),
    /// A client of the engine does something.
    Client(Duration, Act),
    /// A line of the script of a run.
    Step(u32, String),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Act {
    Stop,
    Abort,
    Pause,
    Resume,
    /// Confirms a covering that is not there.
    Confirm,
    Reset,
}

const STANDS: [(&str, Stand); 4] =
    [("grbl", Stand::Grbl), ("zaber", Stand::Zaber), ("frail", Stand::Frail), ("frail-sum", Stand::FrailSum)];

const ACTS: [(&str, Act); 6] = [
    ("stop", Act::Stop),
    ("abort", Act::Abort),
    ("pause", Act::Pause),
    ("resume", Act::Resume),
    ("confirm", Act::Confirm),
    ("reset", Act::Reset),
];

impl Schedule {
    /// The schedule of a seed.
    pub(super) fn of_seed(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let stand = match seed % 8 {
            3 if seed % 16 == 3 => Stand::Zaber,
            5 => Stand::Frail,
            6 if seed % 16 == 6 => Stand::FrailSum,
            _ => Stand::Grbl,
        };
        let elements = stand.rig().array.elements();
        let faults = schedule::Schedule::random(seed, FAULTS_SPAN, rng.random_range(0..7), elements).faults;
        let mut events: Vec<Event> = faults.into_iter().map(|(at, line)| Event::Fault(at, line)).collect();
        if rng.random_range(0..6) == 0 {
            let at = Duration::from_millis(rng.random_range(0..60_000));
            events.push(Event::Hang(at, Duration::from_millis(rng.random_range(10..1500))));
        }
        if rng.random() {
            events.extend(client(&mut rng));
        }
        for run in 0..RUNS {
            let steps = rng.random_range(1..5);
            events.extend((0..steps).map(|_| Event::Step(run, step(&mut rng))));
        }
        Self { seed, stand, events }
    }

    /// The faults of the devices, in order of time.
    pub(super) fn faults(&self) -> schedule::Schedule {
        let fault = |event: &Event| match event {
            Event::Fault(at, line) => Some((*at, line.clone())),
            Event::Hang(..) | Event::Client(..) | Event::Step(..) => None,
        };
        let mut faults: Vec<_> = self.events.iter().filter_map(fault).collect();
        faults.sort();
        schedule::Schedule { faults }
    }

    /// The script of a run, and the presses that it makes if nothing stops it; `None` if the run has no step.
    pub(super) fn script(&self, run: u32) -> Option<(String, u32)> {
        let (mut text, mut steps, mut presses) = (String::from("def run(rig):\n"), 0, 0);
        for event in &self.events {
            if let Event::Step(of, line) = event
                && *of == run
            {
                writeln!(text, "    {line}").unwrap();
                steps += 1;
                presses += u32::from(line.starts_with("press("));
            }
        }
        writeln!(text, "    wait(0.1)").unwrap();
        (steps > 0).then_some((text, presses))
    }
}

/// What a client does within five minutes.
fn client(rng: &mut ChaCha8Rng) -> Vec<Event> {
    let mut at = Duration::ZERO;
    let mut acts = Vec::new();
    loop {
        at += Duration::from_millis(rng.random_range(1..20_000));
        if at > Duration::from_mins(5) {
            return acts;
        }
        let act = match rng.random_range(0..12) {
            0 => Act::Stop,
            1 => Act::Abort,
            2..=4 => Act::Pause,
            5 => Act::Confirm,
            6..=7 => Act::Reset,
            _ => Act::Resume,
        };
        acts.push(Event::Client(at, act));
    }
}

/// A line of a script.
fn step(rng: &mut ChaCha8Rng) -> String {
    let (x_mm, y_mm) = (rng.random_range(0.0..16.2), rng.random_range(0.0..11.8));
    match rng.random_range(0..8) {
        0 => "tare()".into(),
        1 => "wait(0.3)".into(),
        2 => format!("move({x_mm:.3}, {y_mm:.3}, height_mm = {:.3})", rng.random_range(0.0..5.0)),
        3 => format!("press({x_mm:.3}, {y_mm:.3}, [{DEEPEST_MM}], speed_mm_per_s = 1.0)"),
        4 if rng.random() => {
            format!("covering({:.3})", COVERINGS_MM[rng.random_range(0..COVERINGS_MM.len())])
        }
        4 => format!("press({x_mm:.3}, {y_mm:.3}, [{DEEP_MM}], speed_mm_per_s = 1.0)"),
        _ => {
            let depths: Vec<_> =
                (0..rng.random_range(1..4)).map(|_| format!("{:.3}", rng.random_range(0.05..0.7))).collect();
            let speed_mm_per_s: f64 = rng.random_range(0.2..1.0);
            let depths = depths.join(", ");
            format!("press({x_mm:.3}, {y_mm:.3}, [{depths}], speed_mm_per_s = {speed_mm_per_s:.2})")
        }
    }
}

impl Stand {
    pub(super) fn rig(self) -> Rig {
        let toml = match self {
            Self::Grbl => SIM.to_owned(),
            Self::Zaber => SIM.replace("protocol = \"grbl\"\n", ZABER),
            Self::Frail => SIM.replace("element_max_counts = 2000.0", "element_max_counts = 300.0"),
            Self::FrailSum => SIM.replace("sum_max_counts = 40000.0", "sum_max_counts = 2500.0"),
        };
        Rig::from_toml(&toml).unwrap()
    }
}

impl Event {
    /// Simpler events that might fail as well, the simplest first.
    pub(super) fn simpler(&self) -> Vec<Self> {
        match self {
            Self::Fault(at, line) => earlier(*at).map(|at| Self::Fault(at, line.clone())).collect(),
            Self::Hang(at, lasts) => earlier(*at).map(|at| Self::Hang(at, *lasts)).collect(),
            Self::Client(at, act) => earlier(*at).map(|at| Self::Client(at, *act)).collect(),
            Self::Step(run, line) => fewer_depths(line).map(|line| Self::Step(*run, line)).collect(),
        }
    }
}

/// Whole seconds before a time: what was only needed to pass the time until then can be removed afterwards.
fn earlier(at: Duration) -> impl Iterator<Item = Duration> {
    let whole = |at: Duration| Duration::from_secs(at.as_secs());
    [at / 2, at * 3 / 4, at].into_iter().map(whole).filter(move |earlier| *earlier < at)
}

/// The presses of only one of several depths.
fn fewer_depths(line: &str) -> impl Iterator<Item = String> {
    let parts = line.split_once('[').and_then(|(head, rest)| {
        let (depths, tail) = rest.split_once(']')?;
        depths.contains(", ").then_some((head, depths, tail))
    });
    parts.into_iter().flat_map(|(head, depths, tail)| {
        depths.split(", ").map(move |depth_mm| format!("{head}[{depth_mm}]{tail}"))
    })
}

impl fmt::Display for Schedule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let stand = STANDS.iter().find(|(_, stand)| *stand == self.stand).map_or("", |(name, _)| name);
        write!(f, "seed {}; rig {stand}", self.seed)?;
        self.events.iter().try_for_each(|event| write!(f, "; {event}"))
    }
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Fault(at, line) => write!(f, "at {} {line}", at.as_millis()),
            Self::Hang(at, lasts) => write!(f, "at {} host hangs {}", at.as_millis(), lasts.as_millis()),
            Self::Client(at, act) => {
                let name = ACTS.iter().find(|(_, known)| known == act).map_or("", |(name, _)| name);
                write!(f, "at {} client {name}", at.as_millis())
            }
            Self::Step(run, line) => write!(f, "run {run} {line}"),
        }
    }
}

impl FromStr for Schedule {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut parts = text.split(';').map(str::trim).filter(|part| !part.is_empty());
        let seed =
            parts.next().and_then(|part| part.strip_prefix("seed ")).and_then(|seed| seed.parse().ok());
        let stand = parts.next().and_then(|part| part.strip_prefix("rig "));
        let stand = stand.and_then(|name| STANDS.iter().find(|(known, _)| *known == name));
        let (Some(seed), Some((_, stand))) = (seed, stand) else {
            return Err("a schedule begins with \"seed N; rig NAME\"".into());
        };
        let events = parts.map(Event::from_str).collect::<Result<_, _>>()?;
        Ok(Self { seed, stand: *stand, events })
    }
}

impl FromStr for Event {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("{text:?} is no event");
        let ms = |word: &str| word.parse().map(Duration::from_millis).map_err(|_| wrong());
        let (kind, rest) = text.split_once(' ').ok_or_else(wrong)?;
        let (number, what) = rest.split_once(' ').ok_or_else(wrong)?;
        if kind == "run" {
            return Ok(Self::Step(number.parse().map_err(|_| wrong())?, what.to_owned()));
        }
        let at = ms(number)?;
        if let Some(lasts) = what.strip_prefix("host hangs ") {
            return Ok(Self::Hang(at, ms(lasts)?));
        }
        if let Some(name) = what.strip_prefix("client ") {
            let act = ACTS.iter().find(|(known, _)| *known == name);
            return act.map(|(_, act)| Self::Client(at, *act)).ok_or_else(wrong);
        }
        // Checked here, so that a wrong line is told at once.
        what.parse::<tactus_virtual::faults::InjectedFault>()
            .map_err(|error| format!("{text:?}: {error}"))?;
        Ok(Self::Fault(at, what.to_owned()))
    }
}
