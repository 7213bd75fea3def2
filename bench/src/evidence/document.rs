//! The evidence as Markdown.

use std::collections::BTreeMap;
use std::fmt::{self, Write};

use serde::Deserialize;
use tactus_discover::constants::ALPHA;
use tactus_model::effect::REGISTRY;

use super::ablation::Ablation;
use super::campaign::Campaign;
use super::drafts::{CurveScore, DraftScore, DraftScores};
use super::outcome::Outcome;
use super::rate::Rate;
use super::score::{Band, ORACLE_LEVEL, OutsideScore, Scores, SetSize, Several, Shrink, Spread};
use super::timing::Timing;

/// A part of a document that this program replaces, between marks of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// The scores of the campaigns.
    Evidence,
    /// The twins that `tactus discover --active` decides.
    Active,
    /// The forms of hidden physics.
    Forms,
    /// Drafts that new data confirm or refute.
    Confirm,
}

impl Part {
    fn marks(self) -> [&'static str; 2] {
        match self {
            Self::Evidence => ["<!-- evidence: begin -->", "<!-- evidence: end -->"],
            Self::Active => ["<!-- active: begin -->", "<!-- active: end -->"],
            Self::Forms => ["<!-- forms: begin -->", "<!-- forms: end -->"],
            Self::Confirm => ["<!-- confirm: begin -->", "<!-- confirm: end -->"],
        }
    }
}

/// The document with a text between a part's marks; `None` if it has no such marks.
pub fn into_document(document: &str, part: Part, text: &str) -> Option<String> {
    let [begin, end] = part.marks();
    let (before, rest) = document.split_once(begin)?;
    let (_, after) = rest.split_once(end)?;
    Some(format!("{before}{begin}\n\n{}\n\n{end}{after}", text.trim()))
}

/// Time and memory of `tactus discover` and of its peers.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Costs {
    /// Of `tactus discover`.
    pub ours: Timing,
    /// Of the peers, on one of the same tables.
    pub peers: Option<Peers>,
}

/// The output of `bench/peers/discovery.py time`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Peers {
    versions: BTreeMap<String, String>,
    frames: usize,
    rows: Vec<Peer>,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
struct Peer {
    who: String,
    does: String,
    seconds: Option<f64>,
    peak_mib: f64,
}

/// The generated part of `docs/discovery-evidence.md`.
pub fn document(scores: &Scores, ablations: &[Ablation], costs: Option<&Costs>) -> String {
    fmt::from_fn(|f| {
        targets(f, scores)?;
        false_alarms(f, scores)?;
        names(f, scores)?;
        several(f, scores)?;
        outside(f, scores)?;
        drafts(f, &scores.drafts)?;
        methods(f, ablations)?;
        costs.map_or(Ok(()), |costs| time(f, costs))
    })
    .to_string()
}

/// One line for each set that was not named exactly: what is hidden in it and what was reported.
pub fn misses(outcomes: &[Outcome]) -> String {
    let mut text = String::new();
    for set in outcomes {
        let is_right = match set.campaign {
            Campaign::FalseAlarms => !set.is_detected() && !set.has_failed(),
            Campaign::Names | Campaign::Pairs | Campaign::Triples => set.is_exact(),
            Campaign::Outside => set.verdict == "unexplained",
        };
        if is_right {
            continue;
        }
        let truths: Vec<String> = set
            .truths
            .iter()
            .map(|truth| {
                format!("{} [{}] z {:.1}", truth.effect.as_deref().unwrap_or("-"), truth.physics, truth.z)
            })
            .collect();
        let named: Vec<String> = set
            .named
            .iter()
            .map(|named| match &named.equivalent[..] {
                [] => named.effect.clone(),
                others => format!("{} (or {})", named.effect, others.join(", ")),
            })
            .collect();
        let shrink = set.shrink.map_or_else(|| "-".into(), |shrink| format!("{shrink:.3}"));
        // Writing to a string does not fail.
        _ = writeln!(
            text,
            "{:<44} noise {:.2} phi {:.1} | {} -> {} | {} | shrink {shrink} | added during the search: {}",
            set.id,
            set.noise[0],
            set.noise[1],
            truths.join(" + "),
            named.join(" + "),
            set.verdict,
            set.taken.join(", ")
        );
    }
    text
}

