//! A discovery for machines: `report.json`.

use serde_json::{Map, Value, json};
use tactus_discover::{AddedEffect, Estimated, Level, Point, TriedEffect};

use super::{DiscoveryReport, active, in_words};

/// Name of the form of `report.json`.
const SCHEMA: &str = "tactus.discovery/1";

/// The report as JSON, `tactus.discovery/1`.
///
/// Numbers are finite or `null`; the same discovery always gives the same text. The parameters of an effect that acts
/// more than once have `#2`, `#3` and so on after their names from its second term on; `terms` has them term by term.
pub fn discovery_json(report: &DiscoveryReport<'_>) -> String {
    let found = report.discovery;
    let data = report.data.iter().map(|source| {
        json!({
            "id": source.id, "sha256": source.sha256, "frames": source.frames, "presses": source.presses,
        })
    });
    let gap = found.gap.iter().map(|gap| {
        json!({
            "where": { "covariate": gap.covariate, "unit": gap.unit, "range": gap.range },
            "effect_size": gap.effect_size,
            "q_value": gap.q_value,
        })
    });
    let curves = found.curves.iter().map(|curve| {
        json!({
            "covariate": curve.covariate, "unit": curve.unit, "of": curve.of,
            "points": curve.points.iter().map(point).collect::<Vec<_>>(),
        })
    });
    let elements = found.elements.iter().map(|element| {
        json!({
            "before_rms_counts": element.before_rms_counts, "after_rms_counts": element.after_rms_counts,
        })
    });
    let rounds = found.rounds.iter().map(|round| {
        json!({
            "with": round.with,
            "candidates": round.candidates.iter().map(candidate).collect::<Vec<_>>(),
            "taken": round.taken,
        })
    });
    let next = found.next_experiments.iter().map(|next| {
        json!({
            "experiment": next.experiment,
            "parameters": active::named(&next.parameters),
            "duration_s": next.duration_s,
            "separates": next.separates,
            "expected_z": next.expected_z,
        })
    });
    let not_shown = found.not_shown.iter().map(|one| json!({ "effect": one.effect, "reason": one.reason }));
    let mut last = level(found.final_.level);
    last.insert("shrink".into(), json!(found.final_.shrink));
    let split = &found.split;
    let written = json!({
        "schema": SCHEMA,
        "rig": report.rig,
        "simulated": report.simulated,
        "data": data.collect::<Vec<_>>(),
        "seed": found.seed,
        "notes": report.notes,
        "not_shown": not_shown.collect::<Vec<_>>(),
        "warnings": found.warnings,
        "split": {
            "frames": split.frames,
            "train_presses": split.train_presses,
            "heldout_presses": split.heldout_presses,
            "heldout_depths_mm": split.heldout_depths_mm,
            "heldout_coverings_mm": split.heldout_coverings_mm,
        },
        "noise_rms_counts": found.noise_rms_counts,
        "base": level(found.base),
        "global": { "statistic": found.global.statistic, "p_value": found.global.p_value },
        "gap": gap.collect::<Vec<_>>(),
        "curves": curves.collect::<Vec<_>>(),
        "elements": elements.collect::<Vec<_>>(),
        "rounds": rounds.collect::<Vec<_>>(),
        "steps": found.steps.iter().map(step).collect::<Vec<_>>(),
        "final": last,
        "verdict": found.verdict.name(),
        "verdict_text": in_words(found),
        "unexplained": { "depends_on": found.unexplained.depends_on, "share": found.unexplained.share },
        "next_experiments": next.collect::<Vec<_>>(),
        "active": active::json(report.active),
    });
    format!("{written:#}\n")
}

fn level(level: Level) -> Map<String, Value> {
    let fields = [
        ("heldout_rms_counts", json!(level.heldout_rms_counts)),
        ("heldout_chi2", json!(level.heldout_chi2)),
    ];
    fields.map(|(name, value)| (name.into(), value)).into_iter().collect()
}

fn point(point: &Point) -> Value {
    json!({
        "at": point.at, "before": point.before, "after": point.after, "se": point.standard_error,
    })
}

fn candidate(candidate: &TriedEffect) -> Value {
    json!({
        "effect": candidate.effect,
        "score": candidate.score,
        "p_value": candidate.p_value,
        "heldout_rms_counts": candidate.heldout_rms_counts,
        "shrink": candidate.shrink,
    })
}

fn step(step: &AddedEffect) -> Value {
    let mut parameters = Map::new();
    for (nth, term) in step.terms.iter().enumerate() {
        for parameter in term {
            let again = if nth == 0 { String::new() } else { format!("#{}", nth + 1) };
            parameters.insert(format!("{}{again}", parameter.name), estimated(parameter));
        }
    }
    let term = |term: &Vec<Estimated>| -> Map<String, Value> {
        term.iter().map(|parameter| (parameter.name.into(), estimated(parameter))).collect()
    };
    json!({
        "effect": step.effect,
        "parameters": parameters,
        "terms": step.terms.iter().map(term).collect::<Vec<_>>(),
        "p_value": step.p_value,
        "q_value": step.q_value,
        "heldout_rms_before": step.heldout_rms_before_counts,
        "heldout_rms_after": step.heldout_rms_after_counts,
        "equivalent": step.equivalent,
    })
}

fn estimated(parameter: &Estimated) -> Value {
    json!({ "value": parameter.value, "se": parameter.standard_error })
}
