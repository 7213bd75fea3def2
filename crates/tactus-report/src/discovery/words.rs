//! The verdict of a discovery in words.

use tactus_discover::{
    AddedEffect, Because, Closed, Discovery, Estimated, FittedCurve, FittedKnot, Floor, GivenUp, NoDraft,
    Round, Verdict,
};
use tactus_model::Effect;
use tactus_model::effect::{Definition, ParameterKind};

use super::active::command;
use super::faulty;
use crate::numbers::{digits, short};
use crate::plot::number;

/// An effect that was given up and alone would close this share of the gap is told in the verdict.
const CLOSES_MUCH: f64 = 0.5;
/// A share below this one rounds to no percent.
const SHARE_LEAST: f64 = 0.000_5;
/// After `closes`, of a share that is 0 or below.
const NOTHING: &str = "nothing";
/// Covariates that a sentence names.
const NAMED_MOST: usize = 3;
/// A parameter nearer to the end of its range than this share of it is at its end.
const BOUND_SHARE: f64 = 1e-3;

/// What a fit shows and is no name, and why.
fn tentative(found: &Discovery) -> Option<String> {
    let why = |effect: &str| {
        let known = found.given_up.iter().rfind(|one| one.effect == effect);
        known.map_or_else(|| UNCONFIRMED.to_owned(), because)
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
    let added = list(found.steps.iter().map(or_others));
    let noise_is = found.floor.rms_counts().map_or_else(
        || "the size of the noise is unknown".into(),
        |noise| format!("the noise is {} counts, from {}", digits(noise, 3), found.floor.source()),
    );
    let bound = bound(found);
    let falls = falls(found, [&before, &after], &noise_is);
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
            "The model was missing {added}, and something more {}. {falls}{bound} {}",
            unmatched(found),
            left(found)
        ),
        Verdict::Unexplained => format!(
            "The model is missing something {}: on held-out presses its residual is {before} counts rms and \
             {noise_is}.{bound} {}{}",
            unmatched(found),
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

/// What the added effects do to the residual on held-out presses, from the base model to the grown one.
fn falls(found: &Discovery, [before, after]: [&str; 2], noise_is: &str) -> String {
    let Discovery { base, final_, steps, .. } = found;
    if *base == final_.level {
        return format!("On held-out presses the residual is {before} counts rms; {noise_is}.");
    }
    let goes = if before == after {
        format!("stays at {after}")
    } else if final_.level.heldout_rms_counts < base.heldout_rms_counts {
        format!("falls from {before} to {after}")
    } else {
        format!("goes from {before} to {after}")
    };
    let closes = match final_.closed.map(closed) {
        Some(share) if share == NOTHING => {
            let them = if steps.len() == 1 { "it" } else { "them" };
            format!(": held-out presses do not show {them}")
        }
        Some(share) => format!(", which closes {share} of the gap between model and noise"),
        None => String::new(),
    };
    format!("On held-out presses the residual {goes} counts rms{closes}; {noise_is}.")
}

/// How near the library comes to what is missing.
fn unmatched(found: &Discovery) -> String {
    match &found.draft {
        Some(Err(NoDraft::Class(class))) => {
            format!("that no effect explains well enough (the nearest is {class})")
        }
        Some(_) | None => "that no known effect matches".into(),
    }
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

/// What is left, and on what it depends. How much that is, is told before.
fn left(found: &Discovery) -> String {
    if found.unexplained.depends_on.is_empty() {
        return "What is left depends on no covariate examined.".to_owned();
    }
    format!("What is left depends on {}.", depends_on(found))
}

/// The covariates on which what is left depends: the three with the largest dependence, those that are not in its table, and how many
/// others there are.
pub(super) fn depends_on(found: &Discovery) -> String {
    let left = &found.unexplained;
    let is_named = |(nth, name): &(usize, &&str)| {
        *nth < NAMED_MOST || left.gap.iter().all(|gap| gap.covariate != **name)
    };
    let named = left.depends_on.iter().enumerate().filter(is_named).map(|(_, name)| (*name).to_owned());
    let mut named: Vec<String> = named.collect();
    let more = left.depends_on.len() - named.len();
    if more > 0 {
        named.push(format!("{more} more (in the table of the report)"));
    }
    list(named)
}

/// The share of the gap that an effect closes on presses that its fit has not seen, if it was given up for that.
pub(super) fn closed_share(one: &GivenUp) -> Option<f64> {
    match one.because {
        Because::Far(share) => Some(share),
        Because::Rival(_)
        | Because::NearestForm(_)
        | Because::Little
        | Because::Other(_)
        | Because::Unconfirmed
        | Because::Draft => None,
    }
}

/// Why an effect was given up, as a clause.
pub(super) fn because(one: &GivenUp) -> String {
    // The clause has the share, which would be told as 0 or less.
    if closed_share(one).is_some_and(|share| share < 0.005) {
        return "it comes nearest, and closes nothing of the gap on presses that its fit has not seen: an effect closes more of its own physics"
            .into();
    }
    one.in_words()
}

/// What a fitted effect closes of the gap on held-out presses, by mean squares.
pub(super) enum WouldClose<'a> {
    /// By itself.
    Alone(f64),
    /// Together with others.
    With {
        /// The others.
        others: &'a [&'static str],
        /// What it closes with them.
        share: f64,
        /// What they close without it, if they were fitted so.
        without: Option<f64>,
    },
}

impl<'a> WouldClose<'a> {
    /// What an effect would close: by itself, if it was fitted so, else with the others beside which it closes most. `None` if no round
    /// fitted it.
    pub(super) fn of(found: &'a Discovery, effect: &str) -> Option<Self> {
        let tried = |round: &'a Round| Some((&round.with[..], shrink(round, effect)?));
        let tried: Vec<(&[&str], f64)> = found.rounds.iter().filter_map(tried).collect();
        let most = |is_alone: bool| {
            let of = tried.iter().filter(|(with, _)| with.is_empty() == is_alone);
            of.copied().max_by(|a, b| a.1.total_cmp(&b.1))
        };
        if let Some((_, share)) = most(true) {
            return Some(Self::Alone(share));
        }
        let (others, share) = most(false)?;
        Some(Self::With { others, share, without: closed_by(found, others) })
    }

    /// Such as `alone it would close 35 % of the gap`.
    pub(super) fn in_words(&self) -> String {
        match self {
            Self::Alone(share) => format!("alone it would close {} of the gap", closes(*share)),
            Self::With { others, share, without } => {
                let they_do = match others {
                    [one] => format!("{one} does"),
                    _ => "they do".to_owned(),
                };
                let points = without.map(|without| (100.0 * share).round() - (100.0 * without).round());
                let more = points.map_or_else(String::new, |points| match points {
                    1.0.. => format!(", {} more than {they_do}", in_points(points)),
                    ..=-1.0 => format!(", {} less than {they_do}", in_points(-points)),
                    _ => format!(", no more than {they_do}"),
                });
                format!("with {} it closes {} of the gap{more}", list(*others), closes(*share))
            }
        }
    }
}

/// Such as `2 points`.
fn in_points(points: f64) -> String {
    format!("{} point{}", short(points, 0), if points > 1.0 { "s" } else { "" })
}

/// The share of the gap that an effect closes with what the model has in a round, if it was fitted there.
fn shrink(round: &Round, effect: &str) -> Option<f64> {
    round.candidates.iter().find(|tried| tried.effect == effect)?.shrink
}

/// The share of the gap that these effects close together, if a round fitted them so.
fn closed_by(found: &Discovery, effects: &[&str]) -> Option<f64> {
    found.rounds.iter().filter(|round| round.with.len() + 1 == effects.len()).find_map(|round| {
        let last = effects.iter().find(|effect| !round.with.contains(effect))?;
        let is_rest = round.with.iter().all(|with| effects.contains(with));
        is_rest.then(|| shrink(round, last)).flatten()
    })
}

/// The effect that was given up although it alone would close most of the gap, if one would close much.
fn nearest(found: &Discovery) -> String {
    let known = found.given_up.iter().filter_map(|one| match WouldClose::of(found, one.effect)? {
        WouldClose::Alone(share) => Some((one, share)),
        WouldClose::With { .. } => None,
    });
    known.filter(|(_, share)| *share >= CLOSES_MUCH).max_by(|a, b| a.1.total_cmp(&b.1)).map_or_else(
        String::new,
        |(one, share)| {
            format!(
                " {} alone would close {} of it, but is not named: {}.",
                one.effect,
                percent(share),
                because(one)
            )
        },
    )
}

/// An added effect with those that the data cannot distinguish from it, such as `hardening (or softening)`.
fn or_others(step: &AddedEffect) -> String {
    if step.equivalent.is_empty() {
        return step.effect.to_owned();
    }
    format!("{} (or {})", step.effect, either(&step.equivalent))
}

/// The model of which residuals are told beside those of the base model. The model file has the draft as well.
pub(super) fn grown_model(found: &Discovery) -> &'static str {
    match &found.draft {
        Some(Ok(_)) => "grown model without the draft",
        Some(Err(_)) | None => "grown model",
    }
}