/// A target, and what was measured.
struct Target<'a> {
    what: &'a str,
    wanted: f64,
    /// The target is an upper bound.
    is_most: bool,
    seen: Option<f64>,
    of: usize,
    interval: Option<[f64; 2]>,
}

/// The row's name, with the level that the tests have: the target leaves room for noise that is not as they assume.
const FALSE_ALARMS: &str = "false alarms; the tests of a verdict have a nominal level of 0.5 % together";

fn targets(f: &mut fmt::Formatter<'_>, scores: &Scores) -> fmt::Result {
    let rate = |what: &'static str, wanted: f64, is_most: bool, rate: Rate| Target {
        what,
        wanted,
        is_most,
        seen: (rate.of > 0).then_some(rate.share),
        of: rate.of,
        interval: Some(rate.interval),
    };
    let shrink = |what: &'static str, wanted: f64, of: usize, seen: Option<f64>| Target {
        what,
        wanted,
        is_most: false,
        seen,
        of,
        interval: None,
    };
    let mut rows = Vec::new();
    if let Some(all) = scores.false_alarms.get("all") {
        rows.push(rate(FALSE_ALARMS, ORACLE_LEVEL, true, *all));
    }
    if let Some(band) = scores.bands.iter().find(|band| band.name == "16 and more") {
        let exact = scores.nameable.exact;
        rows.push(rate(
            "one effect, 5 and more from the nearest wrong one: named exactly",
            0.95,
            false,
            exact,
        ));
        rows.push(rate("one effect, z of 16 and more: named exactly", 0.95, false, band.exact));
        rows.push(rate("one effect, z of 16 and more: in the reported set", 0.95, false, band.in_set));
        let own = band.shrink_to_own_fit;
        rows.push(shrink("shrink over that of the effect's own fit, median", 0.97, own.of, own.median));
        rows.push(shrink("the same, fifth percentile", 0.9, own.of, own.fifth));
    }
    rows.push(rate("two effects: both named", 0.9, false, scores.pairs.named));
    rows.push(rate(
        "two effects, each with z of 16 and more: both named",
        0.9,
        false,
        scores.separate_pairs.named,
    ));
    rows.push(rate(
        "two effects, each 5 and more from the nearest wrong one: both named",
        0.9,
        false,
        scores.nameable_pairs.named,
    ));
    rows.push(rate("three effects: all named", 0.75, false, scores.triples.named));
    rows.push(rate(
        "three effects, each with z of 16 and more: all named",
        0.75,
        false,
        scores.separate_triples.named,
    ));
    rows.push(rate(
        "three effects, each 5 and more from the nearest wrong one: all named",
        0.75,
        false,
        scores.nameable_triples.named,
    ));
    if let Some(all) = scores.outside.get("all") {
        rows.push(rate("outside the library: not detected", 0.1, true, all.missed));
        rows.push(rate("outside the library: a wrong name", 0.05, true, all.wrong));
    }
    if let Some(drafts) = scores.drafts.outside.get("all") {
        let drafted = "outside the library: drafted with the right stage and covariate";
        rows.push(rate(drafted, 0.8, false, drafts.right));
        rows.push(rate("the same, and 70 % closed on held-out presses", 0.6, false, drafts.right_and_closed));
    }
    rows.push(rate("drafts of sets without hidden physics", 0.005, true, scores.drafts.of_nothing));
    rows.push(rate("drafts of sets with one effect of the library", 0.05, true, scores.drafts.of_named));
    writeln!(f, "## Targets\n")?;
    writeln!(f, "| what | target | measured | 95 % interval | sets | result |\n|---|---|---|---|---|---|")?;
    for Target { what, wanted, is_most, seen, of, interval } in rows {
        let bound = if is_most { "at most" } else { "at least" };
        let missed = seen.map_or_else(
            || "-".into(),
            |seen| {
                let by = if is_most { seen - wanted } else { wanted - seen };
                if by > 0.0 { format!("**missed by {:.1} points**", 100.0 * by) } else { "met".into() }
            },
        );
        let seen = seen.map_or_else(|| "-".into(), percent);
        let interval = interval.map_or_else(|| "-".into(), ends);
        writeln!(f, "| {what} | {bound} {} | {seen} | {interval} | {of} | {missed} |", percent(wanted))?;
    }
    let sets: Vec<String> =
        scores.sets.iter().map(|(campaign, count)| format!("{count} {}", campaign.name())).collect();
    writeln!(f, "\nSets: {}. Runs without a report: {}.", sets.join(", "), scores.failed.len())?;
    set_sizes(f, scores)?;
    set_costs(f, scores)?;
    writeln!(f)
}

