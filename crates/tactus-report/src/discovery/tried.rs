//! The effects tried in each round.

use std::fmt;

use tactus_discover::{Because, Discovery, Round, TriedEffect, rival_in_words};

use super::words::{WouldClose, because, list, percent};
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
         greatest odds on the fitted presses is taken. The last figures are of held-out presses and of the whole model with the effect; they are for the reader, and choose nothing.</p>"
    )?;
    for nth in 0..found.rounds.len() {
        round(f, nth, found)?;
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
        let closes = WouldClose::of(found, one.effect);
        let closes = closes.map_or_else(String::new, |closes| format!(" ({})", closes.in_words()));
        writeln!(f, "<li>{}: {}{}.</li>", Text(one.effect), Text(because(one)), Text(closes))?;
    }
    writeln!(f, "</ul>")
}

/// What a round that begins again from a smaller model says of that; `None` of one that goes on with the model of the round before.
fn anew(found: &Discovery, nth: usize) -> Option<String> {
    let model = |round: &Round| round.with.iter().copied().chain(round.taken).collect::<Vec<_>>();
    let before = found.rounds.get(nth.checked_sub(1)?)?;
    let goes_on = model(before).iter().all(|effect| found.rounds[nth].with.contains(effect));
    if before.taken.is_some() && goes_on {
        return None;
    }
    let ends = found.rounds[nth..].iter().position(|round| round.taken.is_none());
    let end = ends.map_or(found.rounds.len(), |ends| nth + ends + 1);
    let now: Vec<&str> = found.rounds[nth..end].iter().flat_map(model).collect();
    let without: Vec<&str> = model(before).into_iter().filter(|effect| !now.contains(effect)).collect();
    if without.is_empty() {
        return Some("The search begins anew.".into());
    }
    let has_rival = |effect: &&str| {
        let one = found.given_up.iter().find(|one| one.effect == *effect);
        one.is_some_and(|one| matches!(one.because, Because::Rival(_) | Because::NearestForm(_)))
    };
    let why = if without.iter().all(has_rival) { ", which a rival took over" } else { "" };
    Some(format!("The search begins anew, without {}{why}.", list(&without)))
}

/// What became of an effect that a round fitted.
fn fate(round: &Round, effect: &str, found: &Discovery) -> String {
    match round.taken {
        Some(taken) if taken != effect => format!("not taken: {taken} has greater odds"),
        Some(_) if found.steps.iter().any(|step| step.effect == effect) => "taken".into(),
        Some(_) => "taken, given up later".into(),
        None => round.rival.map_or_else(
            || "not taken".to_owned(),
            |rival| format!("not taken: {}, which has no name, explains more", rival_in_words(rival)),
        ),
    }
}

fn round(f: &mut fmt::Formatter<'_>, nth: usize, found: &Discovery) -> fmt::Result {
    let round = &found.rounds[nth];
    let with = if round.with.is_empty() {
        "the base model alone".into()
    } else {
        format!("the model has {}", list(&round.with))
    };
    writeln!(f, "<h3>Round {}: {}</h3>", nth + 1, Text(with))?;
    if let Some(anew) = anew(found, nth) {
        writeln!(f, "<p>{}</p>", Text(anew))?;
    }
    let (fitted, scored): (Vec<&TriedEffect>, Vec<&TriedEffect>) =
        round.candidates.iter().partition(|candidate| candidate.heldout_rms_counts.is_some());
    let is_any = !fitted.is_empty();
    if is_any {
        let mut table = Table::new(&[
            Column::Name("effect"),
            Column::Number("score"),
            Column::Number("p, corrected"),
            Column::Number("with it / counts rms"),
            Column::Number("with it / noise"),
            Column::Number("closed with it, by mean squares"),
            Column::Prose(""),
        ]);
        for candidate in fitted {
            let or_dash = |value: Option<f64>| value.map_or_else(|| "\u{2013}".into(), |rms| digits(rms, 3));
            let rms = candidate.heldout_rms_counts;
            table.row([
                candidate.effect,
                &digits(candidate.score, 3),
                &probability(candidate.p_value),
                &or_dash(rms),
                &or_dash(rms.zip(found.floor.rms_counts()).map(|(rms, noise)| rms / noise)),
                &candidate.shrink.map_or_else(|| "\u{2013}".into(), percent),
                &fate(round, candidate.effect, found),
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
    match (round.taken, round.rival) {
        (Some(_), _) => Ok(()),
        (None, Some(rival)) => {
            let rival = rival_in_words(rival);
            writeln!(f, "<p>None was taken: {}, which has no name, explains more.</p>", Text(rival))
        }
        (None, None) if is_any => writeln!(f, "<p>None was taken: none of them raises the odds enough.</p>"),
        (None, None) => writeln!(f, "<p>None was fitted, so none was taken.</p>"),
    }
}
