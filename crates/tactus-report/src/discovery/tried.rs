//! The effects tried in each round.

use std::fmt;

use tactus_discover::{Discovery, Round, TriedEffect};

use super::words::{list, percent};
use crate::{
    document::{Column, Table},
    markup::Text,
    numbers::{digits, probability},
};

pub(super) fn section(f: &mut fmt::Formatter<'_>, found: &Discovery) -> fmt::Result {
    writeln!(f, "<section>\n<h2>What was tried</h2>")?;
    if found.rounds.is_empty() {
        let why =
            if found.global.is_some() { "there is no structure to explain" } else { "nothing can be judged" };
        return writeln!(f, "<p>Nothing: {why}.</p>\n</section>");
    }
    writeln!(
        f,
        "<p class=\"lead\">In each round every effect that the data can show is scored on the fitted presses: would a small amount of it \
         reduce the residual? The best are then fitted jointly with the base model and the effects added before, and the one with the \
         greatest odds on the fitted presses is taken. The figures of held-out presses are for the reader; they choose nothing.</p>"
    )?;
    for (nth, round) in found.rounds.iter().enumerate() {
        self::round(f, nth + 1, round)?;
    }
    writeln!(f, "</section>")
}

fn round(f: &mut fmt::Formatter<'_>, nth: usize, round: &Round) -> fmt::Result {
    let with = if round.with.is_empty() {
        "the base model alone".into()
    } else {
        format!("the model has {}", list(&round.with))
    };
    writeln!(f, "<h3>Round {nth}: {}</h3>", Text(with))?;
    let (fitted, scored): (Vec<&TriedEffect>, Vec<&TriedEffect>) =
        round.candidates.iter().partition(|candidate| candidate.heldout_rms_counts.is_some());
    if !fitted.is_empty() {
        let mut table = Table::new(&[
            Column::Name("effect"),
            Column::Number("score"),
            Column::Number("p, corrected"),
            Column::Number("held out / counts rms"),
            Column::Number("gap closed"),
            Column::Name(""),
        ]);
        for candidate in fitted {
            let taken = if round.taken == Some(candidate.effect) { "taken" } else { "" };
            table.row([
                candidate.effect,
                &digits(candidate.score, 3),
                &probability(candidate.p_value),
                &candidate.heldout_rms_counts.map_or_else(|| "\u{2013}".into(), |rms| digits(rms, 3)),
                &candidate.shrink.map_or_else(|| "\u{2013}".into(), percent),
                taken,
            ]);
        }
        writeln!(f, "{table}")?;
    }
    if !scored.is_empty() {
        let scored = scored.iter().map(|candidate| {
            format!(
                "{} ({}, p {})",
                candidate.effect,
                digits(candidate.score, 2),
                probability(candidate.p_value)
            )
        });
        writeln!(f, "<p class=\"lead\">Scored only: {}.</p>", Text(list(scored)))?;
    }
    match round.taken {
        Some(_) => Ok(()),
        None => writeln!(f, "<p>None was taken.</p>"),
    }
}
