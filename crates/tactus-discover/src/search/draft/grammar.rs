//! The grammar: which drafts there are.
//!
//! An atom is a carrier, when it acts, and one covariate or two. Not every carrier goes with every covariate: what would be the same to all
//! data, or cannot be, is left out. None of them has the formula of a physics. But some are here because tuning sets with a certain physics
//! outside the library were drafted wrongly without them, so their drafts of that physics are no independent evidence:
//!
//! | atom | added | after a miss of |
//! |---|---|---|
//! | a press at the tip's place by height, always | 2026-11-27 | `proximity`: felt from afar, it was `surface-offset` beside its draft (decision 0047) |
//! | knots from frame to frame after an event | 2026-11-27 | no miss that the history tells; `ringing` is what they follow |
//! | a jump, counts by the element's counts | 2026-11-28 | `range-switch`: drafted as a curve of the signal |
//! | fine knots by height | 2026-11-28 | `adhesion`, and `proximity` with it: what is gone a little above the surface |
//! | counts by the place, x and y, always | 2026-11-29 | `arm-shadow` |
//! | counts since a release, always | 2026-11-29 | `static-charge`: what lasts into the next press was drafted with half of its length |

use std::sync::Arc;

use tactus_model::Covariate;
use tactus_model::effect::{Carrier, When};

use super::sight::{KNOTS_OF_ELEMENTS, Sight};
use super::{KNOTS, KNOTS_OF_DISTANCE, KNOTS_OF_SECOND};
use crate::fit::{Fitted, Problem};
use crate::search::cells::Point;
use crate::search::jumps;
use crate::search::tones::{clearest, clearest_beside_rhythm, most_per_count};

/// A jump is this share of its covariate's range wide: a cell of those among which it was found.
const JUMP_SHARE: f64 = 1.0 / jumps::CELLS as f64;

/// A draft without its curve.
#[derive(Debug, Clone)]
pub(super) struct Atom {
    pub(super) carrier: Carrier,
    pub(super) when: When,
    pub(super) covariates: Vec<Covariate>,
    /// Places of the knots for each covariate; none of a tone.
    pub(super) knots: Vec<Vec<f64>>,
    /// Periods per unit of the covariate, of a tone.
    pub(super) per_unit: Option<f64>,
    /// True of a jump: straight lines on both sides of a place.
    pub(super) is_jump: bool,
    /// True if each element has a weight of its own, that is to be found.
    pub(super) of_elements: bool,
    /// The curve that all elements share, once it is known.
    pub(super) curve: Option<Arc<Vec<f64>>>,
    /// The weight of each element, once they are known.
    pub(super) weights: Option<Arc<Vec<f64>>>,
    /// From how many alternatives the residual picked it.
    pub(super) among: f64,
}

/// A carrier with when it acts and a covariate.
pub(super) type Acting = (Carrier, When, Covariate);

