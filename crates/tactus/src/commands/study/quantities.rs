//! The quantities of a study: the paper's value, this rig's and, if known, the truth.

use std::path::Path;

use anyhow::Context;
use serde_json::{Value, json};
use tactus_calibrate::acuity::NYQUIST_SIGMA;
use tactus_calibrate::design::Wanted;
use tactus_calibrate::{ElementResponse, Estimate, FaultKind, FaultyElement, ResponseFit, ResponseForm};
use tactus_model::{DIGITACTS_PITCH_MM, Psf};
use tactus_record::Timeline;
use tactus_report::figures::Widening;
use tactus_report::study::{ComparedQuantity, FoundValue};
use tactus_runner::embedded::{self, Truth};
use tactus_schema::Rig;
use tactus_schema::rig::ElementFault;

use super::images::Images;
use crate::commands::calibrate::{Calibrated, estimate};
use crate::output::{print_table, say};

/// Poisson's ratio of the covering in the finite elements (rubber hardly changes its volume).
const POISSON_RATIO: f64 = 0.45;
/// Force steps of one unit reading for which the acuity is stated: 8 bit.
const FORCE_STEPS: u32 = 256;

/// The true parameters of the recording's rig, if it is simulated and its file has them.
pub(super) fn truth(recording: &Path) -> anyhow::Result<Option<Truth>> {
    let timeline = Timeline::read(recording)?;
    let Some(text) = timeline.attachment("rig.toml") else { return Ok(None) };
    let text = std::str::from_utf8(text).context("the recording's rig file is not text")?;
    let rig = Rig::from_toml(text).context("the recording's rig file")?;
    Ok(embedded::truth(&rig))
}

/// All quantities, in the paper's order.
pub(super) fn quantities(
    calibrated: &Calibrated,
    truth: Option<&Truth>,
    images: Option<&Images>,
) -> anyhow::Result<Vec<ComparedQuantity>> {
    let mut quantities = registration(calibrated, truth);
    quantities.extend(response(calibrated, truth));
    quantities.extend(mechanics()?);
    quantities.extend(spread(calibrated, truth));
    quantities.extend(acuity()?);
    if let Some(images) = images {
        quantities.push(ComparedQuantity {
            paper: Some("qualitatively similar".into()),
            note: "Fig. 8: largest difference between the rig's images of the H and the model's".into(),
            ..text("images of the H", "", format!("within {:.1} % of their range", images.worst_percent))
        });
    }
    Ok(quantities)
}

fn registration(calibrated: &Calibrated, truth: Option<&Truth>) -> Vec<ComparedQuantity> {
    let Some(fit) = &calibrated.calibration.registration else { return Vec::new() };
    let of = |of: fn(&Truth) -> f64| truth.map(of);
    let [x, y] = fit.origin_mm;
    vec![
        estimated("origin, x", "mm", Some(x), of(|truth| truth.registration.origin_mm[0])),
        estimated("origin, y", "mm", Some(y), of(|truth| truth.registration.origin_mm[1])),
        estimated("rotation", "deg", fit.rotation_deg, of(|truth| truth.registration.rotation_deg)),
        estimated("surface height", "mm", fit.surface_mm, of(|truth| truth.surface_mm)),
        ComparedQuantity {
            note: "a check of element centres and stage".into(),
            ..estimated("scale", "", fit.scale, truth.map(|_| 1.0))
        },
    ]
}

fn response(calibrated: &Calibrated, truth: Option<&Truth>) -> Vec<ComparedQuantity> {
    let calibration = &calibrated.calibration;
    let faults = &calibration.health.faults;
    let planted = truth.map(planted);
    let mut quantities = vec![ComparedQuantity {
        paper: Some("two, answering a neighbour".into()),
        inside: planted.as_ref().map(|planted| {
            let alike = |(found, (element, kind)): (&FaultyElement, &(usize, FaultKind))| {
                found.element == *element && alike(found.kind, *kind)
            };
            faults.len() == planted.len() && faults.iter().zip(planted).all(alike)
        }),
        note: planted
            .as_ref()
            .map_or_else(String::new, |planted| format!("planted: {}", in_words(planted.iter().copied()))),
        ..text("faulty elements", "", in_words(faults.iter().map(|fault| (fault.element, fault.kind))))
    }];
    let Some(fit) = &calibration.response else { return quantities };
    quantities.push(ComparedQuantity {
        paper: Some("linear at low force, else quadratic".into()),
        note: "chosen on held-out dwells".into(),
        ..text("response", "", fit.form.name().into())
    });
    let curvature = if fit.form == ResponseForm::Linear {
        fit.shared_quadratic_per_mm
    } else {
        fit.elements.first().map(|one| one.quadratic_per_mm)
    };
    if fit.form != ResponseForm::OwnQuadratic {
        let truth = truth.map(|truth| truth.model.response().quadratic_per_mm[0]);
        quantities.push(estimated("curvature of the response", "1/mm", curvature, truth));
    }
    quantities.extend(sensitivities(fit, truth));
    quantities
}

