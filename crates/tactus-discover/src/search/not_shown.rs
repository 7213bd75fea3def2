//! Effects that these data cannot show at any size, and what the data lack.

use tactus_model::Phase;
use tactus_model::effect::{Definition, REGISTRY};

use crate::data::Contacts;
use crate::fit::Problem;

/// An effect that the data cannot show.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NotShown {
    /// Name of the effect.
    pub effect: &'static str,
    /// What the data lack.
    pub reason: String,
}

/// An effect cannot be shown if its whole range is less than this many standard errors.
const REACH_LEAST: f64 = 15.0;

const TOO_SMALL: &str = "its change of these data is too small, or recalibration can reproduce it";

/// Effects for which the data lack something. They are no candidates, however well they seem to fit.
pub(crate) fn lacking(problem: &Problem<'_>, replicates: bool) -> Vec<NotShown> {
    let frames = problem.predictor.frames;
    let contacts = Contacts::of(frames);
    let unloads = frames.phase.contains(&Phase::Unload) || contacts.falls_in_contact();
    REGISTRY
        .iter()
        .filter_map(|definition| {
            let effect = definition.name;
            let reason = lacks(effect, &contacts, unloads, replicates, problem.extent.duration_s)?;
            Some(NotShown { effect, reason: reason.to_owned() })
        })
        .collect()
}

/// Effects that would hardly change these data even at the ends of their ranges.
pub(crate) fn out_of_sight(reach: &[(&'static Definition, f64)]) -> Vec<NotShown> {
    let unseen = reach
        .iter()
        .filter(|(definition, reach)| *reach < REACH_LEAST && !LATTICE.contains(&definition.name))
        .map(|(definition, _)| NotShown {
            effect: definition.name,
            reason: match definition.shown_by {
                [] => TOO_SMALL.to_owned(),
                named => format!("{TOO_SMALL}; {} would show it", named.join(" or ")),
            },
        });
    unseen.collect()
}

/// Fewer frames in motion are only the ends of moves.
const MOVING_LEAST: usize = 20;
/// Effects that show in single readings or by other tests than the reach of a first step.
const LATTICE: [&str; 3] = ["quantisation", "periodic-interference", "miswired"];

/// What the data lack for an effect of this name; `None` if nothing.
fn lacks(
    effect: &str,
    contacts: &Contacts<'_>,
    unloads: bool,
    replicates: bool,
    duration_s: f64,
) -> Option<&'static str> {
    match effect {
        _ if contacts.count() == 0 => Some("nothing is pressed"),
        "misregistration"
        | "surface-tilt"
        | "indenter-tilt"
        | "edge-effect"
        | "heavy-tail"
        | "anisotropic-spread"
        | "depth-dependent-spread"
        | "crosstalk"
        | "indenter-size"
            if contacts.distinct_places() < 3 =>
        {
            Some("fewer than three places were pressed")
        }
        "surface-offset" | "hardening" | "saturation" | "depth-dependent-spread"
            if contacts.distinct_depths() < 2 =>
        {
            Some("all presses go to one depth")
        }
        "time-lag" | "low-pass" | "scan-skew" if contacts.frames_in_motion() < MOVING_LEAST => {
            Some("hardly any frame shows the tool in motion during a press")
        }
        "rate-stiffening" if contacts.distinct_speeds() < 2 => Some("all presses go in at one speed"),
        "hysteresis" if !unloads => Some("no frame shows an unload"),
        "backlash" if !contacts.approaches() && !unloads => {
            Some("every place is reached from one direction only")
        }
        "relaxation" if contacts.longest_hold_s() < 0.2 => Some("no depth is held for 0.2 s"),
        "imprint" if contacts.longest_rest_s() < 0.3 => Some("no rest of 0.3 s follows a press"),
        "softening" | "gain-drift" if !contacts.repeats() && contacts.count() < 6 => {
            Some("nothing is pressed again, and there are fewer than six presses")
        }
        "baseline-drift" if duration_s < 10.0 => Some("the data last less than 10 s"),
        "quantisation" | "periodic-interference" if !replicates => Some("no frames repeat each other"),
        _ => None,
    }
}
