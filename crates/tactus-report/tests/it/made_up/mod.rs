//! Synthetic calibrations with known numbers.

pub(crate) mod discovery;

use tactus_calibrate::{
    Calibration, CoveringSpread, Curve, DataSummary, ElementResponse, Estimate, FaultKind, FaultyElement,
    Health, RegistrationFit, ResponseFit, ResponseForm, SpreadFit, ThicknessFit, Trial,
};
use tactus_model::{Array, Psf, Registration};
use tactus_report::calibration::CalibrationReport;

/// Faulty elements, each with another fault.
pub(crate) const FAULTY: [usize; 4] = [5, 7, 18, 33];
/// An element without a press near it.
pub(crate) const NOT_JUDGED: usize = 40;
/// Curvature of every element. Sensitivities are 1000 counts/mm plus the element's index.
pub(crate) const CURVATURE_PER_MM: f64 = 0.15;

/// A calibration with all results.
pub(crate) fn whole() -> Calibration {
    let sound = (0..48).filter(|element| !FAULTY.contains(element) && *element != NOT_JUDGED);
    let spreads: Vec<SpreadFit> = [1.016, 2.54, 5.08]
        .into_iter()
        .flat_map(|covering| [0.3, 0.65].map(|share| spread(covering, share)))
        .collect();
    Calibration {
        data: DataSummary {
            runs: vec!["corners-1".into(), "grid-2".into()],
            presses: 2_778,
            dwells: 2_970,
            frames: 371_857,
            frames_left_out: 12,
            coverings_mm: vec![1.016, 2.54, 5.08],
            reference_covering_mm: 1.016,
        },
        noise_rms_counts: Some(2.02),
        baseline_counts: (0..48).map(|_| Some(sure(100.0, 0.6))).collect(),
        health: Health {
            faults: vec![
                fault(FAULTY[0], FaultKind::Dead, "rose by 1.0 counts at most"),
                fault(FAULTY[1], FaultKind::Stuck { counts: 123.0 }, "reads 123 in each of 371857 frames"),
                fault(FAULTY[2], FaultKind::CrossWired { answers_for: 19 }, "is like element 19"),
                fault(FAULTY[3], FaultKind::Noisy { rms_counts: 31.26 }, "31.2 counts rms at rest"),
            ],
            not_judged: vec![NOT_JUDGED],
        },
        registration: Some(RegistrationFit {
            origin_mm: [sure(20.060_324, 0.000_309), sure(14.959_415, 0.000_376)],
            rotation_deg: Some(sure(0.202_833, 0.002_175)),
            surface_mm: None,
            scale: Some(sure(0.999_959, 0.000_049)),
            sigma_mm: sure(2.724_925, 0.000_35),
            covering_mm: 1.016,
            runs: vec!["corners-1".into()],
            presses: 78,
            left_out: (0..14).map(|press| ("corners-1".into(), press)).collect(),
            residual_in_noise: 1.004,
        }),
        response: Some(ResponseFit {
            form: ResponseForm::SharedQuadratic,
            trials: vec![
                Trial { form: ResponseForm::Linear, rms_counts: 8.867, heldout_rms_counts: Some(10.41) },
                Trial {
                    form: ResponseForm::SharedQuadratic,
                    rms_counts: 0.65,
                    heldout_rms_counts: Some(0.8),
                },
            ],
            shared_quadratic_per_mm: Some(sure(CURVATURE_PER_MM, 0.001)),
            residual_in_noise: 1.0,
            mean_sensitivity_counts_per_mm: sure(1023.5, 1.0),
            cross_wired: Vec::new(),
            elements: sound.map(element).collect(),
        }),
        thickness: Some(ThicknessFit {
            coverings: [1.016, 2.54, 5.08].map(covering).into(),
            linear: Some(Curve {
                coefficients: [sure(2.2205, 0.0007), sure(0.49697, 0.00026)],
                rms_mm: 0.000_11,
                p_value: Some(0.535),
            }),
            quadratic: Some(Curve {
                coefficients: [sure(2.2208, 0.0007), sure(0.4967, 0.0003), sure(0.000_04, 0.000_03)],
                rms_mm: 0.000_1,
                p_value: Some(1e-9),
            }),
        }),
        spreads,
        missing: vec!["Surface: one depth was pressed only; its height is taken as declared.".into()],
        warnings: vec!["14 presses contradict the others and are left out of the registration.".into()],
    }
}

/// A calibration without results, because there were no presses.
pub(crate) fn empty() -> Calibration {
    Calibration {
        data: DataSummary {
            runs: Vec::new(),
            presses: 0,
            dwells: 0,
            frames: 0,
            frames_left_out: 0,
            coverings_mm: Vec::new(),
            reference_covering_mm: 1.016,
        },
        noise_rms_counts: None,
        baseline_counts: vec![None; 48],
        health: Health { faults: Vec::new(), not_judged: (0..48).collect() },
        registration: None,
        response: None,
        spreads: Vec::new(),
        thickness: None,
        missing: vec!["Registration: nothing was pressed.".into()],
        warnings: Vec::new(),
    }
}

pub(crate) fn report<'a>(array: &'a Array, calibration: &'a Calibration) -> CalibrationReport<'a> {
    CalibrationReport {
        rig: "bench-3",
        simulated: true,
        array,
        declared_registration: Registration { origin_mm: [20.0, 15.0], rotation_deg: 0.0 },
        declared_psf: Psf::PAPER,
        calibration,
        notes: &[],
    }
}

pub(crate) fn sure(value: f64, standard_error: f64) -> Estimate {
    Estimate { value, standard_error }
}

pub(crate) fn fault(element: usize, kind: FaultKind, evidence: &str) -> FaultyElement {
    FaultyElement { element, kind, evidence: evidence.into() }
}

fn element(element: usize) -> ElementResponse {
    let s = 1000.0 + element as f64;
    ElementResponse {
        element,
        points: [0.2, 0.3, 0.4, 0.5, 0.6].map(|u| [u, s * (u + CURVATURE_PER_MM * u * u)]).into(),
        linear_counts_per_mm: sure(1.08 * s, 13.2),
        quadratic: Some([sure(s, 1.3), sure(CURVATURE_PER_MM, 0.007)]),
        sensitivity_counts_per_mm: sure(s, 1.3),
        above_mean_counts_per_mm: Some(sure(s - 1023.5, 0.8)),
        quadratic_per_mm: sure(CURVATURE_PER_MM, 0.001),
    }
}

fn spread(covering_mm: f64, share: f64) -> SpreadFit {
    SpreadFit {
        covering_mm,
        depth_mm: share * covering_mm,
        run: "grid-2".into(),
        presses: 222,
        left_out: if covering_mm < 2.0 { 3 } else { 0 },
        sigma_mm: sure(2.22 + 0.497 * covering_mm, 0.0007),
        scatter_mm: 0.0002,
        likeness: 0.999_968_5,
    }
}

fn covering(covering_mm: f64) -> CoveringSpread {
    CoveringSpread {
        covering_mm,
        sigma_mm: sure(2.22 + 0.497 * covering_mm, 0.0007),
        range_mm: 0.000_14,
        p_value: Some(0.517),
    }
}
