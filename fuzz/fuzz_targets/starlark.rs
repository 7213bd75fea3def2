//! Any text as an experiment script: it is refused with a line of it, or runs within its limits. The same script asks for the same steps
//! again. What stands before the first zero byte are arguments, as a run's request has them.
#![no_main]

use std::sync::LazyLock;
use std::time::Duration;

use libfuzzer_sys::fuzz_target;
use tactus_plan::{
    Arguments, Call, Exceeded, Host, LOG_LINE_MAX_BYTES, MeanReading, Outcome, Refusal, Reply, RigView,
    Script, ScriptError, ScriptLimits, Step, execute,
};
use tactus_schema::Rig;

/// Small, so that an endless script costs little. The evaluator looks at its loops once in a thousand turns.
static LIMITS: LazyLock<ScriptLimits> = LazyLock::new(|| ScriptLimits {
    ticks: 4_000,
    heap_bytes: 16 << 20,
    steps: 200,
    log_bytes: 16 << 10,
    think: Duration::from_secs(5),
    ..ScriptLimits::default()
});

/// Elements of a reading.
const ELEMENTS: usize = 48;

static RIG: LazyLock<RigView> = LazyLock::new(|| {
    RigView::of(&Rig::from_toml(include_str!("../../config/rigs/sim.toml")).expect("a shipped rig"))
});

fuzz_target!(|input: &str| {
    let (arguments, source) = input.split_once('\0').unwrap_or(("", input));
    let script = match Script::parse("any", source) {
        Ok(script) => script,
        Err(error) => return check(&error, source),
    };
    assert!(script.summary().lines().count() <= 1);
    match script.parameters(&RIG) {
        Ok(parameters) => assert!(parameters.iter().all(|parameter| !parameter.name.is_empty())),
        Err(error) => check(&error, source),
    }
    let arguments = Arguments::from_json(arguments).unwrap_or_default();
    if let Ok(again) = Arguments::from_json(&arguments.to_json()) {
        assert_eq!(again.to_json(), arguments.to_json());
    }
    let (steps, ended) = run(&script, &arguments);
    if let Err(error) = &ended {
        check(error, source);
    }
    let (again, ended_again) = run(&script, &arguments);
    if !ran_out_of_time(&ended) && !ran_out_of_time(&ended_again) {
        assert_eq!(steps, again);
        assert_eq!(ended.map(|outcome| outcome.result), ended_again.map(|outcome| outcome.result));
    }
});

/// The steps that a script asks for, as text, so that NaN equals itself.
fn run(script: &Script, arguments: &Arguments) -> (Vec<String>, Result<Outcome, ScriptError>) {
    let mut host = Recorded { calls: Vec::new() };
    let ended = execute(script, arguments, &RIG, 7, &LIMITS, &mut host);
    assert!(host.calls.len() as u64 <= LIMITS.steps);
    if let Ok(outcome) = &ended {
        assert!(outcome.steps <= LIMITS.steps);
    }
    (host.calls, ended)
}

/// The processor is not ours alone: where a script is when its time is over differs.
fn ran_out_of_time(ended: &Result<Outcome, ScriptError>) -> bool {
    matches!(ended, Err(ScriptError::Limit { exceeded: Exceeded::Think(_), .. }))
}

/// An error has words, and a line that the script has.
fn check(error: &ScriptError, source: &str) {
    assert!(!error.to_string().is_empty());
    if let Some(at) = error.at() {
        let lines = source.split('\n').count();
        assert!(at.line >= 1 && at.line as usize <= lines + 1, "{error}: there are {lines} lines");
    }
}

/// Does every step at once.
struct Recorded {
    calls: Vec<String>,
}

impl Host for Recorded {
    fn perform(&mut self, call: &Call) -> Result<Reply, Refusal> {
        self.calls.push(format!("{call:?}"));
        let numbers = || vec![100.0; ELEMENTS];
        let reading = || MeanReading { mean_counts: numbers(), signal: numbers(), rms: numbers(), frames: 8 };
        Ok(match &call.step {
            Step::Move { to, height_mm, .. } => {
                Reply::Position { x_mm: to.x_mm, y_mm: to.y_mm, height_mm: height_mm.unwrap_or(2.0) }
            }
            Step::Press(press) => Reply::Pressed(press.depths_mm.iter().map(|_| reading()).collect()),
            Step::Dwell { .. } | Step::Read { .. } | Step::Tare { .. } => Reply::Reading(reading()),
            Step::Log { message } => {
                assert!(message.len() <= LOG_LINE_MAX_BYTES + 100, "a line of {} bytes", message.len());
                Reply::Done
            }
            Step::Wait { .. } | Step::Covering { .. } => Reply::Done,
        })
    }

    fn cancelled(&self) -> bool {
        false
    }
}
