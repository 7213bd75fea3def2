//! Drafts that a new measurement confirms or refutes.

use std::path::{Path, PathBuf};

use anyhow::Context;
use tactus_discover::{Confirmation, DiscoverError, Discovery, Known};
use tactus_model::Effect;
use tactus_model::effect::{Definition, EffectError};
use tactus_report::discovery::closed;
use tactus_schema::draft::{DraftConfirmation, DraftStatus};
use tactus_schema::{DraftFile, Model};

use super::measurements::Measurements;
use super::{Discovered, declared, known, of_array};
use crate::commands::library::Held;
use crate::exit::{Exit, Failure};

/// The parameter of a draft.
const STRENGTH: &str = "strength";

/// What a new measurement tells of a draft.
pub(super) struct Settled {
    /// The draft with its new status; `None` if the measurement does not suffice to tell.
    pub(super) file: Option<DraftFile>,
    /// Its file, if it is one of the lab's library.
    pub(super) held_at: Option<PathBuf>,
    pub(super) in_words: String,
}

/// What new recordings tell of the draft of a discovery, and of those of the library that it names and no measurement has confirmed yet.
pub(super) fn settle(
    discovered: &Discovered,
    unconfirmed: &[&Held],
    new: &[PathBuf],
) -> anyhow::Result<Vec<Settled>> {
    let own = discovered.draft()?.map(|file| (file, None));
    let held = unconfirmed.iter().map(|one| (one.draft.clone(), Some(one.path.clone())));
    let drafts: Vec<(DraftFile, Option<PathBuf>)> = own.into_iter().chain(held).collect();
    if drafts.is_empty() {
        return Ok(Vec::new());
    }
    let new = Measurements::read(new)?;
    let known = Known { effects: discovered.discovery.effects.clone(), ..discovered.known.clone() };
    let of = |(file, held_at): (DraftFile, Option<PathBuf>)| {
        let name = file.draft.name.clone();
        Ok(match measured_anew(file, &known, &new, discovered.discovery.seed)? {
            Ok((file, in_words)) => Settled { file: Some(file), held_at, in_words },
            Err(why) => {
                let in_words = format!("The new run is too short to tell whether {name} holds: {why}.");
                Settled { file: None, held_at, in_words }
            }
        })
    };
    drafts.into_iter().map(of).collect()
}

/// What recordings that a draft was not drafted from tell of it, beside the effects of a model: the draft with its new status, and a sentence.
///
/// # Errors
/// If the recordings cannot be read, are those that it was drafted from, do not suffice, or are of another array than the model.
pub(in crate::commands) fn confirm(
    file: &DraftFile,
    recordings: &[PathBuf],
    model: Option<&Path>,
    seed: u64,
) -> anyhow::Result<(DraftFile, String)> {
    let usage = |what: String| Failure::new(Exit::Usage, what);
    let model = model.map(|path| Ok::<_, anyhow::Error>((path, declared(path)?))).transpose()?;
    let new = Measurements::read(recordings)?;
    let seen = file.evidence.iter().flat_map(|seen| seen.data.values());
    for sha256 in seen {
        if let Some(old) = new.data.iter().find(|source| source.sha256 == *sha256) {
            let (name, run) = (&file.draft.name, &old.id);
            return Err(
                usage(format!("{name} was drafted from {run}: name recordings that are new to it")).into()
            );
        }
    }
    let model = match model {
        Some((path, model)) => of_array(model, Some(path), &new.rig.array)?,
        None => Model::of_rig(&new.rig).context("the rig's reference indenter is not among its tools")?,
    };
    let name = file.draft.name.clone();
    let told = measured_anew(file.clone(), &known(&new.rig, &model, Vec::new()), &new, seed)?;
    let too_short = |why| usage(format!("the recordings are too short to tell whether {name} holds: {why}"));
    Ok(told.map_err(too_short)?)
}

/// Compares a draft with new data; the model may have it already. `Err` says why they do not suffice.
fn measured_anew(
    file: DraftFile,
    known: &Known,
    new: &Measurements,
    seed: u64,
) -> anyhow::Result<Result<(DraftFile, String), String>> {
    let mut without = known.clone();
    without.effects.retain(|effect| effect.name() != file.draft.name);
    let told = match tactus_discover::confirm(&without, &new.frames, file.define()?, seed) {
        Ok(told) => told,
        Err(DiscoverError::TooLittle(why)) => return Ok(Err(why.to_string())),
        Err(error) => return Err(error.into()),
    };
    let status = match told.holds() {
        Some(true) => DraftStatus::Confirmed,
        Some(false) => DraftStatus::Refuted,
        None => return Ok(Err(format!("{}, which may be enough or not", closes(&told)))),
    };
    let confirmation = DraftConfirmation {
        data: new.data.iter().map(|source| (source.id.clone(), source.sha256.clone())).collect(),
        strength: told.strength,
        strength_se: told.strength_se,
        closed_share: told.closed.map(|closed| closed.share),
        closed_share_se: told.closed.and_then(|closed| closed.standard_error),
    };
    let in_words = in_words(&file.draft.name, status, &told);
    Ok(Ok((DraftFile { status, confirmation: Some(confirmation), ..file }, in_words)))
}

/// Gives the draft of a discovery another number if its name is that of a draft which was refuted before. `drafts` are those that were tried.
///
/// # Errors
/// If the draft is no effect, which a discovery rules out.
pub(super) fn renumber(
    found: &mut Discovery,
    refuted: &[String],
    drafts: &[&'static Definition],
) -> Result<(), EffectError> {
    let Some(Ok(drafted)) = &mut found.draft else { return Ok(()) };
    if !refuted.contains(&drafted.draft.name) {
        return Ok(());
    }
    let is_taken = |name: &String| {
        let known = drafted.effects.iter().map(Effect::name).chain(drafts.iter().map(|one| one.name));
        refuted.contains(name) || known.into_iter().any(|known| known == name)
    };
    let free = (1..=u32::MAX).map(|number| format!("draft-{number}")).find(|name| !is_taken(name));
    let name = free.unwrap_or_default();
    let old = std::mem::replace(&mut drafted.draft.name, name.clone());
    let definition = drafted.draft.clone().define()?;
    for effect in drafted.effects.iter_mut().filter(|effect| effect.name() == old) {
        *effect = Effect::neutral(definition).with(STRENGTH, effect.value(STRENGTH).unwrap_or(1.0))?;
    }
    let next = found.plan.next.iter_mut().map(|next| &mut next.separates);
    let open = found.plan.open.iter_mut().map(|open| &mut open.separates);
    for one in next.chain(open).flatten().filter(|one| **one == old) {
        one.clone_from(&name);
    }
    Ok(())
}

fn in_words(name: &str, status: DraftStatus, told: &Confirmation) -> String {
    let Confirmation { strength, strength_se, .. } = told;
    let error = strength_se.map_or_else(String::new, |error| format!(" +- {error:.3}"));
    format!(
        "{name} is {}: in the new run its strength is {strength:.3}{error} of the drafted one, and {}.",
        status.name(),
        closes(told)
    )
}

fn closes(told: &Confirmation) -> String {
    told.closed.map_or_else(
        || "nothing is left there without it".to_owned(),
        |of_left| format!("it closes {} of what is left there without it", closed(of_left)),
    )
}

#[cfg(test)]
#[path = "settled_tests.rs"]
mod tests;