/// Carriers with when they act and what on.
type Group = (Carrier, When, &'static [Covariate]);

const IN_CONTACT: &[Group] = &[
    (
        Carrier::OwnSignal,
        When::InContact,
        &[
            Covariate::Time,
            Covariate::SinceContact,
            Covariate::SinceTurn,
            Covariate::Depth,
            Covariate::DeepestBefore,
            Covariate::Direction,
            Covariate::ApproachX,
            Covariate::ApproachY,
            Covariate::Speed,
            Covariate::PlaceX,
            Covariate::PlaceY,
            Covariate::InElementX,
            Covariate::InElementY,
            Covariate::Temperature,
            Covariate::SumOfSignals,
            Covariate::Signal,
            Covariate::ShareOfLargest,
            Covariate::Distance,
            Covariate::Ahead,
        ],
    ),
    (
        Carrier::Depth,
        When::InContact,
        &[
            Covariate::Time,
            Covariate::SinceContact,
            Covariate::SinceTurn,
            Covariate::DeepestBefore,
            Covariate::Direction,
            Covariate::Speed,
            Covariate::PlaceX,
            Covariate::PlaceY,
            Covariate::InElementX,
            Covariate::InElementY,
            Covariate::Temperature,
        ],
    ),
    (
        Carrier::X,
        When::InContact,
        &[
            Covariate::Time,
            Covariate::Depth,
            Covariate::PlaceX,
            Covariate::PlaceY,
            Covariate::ApproachX,
            Covariate::Temperature,
        ],
    ),
    (
        Carrier::Y,
        When::InContact,
        &[
            Covariate::Time,
            Covariate::Depth,
            Covariate::PlaceX,
            Covariate::PlaceY,
            Covariate::ApproachY,
            Covariate::Temperature,
        ],
    ),
    (Carrier::Neighbours, When::InContact, &[Covariate::Depth, Covariate::SumOfSignals]),
    (Carrier::EveryElement, When::InContact, &[Covariate::Depth, Covariate::Distance]),
];

const ELSEWHERE: &[Group] = &[
    (Carrier::PressHere, When::Always, &[Covariate::Height]),
    (Carrier::PressHere, When::OutOfContact, &[Covariate::Height]),
    (Carrier::PressHere, When::OnTheWayDown, &[Covariate::Height]),
    (Carrier::PressHere, When::OnTheWayUp, &[Covariate::Height]),
    (Carrier::PressThere, When::OutOfContact, &[Covariate::SinceRelease]),
    (
        Carrier::Counts,
        When::InContact,
        &[Covariate::Depth, Covariate::SinceContact, Covariate::SumOfSignals, Covariate::Speed],
    ),
    (
        Carrier::Counts,
        When::OutOfContact,
        &[Covariate::SinceRelease, Covariate::SinceTurn, Covariate::TravelSpeed],
    ),
    (
        Carrier::Counts,
        When::Always,
        &[
            Covariate::Time,
            Covariate::SinceRelease,
            Covariate::PlaceX,
            Covariate::PlaceY,
            Covariate::TravelSpeed,
            Covariate::SumOfSignals,
            Covariate::Counts,
            Covariate::Temperature,
        ],
    ),
];

/// Of single elements: each with a weight, and one curve for all.
const OF_EACH: &[Group] = &[
    (Carrier::Counts, When::InContact, &[Covariate::Depth, Covariate::SinceContact]),
    (Carrier::Counts, When::OutOfContact, &[Covariate::SinceRelease]),
    (
        Carrier::Counts,
        When::Always,
        &[Covariate::SinceRelease, Covariate::TravelSpeed, Covariate::Temperature],
    ),
    (Carrier::OwnSignal, When::InContact, &[Covariate::Signal, Covariate::Depth]),
];

/// Constants: what comes with contact, whatever else there is.
const CONSTANT: &[Group] = &[
    (Carrier::Counts, When::InContact, &[Covariate::Depth]),
    (Carrier::EveryElement, When::InContact, &[Covariate::Depth]),
];

/// Tones.
const PERIODIC: &[Group] = &[
    (Carrier::Depth, When::InContact, &[Covariate::Time, Covariate::Travel]),
    (
        Carrier::OwnSignal,
        When::InContact,
        &[Covariate::Time, Covariate::PlaceX, Covariate::PlaceY, Covariate::Travel],
    ),
    (Carrier::X, When::InContact, &[Covariate::PlaceX]),
    (Carrier::Y, When::InContact, &[Covariate::PlaceY]),
    (Carrier::Counts, When::InContact, &[Covariate::Time]),
    (Carrier::Counts, When::Always, &[Covariate::Time, Covariate::Counts, Covariate::Travel]),
];

/// Jumps: straight lines on both sides of a place.
const JUMPING: &[Group] = &[(Carrier::Counts, When::Always, &[Covariate::Counts])];

/// All atoms that these data can show. `rounds` if the converter's steps are seen: then a tone in counts is the rounding.
pub(super) fn atoms(problem: &Problem<'_>, at: &Fitted, sight: &Sight, rounds: bool) -> Vec<Atom> {
    let each = |groups: &'static [Group]| {
        groups.iter().flat_map(|(carrier, when, covariates)| {
            covariates.iter().map(|covariate| (*carrier, *when, *covariate))
        })
    };
    let smooth = |(carrier, when, covariate): Acting, knots: usize, of_elements| {
        let is_wide = covariate == Covariate::Distance && carrier == Carrier::EveryElement;
        let knots = if is_wide { KNOTS_OF_DISTANCE } else { knots };
        let knots = sight.knots((carrier, when, covariate), knots);
        // A weight for each element may be of something that does not vary.
        let is_there = knots.len() > 1 || of_elements && !knots.is_empty();
        is_there.then(|| Atom { of_elements, ..Atom::of(carrier, when, covariate, knots) })
    };
    let mut found: Vec<Atom> = Vec::new();
    let of_all = || each(IN_CONTACT).chain(each(ELSEWHERE));
    found.extend(of_all().filter_map(|one| smooth(one, KNOTS, false)));
    // What follows an event may be over in some frames, or swing, and what is felt near the surface gone a little higher.
    let fine = |one: Acting| {
        let (carrier, when, covariate) = one;
        let knots = sight.fine_knots(one);
        (knots.len() > KNOTS).then(|| Atom::of(carrier, when, covariate, knots))
    };
    found.extend(of_all().filter(|(.., covariate)| is_near_an_event(*covariate)).filter_map(fine));
    found.extend(each(OF_EACH).filter_map(|one| smooth(one, KNOTS_OF_ELEMENTS, true)));
    found.extend(each(CONSTANT).flat_map(|(carrier, when, covariate)| {
        let place = sight.knots((carrier, when, covariate), 1);
        let constant = (!place.is_empty()).then(|| Atom::of(carrier, when, covariate, place));
        let of_elements = constant.clone().map(|atom| Atom { of_elements: true, ..atom });
        [constant, of_elements].into_iter().flatten()
    }));
    let left = Left::of(problem, at);
    let is_rounding = |covariate| rounds && covariate == Covariate::Counts;
    let may_be = |(.., covariate): &Acting| !is_rounding(*covariate);
    found.extend(each(JUMPING).filter(may_be).filter_map(|one| jump(&left, sight, one)));
    found.extend(each(PERIODIC).filter(may_be).filter_map(|one| tone(&left, sight, one)));
    found
}

