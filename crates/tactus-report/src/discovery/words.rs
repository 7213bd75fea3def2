//! The verdict of a discovery in words.

use tactus_discover::{AddedEffect, Closed, Discovery, Floor, GivenUp, Verdict};

use super::active::command;
use super::faulty;
use crate::numbers::{digits, short};
use crate::plot::number;

/// An effect that was given up and would close this share of the gap is told in the verdict.
const CLOSES_MUCH: f64 = 0.5;

/// What a fit shows and is no name, and why.
fn tentative(found: &Discovery) -> Option<String> {
    let why = |effect: &str| {
        let known = found.given_up.iter().rfind(|one| one.effect == effect);
        known.map_or_else(|| UNCONFIRMED.to_owned(), GivenUp::in_words)
    };
    let of = |step: &AddedEffect| format!("Tentative: {}: {}.", step.effect, why(step.effect));
    let each: Vec<String> = found.tentative.iter().map(of).collect();
    (!each.is_empty()).then(|| each.join(" "))
}

/// Said of a tentative effect that is in the model as well.
const UNCONFIRMED: &str = "presses that its fit has not seen do not confirm it";

/// What was drafted of what no known effect explains.
fn drafted(found: &Discovery) -> Option<String> {
    let Some(Ok(one)) = &found.draft else { return None };
    let closes = one.closed.map_or_else(
        || "nothing is left on held-out presses".to_owned(),
        |of_left| format!("it closes {} of what is left", closed(of_left)),
    );
    Some(format!("It is drafted as {}: {}; {closes}.", one.draft.name, one.draft.sentence))
}

/// The verdict in a sentence or two, with its numbers.
pub fn in_words(found: &Discovery) -> String {
    let before = digits(found.base.heldout_rms_counts, 3);
    let after = digits(found.final_.level.heldout_rms_counts, 3);
    let added = list(found.steps.iter().map(|step| step.effect));
    let noise_is = found.floor.rms_counts().map_or_else(
        || "the size of the noise is unknown".into(),
        |noise| format!("the noise is {} counts, from {}", digits(noise, 3), found.floor.source()),
    );
    let bound = bound(found);
    let closed = found.final_.closed.map_or_else(String::new, |of_gap| {
        format!(", which closes {} of the gap between model and noise", closed(of_gap))
    });
    let falls = if found.base == found.final_.level {
        format!("On held-out presses the residual is {before} counts rms; {noise_is}.")
    } else {
        format!(
            "On held-out presses the residual falls from {before} to {after} counts rms{closed}; {noise_is}."
        )
    };
    let verdict = match found.verdict {
        Verdict::CannotJudge if found.floor == Floor::None => format!(
            "Nothing can be judged: no frame and no press of these data repeats another, so noise and missing physics look the same. On \
             held-out presses the residual is {before} counts rms. Give a run that rests and repeats a press together with these data{}.",
            runs(found)
        ),
        Verdict::CannotJudge => format!(
            "Nothing can be judged: these data show too little. No test finds an effect, but more than twice the noise may be missing. On \
             held-out presses the residual is {before} counts rms; {noise_is}.{bound} More presses, and presses that repeat each other, \
             would tell{}.",
            runs(found)
        ),
        Verdict::NothingMissing => format!(
            "The model is missing no effect that these data can show: on held-out presses its residual is {before} counts rms and {noise_is}. \
             The probability of as much structure by noise alone is {}.{bound}",
            found.global.map_or_else(|| "unknown".into(), |global| probability(global.p_value))
        ),
        Verdict::Explained => format!("The model was missing {added}. {falls}{bound}{}", tolerance(found)),
        Verdict::PartlyExplained => format!(
            "The model was missing {added}, and something more that no known effect matches. {falls}{bound} {}",
            left(found)
        ),
        Verdict::Unexplained => format!(
            "The model is missing something that no known effect matches: on held-out presses its residual is {before} counts rms and \
             {noise_is}.{bound} {}{}",
            left(found),
            nearest(found)
        ),
    };
    [verdict]
        .into_iter()
        .chain(drafted(found))
        .chain(tentative(found))
        .chain(faulty::in_words(found))
        .collect::<Vec<_>>()
        .join(" ")
}

