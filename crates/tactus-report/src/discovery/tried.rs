//! The effects tried in each round.

use std::fmt;

use tactus_discover::{Discovery, Round, TriedEffect};

use super::words::{list, percent, would_close};
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
        self::round(f, nth + 1, round, found)?;
    }
    given_up(f, found)?;
    writeln!(f, "</section>")
}

/// The effects that were fitted and are not in the model.
fn given_up(f: &mut fmt::Formatter<'_>, found: &Discovery) -> fmt::Result {
    if found.given_up.is_empty() {
        return Ok(());
    }
    writeln!(f, "<h3>Given up</h3>\n<ul>")?;
    for one in &found.given_up {
        let closes = would_close(found, one).map_or_else(String::new, |share| {
            format!(", though it would close {} of the gap", percent(share))
        });
        writeln!(f, "<li>{}{closes}: {}.</li>", Text(one.effect), Text(one.in_words()))?;
    }
    writeln!(f, "</ul>")
}

fn round(f: &mut fmt::Formatter<'_>, nth: usize, round: &Round, found: &Discovery) -> fmt::Result {
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
            Column::Number("held out / noise"),
            Column::Number("gap closed"),
            Column::Name(""),
        ]);
        for candidate in fitted {
            let is_kept = found.steps.iter().any(|step| step.effect == candidate.effect);
            let taken = match (round.taken == Some(candidate.effect), is_kept) {
                (true, true) => "taken",
                (true, false) => "taken, given up later",
                (false, _) => "",
            };
            let or_dash = |value: Option<f64>| value.map_or_else(|| "\u{2013}".into(), |rms| digits(rms, 3));
            let rms = candidate.heldout_rms_counts;
            table.row([
                candidate.effect,
                &digits(candidate.score, 3),
                &probability(candidate.p_value),
                &or_dash(rms),
                &or_dash(rms.zip(found.floor.rms_counts()).map(|(rms, noise)| rms / noise)),
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
