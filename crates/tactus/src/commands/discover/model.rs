//! The grown model of a discovery.

use tactus_discover::{AddedEffect, Discovery, DraftedEffect, Estimated};
use tactus_model::Effect;
use tactus_schema::Model;
use tactus_schema::model::{BaseModel, Evidence, KnownEffect};

use crate::commands::library::version;

/// The model with the discovered effects and the draft of what they leave, base and effects fitted jointly. Added effects have standard errors and name
/// their data; effects known before keep their evidence.
pub(super) fn grown(before: &Model, found: &Discovery, data: &str) -> Model {
    let draft = found.draft.as_ref().and_then(|draft| draft.as_ref().ok());
    let (of_found, of_effects) =
        draft.map_or((&found.grown, &found.effects), |draft| (&draft.base, &draft.effects));
    let base = BaseModel::of(before.base.array.clone(), of_found.psf, of_found.response.clone());
    let noise_rms_counts = found.floor.rms_counts().unwrap_or(before.base.noise_rms_counts);
    let effects = of_effects.iter().enumerate().map(|(nth, effect)| {
        if let Some(draft) = draft.filter(|draft| draft.draft.name == effect.name()) {
            return drafted(draft, effect, data);
        }
        let added = found.steps.iter().find_map(|step| Some((step, term(step, effect)?)));
        // A random walk of each element is one step with many effects.
        let is_part = |step: &&AddedEffect| nth >= before.effects.len() && step.effect == effect.name();
        let part = || found.steps.iter().find(is_part).map(|step| (step, &[][..]));
        let Some((step, term)) = added.or_else(part) else {
            let known = before.effects.get(nth).filter(|known| known.effect.name() == effect.name());
            return KnownEffect {
                effect: effect.clone(),
                standard_errors: [].into(),
                evidence: known.and_then(|known| known.evidence.clone()),
                version: version_of(effect),
            };
        };
        let errors =
            term.iter().filter_map(|one| Some((one.name.to_owned(), one.standard_error.filter(finite)?)));
        KnownEffect {
            effect: effect.clone(),
            standard_errors: errors.collect(),
            evidence: Some(Evidence {
                data: data.to_owned(),
                heldout_rms_before_counts: step.heldout_rms_before_counts,
                heldout_rms_after_counts: step.heldout_rms_after_counts,
            }),
            version: version_of(effect),
        }
    });
    Model { effects: effects.collect(), base: BaseModel { noise_rms_counts, ..base } }
}

/// A draft in a model, with what it closes.
fn drafted(draft: &DraftedEffect, effect: &Effect, data: &str) -> KnownEffect {
    KnownEffect {
        effect: effect.clone(),
        standard_errors: [].into(),
        evidence: Some(Evidence {
            data: data.to_owned(),
            heldout_rms_before_counts: draft.heldout_rms_before_counts,
            heldout_rms_after_counts: draft.heldout_rms_after_counts,
        }),
        version: version_of(effect),
    }
}

/// The version of an effect that is a draft. One that no file can hold has none: no model file can hold it either.
fn version_of(effect: &Effect) -> Option<String> {
    effect.definition().draft().and_then(|draft| version(draft).ok())
}

/// The term of a step that belongs to this effect.
fn term<'a>(step: &'a AddedEffect, effect: &Effect) -> Option<&'a [Estimated]> {
    // One with a table has hardly anything else.
    let is = |term: &&Vec<Estimated>| {
        !term.is_empty() && term.iter().all(|one| effect.value(one.name) == Some(one.value))
    };
    (step.effect == effect.name()).then(|| step.terms.iter().find(is)).flatten().map(Vec::as_slice)
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "as a filter gives it")]
fn finite(error: &f64) -> bool {
    error.is_finite()
}

#[cfg(test)]
#[path = "model_tests.rs"]
pub(super) mod tests;
