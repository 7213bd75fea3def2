//! A draft in words: one plain sentence.

use tactus_model::Covariate;
use tactus_model::effect::{Carrier, Draft, Law, When};

use super::grammar::Atom;
use super::sight::Sight;

/// The draft of an atom with this law.
pub(super) fn named(sight: &Sight, atom: &Atom, law: Law, name: &str) -> Draft {
    let ranges: Vec<[f64; 2]> =
        atom.covariates.iter().map(|one| sight.range((atom.carrier, atom.when, *one))).collect();
    let mut draft = Draft {
        name: name.to_owned(),
        sentence: String::new(),
        carrier: atom.carrier,
        when: atom.when,
        covariates: atom.covariates.clone(),
        ranges,
        law,
        weights: atom.weights.as_ref().map(|weights| weights.to_vec()),
    };
    draft.sentence = sentence(&draft);
    draft
}

/// A draft without its curve.
pub(super) fn of_atom(atom: &Atom) -> String {
    let covariates: Vec<&str> = atom.covariates.iter().map(|covariate| covariate.name()).collect();
    let kind = if atom.per_unit.is_some() { "a tone in" } else { "by" };
    format!("{} {}, {kind} {}", atom.carrier.name(), atom.when.name(), covariates.join(" and "))
}

/// What a draft is, in one sentence.
pub(super) fn sentence(draft: &Draft) -> String {
    let when = match draft.when {
        When::Always => "at all times",
        When::InContact => "while the tool touches",
        When::OutOfContact => "while the tool does not touch",
        When::OnTheWayDown => "above the surface on the way down",
        When::OnTheWayUp => "above the surface on the way up",
    };
    let what = match draft.carrier {
        Carrier::Depth => "the tip stands deeper by an amount",
        Carrier::X => "the tip stands further along x by an amount",
        Carrier::Y => "the tip stands further along y by an amount",
        Carrier::OwnSignal => "the signal changes by a share",
        Carrier::Neighbours => "a share of the neighbours' mean signal is added, a share",
        Carrier::EveryElement => "the same signal is added to every element, an amount",
        Carrier::PressHere => "the elements feel a press under the tip of a depth",
        Carrier::PressThere => "the elements feel a press at the last pressed place of a depth",
        Carrier::Counts => "counts are added, a number",
    };
    let names: Vec<&str> = draft.covariates.iter().map(|covariate| covariate.name()).collect();
    let own = if draft.weights.is_some() { ", with a weight for each element," } else { "" };
    let how = match &draft.law {
        Law::Linear { .. } => "in a straight line".to_owned(),
        Law::Power { exponent, .. } => format!("as its power {exponent:.2}"),
        Law::Exponential { length, .. } => {
            format!("falling off with a length of {} {}", number(*length, 3), unit(draft))
        }
        Law::Saturating { length, .. } => {
            format!("levelling off with a length of {} {}", number(*length, 3), unit(draft))
        }
        Law::Threshold { at, .. } => format!("at once from {} {} on", number(*at, 3), unit(draft)),
        Law::Periodic { per_unit, .. } => {
            format!("as a tone with a period of {} {}", number(1.0 / per_unit, 4), unit(draft))
        }
        Law::Logarithm { length, .. } => {
            format!("as a logarithm with a length of {} {}", number(*length, 3), unit(draft))
        }
        Law::Table { .. } => "along a free curve".to_owned(),
    };
    let [least, most] = extent(draft);
    let (scale, of) =
        if draft.carrier.unit() == "share" { (100.0, "%") } else { (1.0, draft.carrier.unit()) };
    let [least, most] = numbers([scale * least, scale * most]);
    if let Law::Linear { slope: 0.0, .. } = &draft.law {
        // With weights it is another constant for each element.
        let value = if least == most { least } else { format!("{least} to {most}") };
        return format!("{}, {what}{own} that is constant: {value} {of}", capital(when));
    }
    format!(
        "{}, {what}{own} that follows the {}, {how}: {least} to {most} {of}",
        capital(when),
        names.join(" and the "),
    )
}

/// The unit of the first covariate. A draft sees signals before the sensitivity, which others see in counts.
fn unit(draft: &Draft) -> &'static str {
    match draft.covariates.first() {
        Some(one) if one.needs_signals() && one.unit() == "mm" => "mm (times the sensitivity)",
        one => one.copied().map_or("", Covariate::unit),
    }
}

/// The least and the greatest value of a draft within the range of its data, of whichever element. A tone goes on, and has its whole amplitude
/// somewhere; any other law is least and greatest at the ends of its range, and a table at its places.
fn extent(draft: &Draft) -> [f64; 2] {
    let values: Vec<f64> = match &draft.law {
        Law::Table { values, .. } => values.clone(),
        Law::Periodic { offset, sine, cosine, .. } => {
            let amplitude = sine.hypot(*cosine);
            vec![offset - amplitude, offset + amplitude]
        }
        Law::Linear { .. }
        | Law::Power { .. }
        | Law::Exponential { .. }
        | Law::Saturating { .. }
        | Law::Threshold { .. }
        | Law::Logarithm { .. } => draft.ranges[0].iter().map(|end| draft.law.value(&[*end])).collect(),
    };
    let curve = ends(&values);
    let Some(weights) = &draft.weights else { return curve };
    let products = ends(weights).map(|weight| curve.map(|value| weight * value));
    ends(products.as_flattened())
}

fn ends(values: &[f64]) -> [f64; 2] {
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    [least, values.iter().copied().fold(f64::NEG_INFINITY, f64::max)]
}

/// A number with this many decimals; with more where it would have less than two digits.
fn number(value: f64, places: usize) -> String {
    let digits = decade(value);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from 0 to 12")]
    let least = (1.0 - digits).clamp(0.0, 12.0) as usize;
    format!("{value:.0$}", places.max(least))
}

/// The power of ten in which a number begins.
fn decade(value: f64) -> f64 {
    if value == 0.0 { 0.0 } else { value.abs().log10().floor() }
}

/// Both ends of a range with the same decimals: the larger one has three digits.
fn numbers(range: [f64; 2]) -> [String; 2] {
    let larger = range[0].abs().max(range[1].abs());
    let digits = decade(larger);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from 0 to 9")]
    let places = (2.0 - digits).clamp(0.0, 9.0) as usize;
    range.map(|end| {
        let told = format!("{end:.places$}");
        // A law that begins at 0 may end up a hair beside it.
        let is_zero = told.trim_start_matches('-').chars().all(|letter| matches!(letter, '0' | '.'));
        if is_zero { "0".into() } else { told }
    })
}

fn capital(words: &str) -> String {
    let mut letters = words.chars();
    letters
        .next()
        .map_or_else(String::new, |first| first.to_uppercase().collect::<String>() + letters.as_str())
}

#[cfg(test)]
#[path = "words_tests.rs"]
mod tests;