fn set_sizes(f: &mut fmt::Formatter<'_>, scores: &Scores) -> fmt::Result {
    let Some(SetSize { of, mean, greatest }) =
        scores.bands.iter().find(|band| band.name == "16 and more").map(|band| band.set_size)
    else {
        return Ok(());
    };
    writeln!(
        f,
        "One effect, z of 16 and more: the {of} reported sets of equivalents have {mean:.2} members in the mean (target: at most 1.5), \
         {greatest} at most."
    )
}

/// Cost over all sets, none left out.
fn set_costs(f: &mut fmt::Formatter<'_>, scores: &Scores) -> fmt::Result {
    writeln!(
        f,
        "\nCost of a set, on one thread beside others, over all sets:\n\n| | median | 95 % within | greatest | target |\n|---|---|---|---|---|"
    )?;
    for (what, cost, target) in [
        ("s", scores.seconds, "60 s at most, 36,000 frames on two cores"),
        ("MiB", scores.peak_mib, "512 MiB at most"),
    ] {
        if let Some(Spread { median, most, greatest }) = cost {
            writeln!(f, "| {what} | {median:.1} | {most:.1} | {greatest:.1} | {target} |")?;
        }
    }
    Ok(())
}

fn false_alarms(f: &mut fmt::Formatter<'_>, scores: &Scores) -> fmt::Result {
    writeln!(
        f,
        "## Sets without hidden physics\n\n| noise | sets | false alarms | share | 95 % interval |\n|---|---|---|---|---|"
    )?;
    for (noise, rate) in &scores.false_alarms {
        writeln!(
            f,
            "| {noise} | {} | {} | {} | {} |",
            rate.of,
            rate.hits,
            percent(rate.share),
            ends(rate.interval)
        )?;
    }
    writeln!(
        f,
        "\nA set that fails or cannot be judged counts as a false alarm. The five tests of a verdict have a nominal level of {} together, \
         after Bonferroni's correction; the target is {} at most.\n",
        percent(ALPHA),
        percent(ORACLE_LEVEL)
    )
}

const BAND_HEAD: &str = "sets | detected | named exactly | in the reported set | a wrong name | shrink: median, fifth percentile (sets) | the same over that of the true effect's own fit |\n|---|---|---|---|---|---|---|---|";

fn names(f: &mut fmt::Formatter<'_>, scores: &Scores) -> fmt::Result {
    writeln!(f, "## Sets with one effect\n\n| z | {BAND_HEAD}")?;
    for band in &scores.bands {
        band_row(f, &band.name, band)?;
    }
    writeln!(
        f,
        "\nPoints of the library's own parameters, which are in no other table:\n\n| z | {BAND_HEAD}"
    )?;
    for band in &scores.library_points {
        band_row(f, &band.name, band)?;
    }
    writeln!(f, "\nBy effect, z of 16 and more:\n\n| effect | {BAND_HEAD}")?;
    for row in &scores.effects {
        band_row(f, &row.effect, &row.band)?;
    }
    writeln!(
        f,
        "\n![Hidden effects against named effects](images/discovery-confusion.svg)\n\n![Power against separation](images/discovery-power.svg)\n"
    )
}

fn band_row(f: &mut fmt::Formatter<'_>, name: &str, band: &Band) -> fmt::Result {
    let Band { detected, exact, in_set, wrong, shrink, shrink_to_own_fit, .. } = band;
    writeln!(
        f,
        "| {name} | {} | {} | {} | {} | {} | {} | {} |",
        detected.of,
        percent(detected.share),
        percent(exact.share),
        percent(in_set.share),
        percent(wrong.share),
        shrunk(shrink),
        shrunk(shrink_to_own_fit),
    )
}