/// The sensitivities: their mean, which carries the error that all share, and the elements beside it.
fn sensitivities(fit: &ResponseFit, truth: Option<&Truth>) -> Vec<ComparedQuantity> {
    let truths = truth.map(|truth| &truth.model.response().sensitivity_counts_per_mm);
    let count = fit.elements.len();
    let of_fitted =
        |truths: &Vec<f64>| fit.elements.iter().map(|one| truths[one.element]).sum::<f64>() / count as f64;
    let true_mean = truths.map(of_fitted);
    let mean = fit.mean_sensitivity_counts_per_mm;
    let mut quantities = vec![ComparedQuantity {
        note: "the errors of surface height, place and curvature are shared by all elements, and so remain in the mean".into(),
        ..estimated("mean sensitivity", "counts/mm", Some(mean), true_mean)
    }];
    if let (Some(truths), Some(true_mean)) = (truths, true_mean) {
        let beside = |one: &&ElementResponse| {
            let truth = truths[one.element] - true_mean;
            one.above_mean_counts_per_mm.is_some_and(|found| found.covers(truth))
        };
        let whole = |one: &&ElementResponse| one.sensitivity_counts_per_mm.covers(truths[one.element]);
        quantities.push(ComparedQuantity {
            note: "differences to the mean, without the shared error; about 95 % are expected".into(),
            ..text(
                "sensitivities beside their mean, inside",
                "",
                format!("{} of {count}", fit.elements.iter().filter(beside).count()),
            )
        });
        quantities.push(ComparedQuantity {
            note: "with the shared error, all lie off to the same side: on one rig nearly all or few are inside, and 95 % only on \
                   average over many rigs. Judge the two rows above instead"
                .into(),
            ..text(
                "sensitivities as they stand, inside",
                "",
                format!("{} of {count}", fit.elements.iter().filter(whole).count()),
            )
        });
    }
    quantities
}

/// The planted faults in order of the elements, as calibration reports faults.
fn planted(truth: &Truth) -> Vec<(usize, FaultKind)> {
    let kind = |fault: &ElementFault| match *fault {
        ElementFault::Dead => FaultKind::Dead,
        ElementFault::Stuck { counts } => FaultKind::Stuck { counts: counts.into() },
        ElementFault::Noisy { noise_rms_counts } => FaultKind::Noisy { rms_counts: noise_rms_counts },
        ElementFault::Miswired { answers_for } => FaultKind::CrossWired { answers_for },
    };
    truth.faults.iter().map(|(element, fault)| (*element, kind(fault))).collect()
}

/// True if the fault has the planted kind; the size of a noise may differ.
fn alike(found: FaultKind, planted: FaultKind) -> bool {
    matches!((found, planted), (FaultKind::Noisy { .. }, FaultKind::Noisy { .. })) || found == planted
}

fn in_words(faults: impl Iterator<Item = (usize, FaultKind)>) -> String {
    let one = |(element, kind)| match kind {
        FaultKind::Dead => format!("{element} dead"),
        FaultKind::Stuck { .. } => format!("{element} stuck"),
        FaultKind::CrossWired { answers_for } => format!("{element} answers for {answers_for}"),
        FaultKind::Noisy { .. } => format!("{element} noisy"),
    };
    let words: Vec<String> = faults.map(one).collect();
    if words.is_empty() { "none".into() } else { words.join(", ") }
}

/// Spread by finite elements, in bricks, the paper's unit of thickness in Fig. 3.
fn mechanics() -> anyhow::Result<Vec<ComparedQuantity>> {
    let Widening { line: [intercept, slope], of_layer, .. } = Widening::new(POISSON_RATIO)?;
    Ok(vec![
        ComparedQuantity {
            paper: Some("0.5".into()),
            note: format!("finite elements, Fig. 3, Poisson's ratio {POISSON_RATIO}; the continuous layer has {of_layer:.3}"),
            ..text("spread of the covering alone, per thickness", "", format!("{slope:.3}"))
        },
        ComparedQuantity {
            paper: Some("0.9".into()),
            note: "elasticity has none: what is left is the mesh's; the rest of the paper's belongs to its sensor".into(),
            ..text("spread at no thickness, finite elements", "bricks", format!("{intercept:.2}"))
        },
    ])
}

