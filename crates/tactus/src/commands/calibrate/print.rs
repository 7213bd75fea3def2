//! Terminal output of a calibration.

use std::path::PathBuf;

use tactus_calibrate::{Estimate, FaultKind, FaultyElement};

use super::Calibrated;
use crate::output::{print_fields, print_table, say, say_next};

pub(super) fn calibrated(calibrated: &Calibrated, paths: &[PathBuf]) {
    let Calibrated { rig, simulated, notes, calibration, .. } = calibrated;
    let data = &calibration.data;
    let mut fields = vec![
        ("rig", format!("{}{}", rig.name, if *simulated { " (SIMULATED)" } else { "" })),
        (
            "read",
            format!(
                "{} runs, {} presses, {} dwells, {} frames",
                data.runs.len(),
                data.presses,
                data.dwells,
                data.frames
            ),
        ),
    ];
    if let Some(noise) = calibration.noise_rms_counts {
        fields.push(("noise", format!("{noise:.2} counts rms")));
    }
    if let Some(registration) = &calibration.registration {
        let [x, y] = registration.origin_mm;
        fields.push(("origin", format!("{}, {} mm", estimate(x), estimate(y))));
        if let Some(rotation) = registration.rotation_deg {
            fields.push(("rotation", format!("{} deg", estimate(rotation))));
        }
        if let Some(surface) = registration.surface_mm {
            fields.push(("surface", format!("{} mm", estimate(surface))));
        }
        if let Some(scale) = registration.scale {
            fields.push(("scale", format!("{} (check; expected 1)", estimate(scale))));
        }
    }
    for fault in &calibration.health.faults {
        fields.push(("faulty", faulty(fault)));
    }
    if let Some(response) = &calibration.response {
        fields
            .push(("response", format!("{} of {} elements", response.form.name(), response.elements.len())));
        if let Some(curvature) = response.shared_quadratic_per_mm {
            fields.push(("curvature", format!("{} per mm, common to all elements", estimate(curvature))));
        }
    }
    if let Some(line) = calibration.thickness.as_ref().and_then(|thickness| thickness.linear.as_ref()) {
        let pitch_mm = rig.array.pitch_mm();
        let [intercept, slope] = line.coefficients;
        fields.push(("sigma(t)", format!("({}) + ({}) t, in mm", estimate(intercept), estimate(slope))));
        let intercept = estimate(intercept.in_units_of(pitch_mm));
        fields.push((
            "",
            format!(
                "({intercept}) + ({}) t, in pitches of {pitch_mm} mm (Eq. 4: 1.11 + 0.497 t)",
                estimate(slope)
            ),
        ));
    }
    print_fields(&fields);
    if !calibration.spreads.is_empty() {
        say("");
        let rows: Vec<Vec<String>> = calibration
            .spreads
            .iter()
            .map(|spread| {
                vec![
                    format!("{:.3}", spread.covering_mm),
                    format!("{:.3}", spread.depth_mm),
                    spread.presses.to_string(),
                    estimate(spread.sigma_mm),
                    estimate(spread.sigma_mm.in_units_of(rig.array.pitch_mm())),
                    format!("{:.6}", spread.likeness),
                ]
            })
            .collect();
        print_table(&["covering mm", "depth mm", "presses", "sigma+ mm", "pitches", "cosine"], &rows);
    }
    say("");
    for note in notes.iter().chain(&calibration.warnings) {
        say(&format!("warning: {note}"));
    }
    for missing in &calibration.missing {
        say(&format!("missing: {missing}"));
    }
    for path in paths {
        say(&path.display().to_string());
    }
    if let Some(model) = paths.iter().find(|path| path.ends_with("model.toml")) {
        say_next(&format!("`tactus simulate --model {}` shows an image of this sensor", model.display()));
    }
}

/// `element 5 is dead`.
pub(crate) fn faulty(fault: &FaultyElement) -> String {
    let what = match fault.kind {
        FaultKind::Dead => "is dead".into(),
        FaultKind::Stuck { counts } => format!("is stuck at {counts}"),
        FaultKind::CrossWired { answers_for } => format!("answers for {answers_for}"),
        FaultKind::Noisy { rms_counts } => format!("is noisy: {rms_counts:.1} counts rms"),
    };
    format!("element {} {what}", fault.element)
}

/// `2.7256 +- 0.0007`: rounded to the first digit of the error.
pub(crate) fn estimate(estimate: Estimate) -> String {
    let Estimate { value, standard_error } = estimate;
    if !(standard_error > 0.0 && standard_error.is_finite()) {
        return format!("{value:.4}");
    }
    // 0.00073 has its first digit in the fourth decimal place.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
    let digits = (-standard_error.log10()).ceil().clamp(0.0, 9.0) as usize;
    format!("{value:.digits$} +- {standard_error:.digits$}")
}