/// The definition of an added effect; `None` of a random walk, which is no effect of the model. A draft is in no registry.
pub fn definition(found: &Discovery, step: &AddedEffect) -> Option<&'static Definition> {
    let own = found.effects.iter().find(|effect| effect.name() == step.effect).map(Effect::definition);
    own.or_else(|| Definition::find(step.effect).ok())
}

/// The parameters, knots and tables of an added effect that are at the end of their range, that the data hardly determine, or of which no error is
/// known; a sentence each.
pub fn flags(found: &Discovery, step: &AddedEffect) -> Vec<String> {
    let Some(definition) = definition(found, step) else { return Vec::new() };
    let of_parameters = step.terms.iter().flatten().filter_map(|parameter| flag(definition, parameter));
    let of_curves = step.curves.iter().flat_map(|curve| flags_of_curve(definition, curve));
    let mut flags: Vec<String> = Vec::new();
    for said in of_parameters.chain(of_curves) {
        // Terms of one effect may say the same.
        if !flags.contains(&said) {
            flags.push(said);
        }
    }
    flags
}

/// Effects that are no fit: calibration and the converter's codes tell them.
const FAULTS: [&str; 2] = ["miswired", "quantisation"];

fn flag(definition: &Definition, found: &Estimated) -> Option<String> {
    let known = definition.parameters.iter().find(|known| known.name == found.name)?;
    let Estimated { name, value, standard_error } = *found;
    // A number of counts has no bound.
    let slack = if known.is_counts() { 0.0 } else { BOUND_SHARE * (known.range[1] - known.range[0]) };
    let is_neutral = (value - known.neutral).abs() <= slack;
    let is_at_end = known.range.into_iter().any(|end| (value - end).abs() <= slack);
    let Some(error) = standard_error else {
        let is_fitted = known.kind == ParameterKind::Real && !FAULTS.contains(&definition.name);
        // A neutral one may have been left so.
        return (is_fitted && !is_neutral).then(|| {
            let open = || format!("{name}: no error is known, so these data may hardly determine it.");
            if is_at_end { at_end(name) } else { open() }
        });
    };
    if is_at_end {
        // Many parameters do nothing at the end of their range, and may be there.
        return Some(if is_neutral { format!("{name} does nothing.") } else { at_end(name) });
    }
    (value.abs() < error).then(|| {
        format!("{name} has a standard error greater than its value: these data hardly determine it.")
    })
}