fn spread(calibrated: &Calibrated, truth: Option<&Truth>) -> Vec<ComparedQuantity> {
    let pitch_mm = calibrated.rig.array.pitch_mm();
    let Some(thickness) = &calibrated.calibration.thickness else { return Vec::new() };
    let psf = truth.map(|truth| truth.model.psf());
    let mut quantities: Vec<ComparedQuantity> = thickness
        .coverings
        .iter()
        .map(|covering| {
            let t = covering.covering_mm;
            let truth = psf.map(|psf| (psf.sigma_intercept_mm + psf.sigma_per_mm * t) / pitch_mm);
            ComparedQuantity {
                paper: Some(format!("{:.2} (Eq. 4)", 1.11 + 0.497 * t / 2.0)),
                ..estimated(
                    &format!("spread under {t:.3} mm"),
                    "pitches",
                    Some(covering.sigma_mm.in_units_of(pitch_mm)),
                    truth,
                )
            }
        })
        .collect();
    if let Some(line) = &thickness.linear {
        let [intercept, slope] = line.coefficients;
        quantities.push(ComparedQuantity {
            paper: Some("1.11".into()),
            ..estimated(
                "Eq. 4, intercept",
                "pitches",
                Some(intercept.in_units_of(pitch_mm)),
                psf.map(|psf| psf.sigma_intercept_mm / pitch_mm),
            )
        });
        quantities.push(ComparedQuantity {
            paper: Some("0.497".into()),
            ..estimated("Eq. 4, slope", "", Some(slope), psf.map(|psf| psf.sigma_per_mm))
        });
    }
    if let Some(parabola) = &thickness.quadratic {
        let [_, _, bend] = parabola.coefficients;
        let found = Estimate { value: bend.value * pitch_mm, standard_error: bend.standard_error * pitch_mm };
        quantities.push(ComparedQuantity {
            note: "of the quadratic fit of Fig. 5a; 0 if the spread is linear in thickness".into(),
            ..estimated("spread against thickness, bend", "1/pitch", Some(found), truth.map(|_| 0.0))
        });
    }
    quantities
}

fn acuity() -> anyhow::Result<Vec<ComparedQuantity>> {
    let paper = Wanted {
        pitch_mm: DIGITACTS_PITCH_MM,
        force_steps: FORCE_STEPS,
        min_sigma: NYQUIST_SIGMA,
        psf: Psf::PAPER,
    };
    let best = paper.design()?.best_for_locating;
    Ok(vec![
        ComparedQuantity {
            paper: Some("around 0.3".into()),
            note: format!(
                "Fig. 6a, {FORCE_STEPS} force steps: {} locations in an element; a ridge only where 1/f is whole",
                best.locations
            ),
            ..text("spread that locates best", "pitches", format!("{:.2}", best.sigma))
        },
        ComparedQuantity {
            paper: Some("1.0".into()),
            note: "3 / pi, which the paper rounds".into(),
            ..text("least spread without aliasing", "pitches", format!("{NYQUIST_SIGMA:.3}"))
        },
    ])
}

fn estimated(quantity: &str, unit: &str, found: Option<Estimate>, truth: Option<f64>) -> ComparedQuantity {
    ComparedQuantity {
        quantity: quantity.into(),
        unit: unit.into(),
        paper: None,
        inside: found.zip(truth).map(|(found, truth)| found.covers(truth)),
        found: found.map_or(FoundValue::Nothing, FoundValue::Estimate),
        truth,
        note: if found.is_some() { String::new() } else { "not determined by the data".into() },
    }
}

fn text(quantity: &str, unit: &str, found: String) -> ComparedQuantity {
    ComparedQuantity {
        quantity: quantity.into(),
        unit: unit.into(),
        paper: None,
        found: FoundValue::Text(found),
        truth: None,
        inside: None,
        note: String::new(),
    }
}

/// A quantity as JSON.
pub(super) fn to_json(row: &ComparedQuantity) -> Value {
    let ComparedQuantity { quantity, unit, paper, found, truth, inside, note } = row;
    let found = match found {
        FoundValue::Estimate(Estimate { value, standard_error }) => {
            json!({ "value": value, "standard_error": standard_error })
        }
        FoundValue::Text(text) => json!(text),
        FoundValue::Nothing => Value::Null,
    };
    json!({
        "quantity": quantity, "unit": unit, "paper": paper, "found": found, "truth": truth, "inside": inside, "note": note,
    })
}

/// Prints the quantities as a table.
pub(super) fn print(quantities: &[ComparedQuantity]) {
    let cells = quantities.iter().map(|row| {
        let found = match &row.found {
            FoundValue::Estimate(found) => estimate(*found),
            FoundValue::Text(text) => text.clone(),
            FoundValue::Nothing => "-".into(),
        };
        let truth = row.truth.map_or_else(String::new, |truth| format!("{truth:.5}"));
        let inside = row.inside.map_or("", |inside| if inside { "yes" } else { "NO" });
        vec![
            row.quantity.clone(),
            row.unit.clone(),
            row.paper.clone().unwrap_or_default(),
            found,
            truth,
            inside.into(),
        ]
    });
    say("");
    print_table(&["quantity", "unit", "paper", "this rig", "truth", "inside"], &cells.collect::<Vec<_>>());
}