/// A jump or a tone where the residual at this model has it, as if all elements had the same weight; any other atom as it is.
pub(super) fn picked_anew(mut atom: Atom, problem: &Problem<'_>, at: &Fitted, sight: &Sight) -> Atom {
    let acting = (atom.carrier, atom.when, atom.covariates[0]);
    let left = || Left::of(problem, at);
    let anew = match (atom.is_jump, atom.per_unit) {
        (true, _) => jump(&left(), sight, acting),
        (_, Some(_)) => tone(&left(), sight, acting),
        (false, None) => None,
    };
    if let Some(Atom { knots, per_unit, .. }) = anew {
        // Of a jump with a second covariate the first knots alone.
        atom.knots.iter_mut().zip(knots).for_each(|(own, anew)| *own = anew);
        atom.per_unit = per_unit;
    }
    atom
}

/// What a model leaves, reading by reading.
struct Left {
    residual: Vec<f64>,
    weights: Vec<f64>,
    /// Most periods of a tone per count.
    per_count_most: f64,
}

impl Left {
    fn of(problem: &Problem<'_>, at: &Fitted) -> Self {
        Self {
            residual: problem.residuals(&at.predicted).collect(),
            weights: problem.weights().collect(),
            per_count_most: most_per_count(problem.predictor.known.array.step_counts()),
        }
    }

    /// The residual along a covariate.
    fn along(
        &self,
        sight: &Sight,
        (carrier, when, covariate): Acting,
    ) -> impl Iterator<Item = Point> + Clone {
        sight.points(carrier, covariate, when).map(|(reading, value, unit)| Point {
            value,
            wanted: self.weights[reading] * self.residual[reading] * unit,
            square: self.weights[reading] * unit * unit,
        })
    }
}