fn several(f: &mut fmt::Formatter<'_>, scores: &Scores) -> fmt::Result {
    writeln!(
        f,
        "## Sets with several effects\n\n| effects | sets | all named | all named and nothing else | all in reported sets | a wrong name | recall | precision | shrink: median, fifth percentile (sets) |\n|---|---|---|---|---|---|---|---|---|"
    )?;
    let rows = [
        ("two", &scores.pairs),
        ("two, each with z of 16 and more", &scores.separate_pairs),
        ("two, each 5 and more from the nearest wrong one", &scores.nameable_pairs),
        ("three", &scores.triples),
        ("three, each with z of 16 and more", &scores.separate_triples),
        ("three, each 5 and more from the nearest wrong one", &scores.nameable_triples),
    ];
    for (name, several) in rows {
        let Several { named, exact, in_set, wrong, recall, precision, shrink } = several;
        writeln!(
            f,
            "| {name} | {} | {} ({}) | {} | {} | {} | {} | {} | {} |",
            named.of,
            percent(named.share),
            ends(named.interval),
            percent(exact.share),
            percent(in_set.share),
            percent(wrong.share),
            percent(recall.share),
            percent(precision.share),
            shrunk(shrink)
        )?;
    }
    writeln!(f)
}

fn outside(f: &mut fmt::Formatter<'_>, scores: &Scores) -> fmt::Result {
    writeln!(
        f,
        "## Sets with physics outside the library\n\n| physics | sets | unexplained | any effect named | partly explained | not detected |\n|---|---|---|---|---|---|"
    )?;
    for (physics, OutsideScore { unexplained, wrong, partly, missed }) in &scores.outside {
        writeln!(
            f,
            "| {physics} | {} | {} | {} | {} | {} |",
            unexplained.of,
            percent(unexplained.share),
            percent(wrong.share),
            percent(partly.share),
            percent(missed.share)
        )?;
    }
    Ok(())
}

/// Drafts, by what is hidden.
fn drafts(f: &mut fmt::Formatter<'_>, scores: &DraftScores) -> fmt::Result {
    writeln!(
        f,
        "\n## Drafts\n\nA draft is right if its stage and its first covariate are those of the hidden physics. All sets are in the denominators, \
         those included in which an effect was named or nothing was seen. Physics that is drawn anew for each reading has no mean to draft; it is \
         drafted in {} of {} sets. Something is drafted in {} of {} sets without hidden physics, and in {} of {} with one effect of the library. The error \
         of a curve is on a path that the set does not have; it is computed after the runs.\n\n| physics | sets | drafted | right stage and covariate | right, and 70 % closed | right, and curve within 10 % | error of right curves, median |\n|---|---|---|---|---|---|---|",
        scores.of_single.hits,
        scores.of_single.of,
        scores.of_nothing.hits,
        scores.of_nothing.of,
        scores.of_named.hits,
        scores.of_named.of
    )?;
    for (physics, DraftScore { drafted, right, right_and_closed, curves }) in &scores.outside {
        let [near, error] = curves.map_or_else(
            || ["-".to_owned(), "-".to_owned()],
            |CurveScore { right_and_near, median_error }| {
                [percent(right_and_near.share), percent(median_error.unwrap_or(f64::NAN))]
            },
        );
        writeln!(
            f,
            "| {physics} | {} | {} | {} | {} | {near} | {error} |",
            drafted.of,
            percent(drafted.share),
            percent(right.share),
            percent(right_and_closed.share)
        )?;
    }
    Ok(())
}

fn methods(f: &mut fmt::Formatter<'_>, ablations: &[Ablation]) -> fmt::Result {
    if ablations.len() < 2 {
        return Ok(());
    }
    writeln!(f, "\n## Other methods on the same sets")?;
    if ablations.iter().any(|method| method.exact.of > 0) {
        methods_that_name(f, ablations)?;
    }
    methods_that_draft(f, ablations)
}

/// Names by other methods on the same sets.
fn methods_that_name(f: &mut fmt::Formatter<'_>, ablations: &[Ablation]) -> fmt::Result {
    writeln!(
        f,
        "\n| method | false alarms | named exactly | in the reported set | a wrong name | both of two named | outside: unexplained | outside: any effect named | shrink: median, fifth percentile (sets) | the same on presses deeper than any fitted | s for each set |\n|---|---|---|---|---|---|---|---|---|---|---|"
    )?;
    for method in ablations {
        writeln!(
            f,
            "| {} | {} of {} | {} of {} | {} of {} | {} of {} | {} of {} | {} of {} | {} of {} | {} | {} | {:.1} |",
            method.method,
            method.false_alarms.hits,
            method.false_alarms.of,
            method.exact.hits,
            method.exact.of,
            method.in_set.hits,
            method.in_set.of,
            method.wrong.hits,
            method.wrong.of,
            method.pairs.hits,
            method.pairs.of,
            method.unexplained.hits,
            method.unexplained.of,
            method.outside_named.hits,
            method.outside_named.of,
            shrunk(&method.shrink),
            shrunk(&method.deeper_shrink),
            method.seconds.unwrap_or(f64::NAN),
        )?;
    }
    Ok(())
}