/// What is structured in the grown model's residual.
fn bound(found: &Discovery) -> String {
    let (Some(part), Some(noise)) = (found.final_.level.structured, found.floor.rms_counts()) else {
        return String::new();
    };
    let among = if part.with_signal { "readings with a signal" } else { "all readings" };
    if !part.upper_noise.is_finite() {
        return format!(" How much of it is not noise has no bound: too few presses are held out ({among}).");
    }
    let both = |times_noise: f64| {
        format!("{} times the noise ({} counts)", digits(times_noise, 2), digits(times_noise * noise, 2))
    };
    format!(
        " Of {among}, {} is not noise; with 95 % confidence it is at most {}.",
        both(part.rms_noise),
        both(part.upper_noise)
    )
}

/// The tolerance, if one was declared.
fn tolerance(found: &Discovery) -> String {
    let of = |counts: f64| {
        format!(" A structured residual of {} counts was declared tolerable beforehand.", digits(counts, 3))
    };
    found.tolerance_counts.map_or_else(String::new, of)
}

/// The first proposed experiment.
fn runs(found: &Discovery) -> String {
    found.plan.next.first().map_or_else(String::new, |next| {
        format!(", such as `{}`", command(&next.experiment, &next.parameters))
    })
}

/// The covariates on which what is left depends. How much that is, is told before.
fn left(found: &Discovery) -> String {
    match &found.unexplained.depends_on[..] {
        [] => "What is left depends on no covariate examined.".to_owned(),
        depends_on => format!("What is left depends on {}.", list(depends_on.iter().copied())),
    }
}

/// The share of the gap that an effect which was given up would close: the greatest of the rounds that fitted it.
pub(super) fn would_close(found: &Discovery, one: &GivenUp) -> Option<f64> {
    let tried = found.rounds.iter().flat_map(|round| &round.candidates);
    tried.filter(|tried| tried.effect == one.effect).filter_map(|tried| tried.shrink).reduce(f64::max)
}

/// The effect that was given up although it would close most of the gap, if one would close much.
fn nearest(found: &Discovery) -> String {
    let known = found.given_up.iter().filter_map(|one| Some((one, would_close(found, one)?)));
    known.filter(|(_, share)| *share >= CLOSES_MUCH).max_by(|a, b| a.1.total_cmp(&b.1)).map_or_else(
        String::new,
        |(one, share)| {
            format!(
                " {} would close {} of it, but is not named: {}.",
                one.effect,
                percent(share),
                one.in_words()
            )
        },
    )
}

/// `a`, `a and b`, `a, b and c`.
pub(super) fn list<T: AsRef<str>>(names: impl IntoIterator<Item = T>) -> String {
    let names: Vec<T> = names.into_iter().collect();
    let mut text = String::new();
    for (nth, name) in names.iter().enumerate() {
        text.push_str(match nth {
            0 => "",
            nth if nth + 1 == names.len() => " and ",
            _ => ", ",
        });
        text.push_str(name.as_ref());
    }
    text
}

/// `97 %`, `99.2 %`: one decimal near 0 % and 100 %.
pub(super) fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    format!("{} %", short(percent, usize::from((percent - 100.0).abs() < 2.0 || percent.abs() < 2.0)))
}

/// Such as `83 % +- 6 %` or `99.96 % +- 0.03 %`.
pub fn closed(of_gap: Closed) -> String {
    let (share, error) = closed_and_error(of_gap);
    error.map_or_else(|| share.clone(), |error| format!("{share} +- {error}"))
}

/// The share and its error: the error has one digit at least, and the share as many decimals.
pub(super) fn closed_and_error(Closed { share, standard_error, .. }: Closed) -> (String, Option<String>) {
    let Some(error) = standard_error else { return (percent(share), None) };
    let places = if error < 0.000_95 { 2 } else { usize::from(error < 0.0095) };
    let in_percent = |share: f64| format!("{} %", short(share, places));
    (in_percent(100.0 * share), Some(in_percent((100.0 * error).max(0.01))))
}

/// A residual in counts and in units of the noise.
pub(super) fn level(rms_counts: f64, noise_counts: Option<f64>) -> String {
    let in_noise = noise_counts
        .map_or_else(String::new, |noise| format!(", {} times the noise", digits(rms_counts / noise, 3)));
    format!("{} counts rms{in_noise}", digits(rms_counts, 3))
}

/// A probability within a sentence.
pub(super) fn probability(value: f64) -> String {
    if value < 1e-3 { "less than 0.001".into() } else { number(value, 3) }
}