/// The clearest jump of what is left.
fn jump(left: &Left, sight: &Sight, acting: Acting) -> Option<Atom> {
    let jump = jumps::clearest(&left.along(sight, acting))?;
    let (carrier, when, covariate) = acting;
    let [least, most] = sight.range(acting);
    let width = JUMP_SHARE * (most - least);
    let knots = vec![least, jump.at - width, jump.at, most];
    let atom = |knots| Atom::of(carrier, when, covariate, knots);
    knots.is_sorted().then(|| Atom { among: jump.among, is_jump: true, ..atom(knots) })
}

/// The clearest tone of what is left.
fn tone(left: &Left, sight: &Sight, acting: Acting) -> Option<Atom> {
    let (carrier, when, covariate) = acting;
    let along = left.along(sight, acting);
    let tone = if covariate == Covariate::Time {
        clearest_beside_rhythm(&along)
    } else {
        clearest(&along, if covariate == Covariate::Counts { left.per_count_most } else { f64::INFINITY })
    }?;
    let atom = Atom::of(carrier, when, covariate, Vec::new());
    Some(Atom { per_unit: Some(tone.per_unit), among: tone.among, ..atom })
}

/// True of a time since something happened, and of a distance from where it does.
pub(super) const fn is_near_an_event(covariate: Covariate) -> bool {
    matches!(
        covariate,
        Covariate::SinceContact | Covariate::SinceTurn | Covariate::SinceRelease | Covariate::Height
    )
}

/// An atom with each other covariate that its carrier may have beside its own.
pub(super) fn with_seconds<'a>(best: &'a Atom, sight: &'a Sight) -> impl Iterator<Item = Atom> + 'a {
    let is_plain = best.per_unit.is_none() && !best.of_elements && best.covariates.len() == 1;
    let groups = IN_CONTACT
        .iter()
        .chain(ELSEWHERE)
        .filter(move |(carrier, when, _)| is_plain && *carrier == best.carrier && *when == best.when);
    let own = best.covariates[0];
    let others = groups.flat_map(|(_, _, covariates)| covariates.iter().copied());
    // Depth goes with everything in contact, though by itself it may be no covariate of a carrier.
    let depth = (is_plain && best.when == When::InContact).then_some(Covariate::Depth);
    let mut seconds: Vec<Covariate> = others.chain(depth).filter(|second| *second != own).collect();
    seconds.sort_unstable();
    seconds.dedup();
    seconds.into_iter().filter_map(move |second| {
        let of_second = sight.knots((best.carrier, best.when, second), KNOTS_OF_SECOND);
        let of_own = best.knots.first().filter(|own| own.len() > 1)?;
        (of_second.len() > 1).then(|| Atom {
            covariates: vec![own, second],
            knots: vec![of_own.clone(), of_second],
            ..best.clone()
        })
    })
}

impl Atom {
    pub(super) fn of(carrier: Carrier, when: When, covariate: Covariate, knots: Vec<f64>) -> Self {
        Self {
            carrier,
            when,
            covariates: vec![covariate],
            knots: if knots.is_empty() { Vec::new() } else { vec![knots] },
            per_unit: None,
            is_jump: false,
            of_elements: false,
            curve: None,
            weights: None,
            among: 1.0,
        }
    }

    /// Number of knots of its curve; of a tone a sine and a cosine.
    pub(super) fn knots_each(&self) -> usize {
        if self.per_unit.is_some() { 2 } else { self.knots.iter().map(Vec::len).product() }
    }

    /// Number of its columns.
    pub(super) fn columns(&self, elements: usize) -> usize {
        match (self.of_elements, &self.curve) {
            (true, Some(_)) => elements,
            (true, None) => elements * self.knots_each(),
            (false, _) => self.knots_each(),
        }
    }

    /// True if another acts on the same by the same.
    pub(super) fn is_like(&self, other: &Self) -> bool {
        self.carrier == other.carrier && self.covariates[0] == other.covariates[0]
    }
}
