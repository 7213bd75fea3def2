//! Where a scene leaves the range of the data that a draft was drafted from.

use tactus_model::effect::Draft;

use tactus_model::{Contact, Covariate, Seen, Trace};

use super::scene::Scene;

/// A value is beyond a range if it is by more than this share of the range.
const BEYOND: f64 = 0.01;

/// Names of the effects of a scene's model.
pub(super) fn effects(scene: &Scene) -> Vec<&'static str> {
    scene.simulator.effects.iter().map(tactus_model::Effect::name).collect()
}

/// A note for each draft and each of its covariates that a contact takes beyond the data from which it was drafted. There the curve keeps its
/// last value.
pub(super) fn notes(scene: &Scene, contact: &Contact, counts: &[f64]) -> Vec<String> {
    let drafts = scene.simulator.effects.iter().filter_map(|effect| effect.definition().draft());
    let drafts: Vec<&Draft> = drafts.collect();
    if drafts.is_empty() {
        return Vec::new();
    }
    let mut signal_mm = vec![0.0; scene.array().elements()];
    scene.simulator.model.indentation(contact, scene.simulator.covering, &mut signal_mm);
    let mut trace = Trace::default();
    trace.take(0.0, contact.position_mm, contact.depth_mm, None);
    let seen = Seen { trace: &trace, array: scene.array(), signal_mm: &signal_mm, counts };
    let of_draft = |draft: &&Draft| {
        let ranges = draft.covariates.iter().zip(&draft.ranges);
        let name = draft.name.clone();
        ranges
            .filter_map(move |(covariate, range)| beyond(&name, *covariate, *range, seen))
            .collect::<Vec<_>>()
    };
    drafts.iter().flat_map(of_draft).collect()
}

/// A note if a covariate is beyond its range for some element.
fn beyond(name: &str, covariate: Covariate, [least, most]: [f64; 2], seen: Seen<'_>) -> Option<String> {
    if !is_of_a_still_tool(covariate) {
        return None;
    }
    let elements = if covariate.is_of_element() { seen.array.elements() } else { 1 };
    let values = (0..elements).filter_map(|element| covariate.value(seen, element));
    let [lowest, highest] = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[lowest, highest], value| {
        [lowest.min(value), highest.max(value)]
    });
    let margin = BEYOND * (most - least);
    let (what, unit) = (covariate.name(), covariate.unit());
    if highest > most + margin {
        Some(format!(
            "{name} was drafted up to a {what} of {most:.3} {unit}; here it is {highest:.3}: the curve goes on as a constant"
        ))
    } else if lowest < least - margin {
        Some(format!(
            "{name} was drafted from a {what} of {least:.3} {unit} on; here it is {lowest:.3}: the curve begins as a constant"
        ))
    } else {
        None
    }
}

/// True of what one image tells. Times, speeds and what was before belong to a run.
fn is_of_a_still_tool(covariate: Covariate) -> bool {
    match covariate {
        Covariate::Depth
        | Covariate::Height
        | Covariate::PlaceX
        | Covariate::PlaceY
        | Covariate::InElementX
        | Covariate::InElementY
        | Covariate::SumOfSignals
        | Covariate::Signal
        | Covariate::ShareOfLargest
        | Covariate::Distance
        | Covariate::Counts => true,
        Covariate::Time
        | Covariate::SinceContact
        | Covariate::SinceRelease
        | Covariate::SinceTurn
        | Covariate::DeepestBefore
        | Covariate::Direction
        | Covariate::ApproachX
        | Covariate::ApproachY
        | Covariate::Speed
        | Covariate::TravelSpeed
        | Covariate::Travel
        | Covariate::Press
        | Covariate::Temperature
        | Covariate::Ahead => false,
    }
}
