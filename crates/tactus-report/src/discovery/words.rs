//! The verdict of a discovery in words.

use tactus_discover::{Discovery, Verdict};

use super::faulty;
use crate::numbers::{digits, short};
use crate::plot::number;

/// The verdict in a sentence or two, with its numbers.
pub fn in_words(found: &Discovery) -> String {
    let before = digits(found.base.heldout_rms_counts, 3);
    let after = digits(found.final_.level.heldout_rms_counts, 3);
    let noise = found.noise_rms_counts.map(|rms| digits(rms, 3));
    let added = list(found.steps.iter().map(|step| step.effect));
    let noise_is = noise.as_ref().map_or_else(
        || "the size of the noise is unknown".into(),
        |noise| format!("the noise is {noise} counts"),
    );
    let closed = found.final_.shrink.map_or_else(String::new, |share| {
        format!(", which closes {} of the gap between model and noise", percent(share))
    });
    let falls = if found.base == found.final_.level {
        format!("On held-out presses the residual is {before} counts rms; {noise_is}.")
    } else {
        format!(
            "On held-out presses the residual falls from {before} to {after} counts rms{closed}; {noise_is}."
        )
    };
    let verdict = match found.verdict {
        Verdict::NothingMissing => format!(
            "The model is missing no effect that these data can show: on held-out presses its residual is {before} counts rms and {noise_is}. \
             The probability of as much structure by noise alone is {}.",
            probability(found.global.p_value)
        ),
        Verdict::Explained => format!("The model was missing {added}. {falls}"),
        Verdict::PartlyExplained => format!(
            "The model was missing {added}, and something more that no known effect matches. {falls} {}",
            left(found)
        ),
        Verdict::Unexplained => format!(
            "The model is missing something that no known effect matches: on held-out presses its residual is {before} counts rms and \
             {noise_is}. {}",
            left(found)
        ),
    };
    [verdict].into_iter().chain(faulty::in_words(found)).collect::<Vec<_>>().join(" ")
}

/// The unexplained share, and the covariates on which it depends.
fn left(found: &Discovery) -> String {
    let share = percent(found.unexplained.share);
    match &found.unexplained.depends_on[..] {
        [] => format!("The remaining {share} of the gap depends on no covariate examined."),
        depends_on => {
            format!("The remaining {share} of the gap depends on {}.", list(depends_on.iter().copied()))
        }
    }
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

/// A probability within a sentence.
pub(super) fn probability(value: f64) -> String {
    if value < 1e-3 { "less than 0.001".into() } else { number(value, 3) }
}