fn at_end(name: &str) -> String {
    format!("{name} is at the end of its range: the true value may lie beyond.")
}

/// What is said of the knots of a free curve, or of a parameter's table. At 0 an error is greater than the value, so that counts only if it is
/// so of all.
fn flags_of_curve(definition: &Definition, curve: &FittedCurve) -> Vec<String> {
    let of_table = definition.parameters.iter().find(|known| curve.is_table() && known.name == curve.of);
    let of_knots = definition.curve.as_ref().filter(|known| !curve.is_table() && known.of == curve.of);
    let known = of_table.map(|known| (known.range, known.neutral));
    let Some((range, neutral)) = known.or_else(|| of_knots.map(|known| (known.range, 0.0))) else {
        return Vec::new();
    };
    let slack = BOUND_SHARE * (range[1] - range[0]);
    let is = |value: f64, other: f64| (value - other).abs() <= slack;
    let knots = &curve.knots;
    let count = |is_wanted: &dyn Fn(&FittedKnot) -> bool| {
        let wanted = knots.iter().filter(|knot| is_wanted(knot)).count();
        let verb = if wanted == 1 { "is" } else { "are" };
        (wanted > 0).then(|| (format!("{wanted} of the {} values of {}", knots.len(), curve.of), verb))
    };
    let at_end =
        |knot: &FittedKnot| range.into_iter().any(|end| is(knot.value, end)) && !is(knot.value, neutral);
    let at_end = count(&at_end).map(|(which, verb)| {
        format!("{which} {verb} at the end of the range: the true curve may lie beyond.")
    });
    let unknown = count(&|knot| knot.standard_error.is_none() && !is(knot.value, neutral))
        .map(|(which, _)| format!("{which}: no error is known, so these data may hardly determine them."));
    let is_weak = |knot: &FittedKnot| knot.standard_error.is_some_and(|error| knot.value.abs() < error);
    let weak = (!knots.is_empty() && knots.iter().all(is_weak)).then(|| {
        let of = curve.of;
        format!("All values of {of} have a standard error greater than they are: these data hardly determine them.")
    });
    at_end.into_iter().chain(unknown).chain(weak).collect()
}

