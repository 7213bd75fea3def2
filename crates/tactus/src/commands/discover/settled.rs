//! Drafts that a new measurement confirms or refutes.

use std::path::PathBuf;

use tactus_discover::{Confirmation, DiscoverError, Known};
use tactus_model::effect::Definition;
use tactus_report::discovery::closed;
use tactus_schema::DraftFile;
use tactus_schema::draft::{DraftConfirmation, DraftStatus};

use super::Discovered;
use super::measurements::Measurements;

/// A draft of which a new measurement has told whether it holds.
pub(super) struct Settled {
    pub(super) file: DraftFile,
    /// The draft as an effect, if it holds.
    pub(super) holding: Option<&'static Definition>,
    pub(super) in_words: String,
}

/// What new recordings say of the draft of a discovery; `None` if it has none, or if the recordings do not suffice to tell.
pub(super) fn settle(discovered: &Discovered, new: &[PathBuf]) -> anyhow::Result<Option<Settled>> {
    let Some(file) = discovered.draft()? else { return Ok(None) };
    let definition = file.define()?;
    let measured = Measurements::read(new)?;
    let known = Known { effects: discovered.discovery.effects.clone(), ..discovered.known.clone() };
    let told = match tactus_discover::confirm(&known, &measured.frames, definition, discovered.discovery.seed)
    {
        Ok(told) => told,
        Err(DiscoverError::TooLittle(_)) => return Ok(None),
        Err(error) => return Err(error.into()),
    };
    let status = if told.holds() { DraftStatus::Confirmed } else { DraftStatus::Refuted };
    let confirmation = DraftConfirmation {
        data: measured.data.iter().map(|source| (source.id.clone(), source.sha256.clone())).collect(),
        strength: told.strength,
        strength_se: told.strength_se,
        closed_share: told.closed.map(|closed| closed.share),
        closed_share_se: told.closed.and_then(|closed| closed.standard_error),
    };
    Ok(Some(Settled {
        in_words: in_words(&file.draft.name, status, &told),
        holding: told.holds().then_some(definition),
        file: DraftFile { status, confirmation: Some(confirmation), ..file },
    }))
}

fn in_words(name: &str, status: DraftStatus, told: &Confirmation) -> String {
    let Confirmation { strength, strength_se, closed: of_left, .. } = told;
    let error = strength_se.map_or_else(String::new, |error| format!(" +- {error:.3}"));
    let closes = of_left.map_or_else(
        || "nothing is left there without it".to_owned(),
        |of_left| format!("it closes {} of what is left there without it", closed(of_left)),
    );
    format!(
        "{name} is {}: in the new run its strength is {strength:.3}{error} of the drafted one, and {closes}.",
        status.name()
    )
}