/// Drafts by other methods on the same sets.
fn methods_that_draft(f: &mut fmt::Formatter<'_>, ablations: &[Ablation]) -> fmt::Result {
    let drafts = |method: &&Ablation| {
        let DraftScores { outside, of_nothing, of_named, .. } = &method.drafts;
        let of_outside = outside.get("all").map_or(0, |all| all.drafted.hits);
        of_outside + of_nothing.hits + of_named.hits > 0
    };
    let drafting: Vec<&Ablation> = ablations.iter().filter(drafts).collect();
    if drafting.is_empty() {
        return Ok(());
    }
    writeln!(
        f,
        "\nDrafts of what no effect explains:\n\n| method | right stage and covariate | right, and 70 % closed | drafted where nothing is hidden | drafted where an effect of the library is |\n|---|---|---|---|---|"
    )?;
    for Ablation { method, drafts: DraftScores { outside, of_nothing, of_named, .. }, .. } in drafting {
        let of = |rate: Rate| format!("{} of {}", rate.hits, rate.of);
        let [right, closed] = match outside.get("all") {
            Some(all) => [of(all.right), of(all.right_and_closed)],
            None => ["none".to_owned(), "none".to_owned()],
        };
        writeln!(f, "| {method} | {right} | {closed} | {} | {} |", of(*of_nothing), of(*of_named))?;
    }
    Ok(())
}

fn time(f: &mut fmt::Formatter<'_>, Costs { ours, peers }: &Costs) -> fmt::Result {
    writeln!(
        f,
        "\n## Time and memory\n\n| program | frames of 48 elements | s | peak, MiB | what it does |\n|---|---|---|---|---|"
    )?;
    for cost in &ours.rows {
        writeln!(
            f,
            "| tactus discover, {} cores | {} | {:.1} | {:.0} | tells which of {} effects are missing |",
            ours.cores,
            cost.frames,
            cost.seconds,
            cost.peak_mib,
            REGISTRY.len()
        )?;
    }
    let rows = peers.iter().flat_map(|peers| peers.rows.iter().map(|row| (peers.frames, row)));
    for (frames, Peer { who, does, seconds, peak_mib }) in rows {
        let seconds = seconds.map_or_else(|| "failed".into(), |seconds| format!("{seconds:.1}"));
        writeln!(f, "| {who}, one core | {frames} | {seconds} | {peak_mib:.0} | {does} |")?;
    }
    writeln!(f, "\nTime grows as frames^{:.2}.", ours.exponent)?;
    for frames in &ours.left_out {
        writeln!(
            f,
            "{frames} frames were not run: at the growth seen so far they need more memory than this machine has."
        )?;
    }
    if let Some(Peers { versions, .. }) = peers {
        let versions: Vec<String> =
            versions.iter().map(|(what, version)| format!("{what} {version}")).collect();
        writeln!(
            f,
            "Versions: {}. The time of these programs begins with the residual of the base model.",
            versions.join(", ")
        )?;
    }
    let asked = ours.rows.iter().find(|cost| cost.frames == 36_000);
    for (what, seen, most) in
        asked.iter().flat_map(|cost| [("s", cost.seconds, 60.0), ("MiB", cost.peak_mib, 1024.0)])
    {
        let verdict = if seen < most { "met".into() } else { format!("missed by {:.0} {what}", seen - most) };
        writeln!(f, "36,000 frames take {seen:.1} {what}. Target: at most {most} {what}, {verdict}.")?;
    }
    Ok(())
}

fn percent(share: f64) -> String {
    if share.is_finite() { format!("{:.1} %", 100.0 * share) } else { "-".into() }
}

fn ends([least, most]: [f64; 2]) -> String {
    format!("{:.1} to {:.1} %", 100.0 * least, 100.0 * most)
}

fn shrunk(shrink: &Shrink) -> String {
    match (shrink.median, shrink.fifth) {
        (Some(median), Some(fifth)) => format!("{median:.3}, {fifth:.3} ({})", shrink.of),
        (None, _) | (_, None) => "-".into(),
    }
}

#[cfg(test)]
#[path = "document_tests.rs"]
mod tests;