/// `a`, `a or b`, `a, b or c`.
pub(super) fn either(names: &[&str]) -> String {
    match names {
        [most @ .., last] if !most.is_empty() => format!("{} or {last}", most.join(", ")),
        names => names.concat(),
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

/// A share after `closes`: `97 %` or `nothing`.
fn closes(share: f64) -> String {
    if share < SHARE_LEAST { NOTHING.into() } else { percent(share) }
}

/// Such as `83 % +- 6 %` or `99.96 % +- 0.03 %`; `nothing` of a share that is 0 or below.
pub fn closed(of_gap: Closed) -> String {
    let (share, error) = closed_and_error(of_gap);
    if of_gap.share <= 0.0 || !share.contains(|letter| matches!(letter, '1'..='9')) {
        return NOTHING.into();
    }
    error.map_or_else(|| share.clone(), |error| format!("{share} +- {error}"))
}

/// The share and its error: the error has one digit at least, and the share as many decimals.
pub(super) fn closed_and_error(Closed { share, standard_error, .. }: Closed) -> (String, Option<String>) {
    let Some(error) = standard_error else { return (percent(share), None) };
    let places = if error < 0.000_95 { 2 } else { usize::from(error < 0.0095) };
    let in_percent = |share: f64| format!("{} %", number(share, places));
    (in_percent(100.0 * share), Some(in_percent((100.0 * error).max(0.01))))
}

/// Both ends of a range with the same decimals: the larger one has three digits.
pub(super) fn ends(range: [f64; 2]) -> [String; 2] {
    let larger = digits(range[0].abs().max(range[1].abs()), 3);
    let decimals = larger.split_once('.').map_or(0, |(_, fraction)| fraction.len());
    range.map(|end| number(end, decimals))
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
