use tactus_engine::{DoneStep, EarlierRun};
use tactus_plan::InThisProcess;
use tactus_schema::WallTime;

use super::*;
use crate::embedded::SIMULATED_RIG;
use crate::order::{self, RunRequest};

/// Presses four times, and more often where it feels something.
const SCRIPT: &str = r"
def run(rig):
    tare(0.5)
    log('four')
    for place in shuffled([0, 1, 2, 3]):
        readings = press(30 + place, 20, [0.1, 0.2])
        if max(readings[-1].signal) > 0:
            wait(100)
";

/// Notes how far the outline is after each step.
struct Watching<'a> {
    outline: &'a Outline,
    unmoved: Unmoved,
    shares: Vec<f64>,
}

impl Host for Watching<'_> {
    fn perform(&mut self, call: &Call) -> Result<Reply, Refusal> {
        self.shares.push(self.outline.share().expect("the outline is known"));
        self.unmoved.perform(call)
    }

    fn cancelled(&self) -> bool {
        false
    }
}

fn ordered(rig: &Rig) -> RunOrder {
    let request = RunRequest {
        script: Script::parse("four", SCRIPT).unwrap(),
        arguments: Arguments::default(),
        seed: Some(1),
        who: "test".into(),
        evaluator: Arc::new(InThisProcess),
        earlier: None,
    };
    order::order(request, rig, WallTime::default(), &|| false).unwrap()
}

/// The shares before each step, and at the end.
fn shares(rig: &Rig, order: &RunOrder) -> Vec<f64> {
    let outline = Outline::of(rig, order).unwrap();
    outline.begin().unwrap().join().unwrap();
    let unmoved = Unmoved { elements: rig.array.elements(), is_over: Arc::default() };
    let mut watching = Watching { outline: &outline, unmoved, shares: Vec::new() };
    let RunOrder { script, arguments, seed, limits, .. } = order;
    let ended =
        outline.evaluator().execute(script, arguments, &RigView::of(rig), *seed, limits, &mut watching);
    ended.unwrap();
    let Watching { mut shares, .. } = watching;
    shares.push(outline.share().unwrap());
    shares
}

#[test]
fn the_share_grows_with_the_time_of_the_steps() {
    let rig = Rig::from_toml(SIMULATED_RIG).unwrap();
    let shares = shares(&rig, &ordered(&rig));
    let [before_tare, before_log, first, second, third, fourth, end] = shares[..] else {
        panic!("{shares:?}")
    };
    assert!(before_tare.abs() < 1e-9 && (end - 1.0).abs() < 1e-9, "{shares:?}");
    // A log line takes no time, and each press the same, which is more than the tare's half second.
    assert!((first - before_log).abs() < 1e-9, "{shares:?}");
    for (before, after) in [(first, second), (second, third), (third, fourth), (fourth, end)] {
        assert!(
            (after - before - (1.0 - first) / 4.0).abs() < 1e-3 && after - before > before_log,
            "{shares:?}"
        );
    }
}

#[test]
fn what_an_earlier_run_has_done_takes_no_time() {
    let rig = Rig::from_toml(SIMULATED_RIG).unwrap();
    let mut order = ordered(&rig);
    // The tare, the line and two presses. Nothing looks at what they were.
    let done = DoneStep { step: Step::Log { message: String::new() }, at: String::new(), reply: Reply::Done };
    let covering_mm = rig.covering.thickness_mm;
    let earlier = EarlierRun { run_id: "earlier".into(), covering_mm, steps: vec![done; 4], next_press: 2 };
    order.earlier = Some(Arc::new(earlier));
    let shares = shares(&rig, &order);
    let expected = [0.0, 0.0, 0.0, 0.0, 0.0, 0.5, 1.0];
    assert!(shares.iter().zip(expected).all(|(share, due)| (share - due).abs() < 1e-3), "{shares:?}");
}

#[test]
fn a_script_that_fails_has_no_outline() {
    let rig = Rig::from_toml(SIMULATED_RIG).unwrap();
    let mut order = ordered(&rig);
    order.script =
        Script::parse("fails", "def run(rig):\n    press(30, 20, [0.1])\n    fail('no')\n").unwrap();
    let outline = Outline::of(&rig, &order).unwrap();
    outline.begin().unwrap().join().unwrap();
    assert_eq!(outline.share(), None);
}
