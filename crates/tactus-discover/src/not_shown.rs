//! Which effects these data cannot show, whatever their size, and what they lack for it.

use tactus_model::Phase;

use crate::candidates::Screened;
use crate::contacts::Contacts;
use crate::discovery::NotShown;
use crate::fit::Problem;

/// An effect is out of sight if the whole of its range would be seen with no more than so many standard errors.
const REACH_LEAST: f64 = 15.0;

/// What the data hold, as far as effects need it.
#[derive(Debug)]
struct Holds {
    replicates: bool,
    depths: usize,
    places: usize,
    presses: usize,
    longest_hold_s: f64,
    rest_after_release_s: f64,
    unloads: bool,
    speeds: usize,
    approaches: bool,
    repeats: bool,
    moves: bool,
    duration_s: f64,
}

/// Effects that the data cannot show: those that need what the data do not hold, and those that would hardly change
/// anything even at the end of their range.
pub(crate) fn not_shown(problem: &Problem<'_>, screened: &[Screened], replicates: bool) -> Vec<NotShown> {
    let holds = Holds::of(problem, replicates);
    screened
        .iter()
        .filter_map(|one| {
            let effect = one.definition.name;
            let lacking = holds.lacks(effect).map(str::to_owned);
            let out_of_sight = (one.reach < REACH_LEAST && !LATTICE.contains(&effect)).then(|| {
                format!(
                    "nothing in these data changes with it beyond what recalibration takes up; {} would show it",
                    one.definition.shown_by.join(" or ")
                )
            });
            lacking.or(out_of_sight).map(|reason| NotShown { effect, reason })
        })
        .collect()
}

/// Effects that are seen in the readings themselves, not in their means.
const LATTICE: [&str; 3] = ["quantisation", "periodic-interference", "miswired"];

impl Holds {
    fn of(problem: &Problem<'_>, replicates: bool) -> Self {
        let frames = problem.sensor.frames;
        let contacts = Contacts::of(frames);
        Self {
            replicates,
            depths: contacts.distinct_depths(),
            places: contacts.distinct_places(),
            presses: contacts.count(),
            longest_hold_s: contacts.longest_hold_s(),
            rest_after_release_s: contacts.longest_rest_s(),
            unloads: frames.phase.contains(&Phase::Unload) || contacts.falls_in_contact(),
            speeds: contacts.distinct_speeds(),
            approaches: contacts.approaches(),
            repeats: contacts.repeats(),
            moves: contacts.frames_in_motion() >= 20,
            duration_s: problem.duration_s,
        }
    }

    /// What an effect of this name needs that is not there.
    fn lacks(&self, effect: &str) -> Option<&'static str> {
        let one_place = self.places < 3;
        match effect {
            _ if self.presses == 0 => Some("nothing is pressed"),
            "misregistration" | "surface-tilt" | "indenter-tilt" | "edge-effect" | "heavy-tail"
            | "anisotropic-spread" | "crosstalk" | "indenter-size"
                if one_place =>
            {
                Some("fewer than three places were pressed")
            }
            "surface-offset" | "hardening" | "saturation" | "depth-dependent-spread" if self.depths < 2 => {
                Some("all presses go to one depth")
            }
            "time-lag" | "low-pass" | "scan-skew" if !self.moves => Some("no frame shows the tool in motion"),
            "rate-stiffening" if self.speeds < 2 => Some("all presses go in at one speed"),
            "hysteresis" if !self.unloads => Some("no frame shows a press on its way back"),
            "backlash" if !self.approaches && !self.unloads => {
                Some("every place is reached from one direction only")
            }
            "relaxation" if self.longest_hold_s < 0.2 => Some("no depth is held for 0.2 s"),
            "imprint" if self.rest_after_release_s < 0.3 => Some("no rest of 0.3 s follows a press"),
            "softening" | "gain-drift" if !self.repeats && self.presses < 6 => {
                Some("nothing is pressed again, and there are fewer than six presses")
            }
            "baseline-drift" if self.duration_s < 10.0 => Some("the data last less than 10 s"),
            "quantisation" | "periodic-interference" if !self.replicates => {
                Some("no frames repeat each other")
            }
            _ => None,
        }
    }
}
