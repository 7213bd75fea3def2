//! Pages of made-up calibrations and studies: what they show, and what they must not.
//!
//! With `TACTUS_REPORT_DIR` set, two of them are also written there, to be looked at.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::{env, fs, path::Path};

use crate::made_up::{CURVATURE_PER_MM, FAULTY, empty, fault, report, sure, whole};
use tactus_calibrate::{Calibration, FaultKind, ResponseForm};
use tactus_model::{Array, Registration};
use tactus_report::calibration::{
    CalibrationReport, calibration_html, health_map, point_spreads, recalibrated, responses, sensitivity_map,
    spread_against_thickness,
};
use tactus_report::study::{ComparedQuantity, FoundValue, StudyFigure, StudyReport, StudyRun, study_html};

const HOSTILE: &str = "<img src=x onerror='alert(\"1\")'>";

fn page(calibration: &Calibration) -> String {
    calibration_html(&report(&Array::digitacts(), calibration))
}

/// Writes a page to be looked at, if that is asked for.
fn show(name: &str, html: &str) {
    if let Ok(dir) = env::var("TACTUS_REPORT_DIR") {
        fs::write(Path::new(&dir).join(name), html).unwrap();
    }
}

/// Where texts stand on a page; they must all be there, in this order.
fn assert_in_order(html: &str, texts: &[&str]) {
    let mut from = 0;
    for text in texts {
        let at = html[from..].find(text);
        from += at.unwrap_or_else(|| panic!("{text:?} is missing or out of order"));
    }
}

#[test]
fn what_to_beware_of_comes_before_every_number_that_was_found() {
    let html = page(&whole());
    show("calibration.html", &html);
    assert_in_order(
        &html,
        &[
            "SIMULATED",
            "No physical sensor was read",
            "<dt>presses</dt><dd>2778</dd>",
            "12 left out",
            "Could not be determined",
            "Surface: one depth",
            "To know before using a number",
            "14 presses contradict",
            "<h2>Registration</h2>",
            "Faulty elements",
            "Response of the elements</h2>",
            "Spread of the coverings",
            "Spread against thickness",
        ],
    );
    let real =
        calibration_html(&CalibrationReport { simulated: false, ..report(&Array::digitacts(), &whole()) });
    assert!(!real.contains("SIMULATED") && !real.contains("No physical sensor"));
}

#[test]
fn numbers_have_the_digits_of_their_errors() {
    let html = page(&whole());
    for row in [
        "<td>origin x / mm</td><td class=\"n\">20</td><td class=\"n\">20.06032 \u{b1} 0.00031</td>\
         <td class=\"n\">20.05972 to 20.06093</td><td class=\"n\">+0.06032</td>",
        "<td>height of the surface / mm</td><td class=\"n\">0</td><td class=\"n\">not determined</td>",
        "<td>scale (check)</td><td class=\"n\">1</td><td class=\"n\">0.99996 \u{b1} 0.00005</td>",
        "<td class=\"n\">1.016</td><td class=\"n\">0.305 (30 %)</td><td class=\"n\">2.7250 \u{b1} 0.0007</td>",
        "<td class=\"n\">1.36248 \u{b1} 0.00035</td><td class=\"n\">0.999969</td><td class=\"n\">222 (3 left out)</td>",
        "<td>linear: b</td><td class=\"n\">0.49697 \u{b1} 0.00026</td><td class=\"n\">0.49646 to 0.49748</td>\
         <td class=\"n\">0.497</td><td class=\"n\">0.497</td>",
        "<td>quadratic, one curvature</td><td class=\"n\">0.650</td><td class=\"n\">0.800</td><td>chosen</td>",
        "<td class=\"n\">47</td><td>(5, 7)</td><td>sound</td><td class=\"n\">100.0 \u{b1} 0.6</td>\
         <td class=\"n\">1047.0 \u{b1} 1.3</td><td class=\"n\">0.1500 \u{b1} 0.0010</td>",
    ] {
        assert!(html.contains(row), "{row}");
    }
    // 1.362476 pitches; the paper states 1.36.
    assert!(html.contains("<td class=\"n\">1.362</td>"), "Eq. 4 is in the row");
    assert!(html.contains("(p-value if it holds: &lt; 0.001)"));
    assert!(
        html.contains("press 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11 of corners-1 and 2 more."),
        "12 of 14 presses are named"
    );
}

#[test]
fn faulty_elements_are_named_and_marked() {
    let html = page(&whole());
    assert!(html.contains("<td class=\"n\">18</td><td>(2, 2)</td><td>cross-wired to 19 (2, 3)</td>"));
    assert!(html.contains("<td>dead</td>") && html.contains("<td>stuck at 123</td>"));
    assert!(html.contains("<td>noisy, 31.3 counts rms</td>"));
    assert!(html.contains("48 elements in all: 43 sound, 4 faulty, 1 not judged."));
    let map = health_map(&Array::digitacts(), &whole().health).to_string();
    // One more of each in the legend.
    assert_eq!(map.matches("class=\"line red\"").count(), FAULTY.len() + 1);
    assert_eq!(map.matches("class=\"line amber\"").count(), 2);
    assert_eq!(map.matches("class=\"line muted\"").count(), 43 + 1);
    assert_eq!(map.matches("class=\"line blue\"").count(), 1);
}

#[test]
fn a_calibration_that_found_nothing_says_so() {
    let html = page(&empty());
    assert_eq!(html.matches("<p>Not determined").count(), 3);
    assert!(html.contains("No fault was found") && html.contains("0 sound, 0 faulty, 48 not judged"));
    assert!(html.contains("coverings pressed</th><td>none"));
    assert!(html.ends_with("</main>\n</body>\n</html>\n"));
}

#[test]
fn parts_that_are_missing_leave_the_others() {
    let mut one_covering = whole();
    one_covering.spreads.truncate(2);
    let thickness = one_covering.thickness.as_mut().unwrap();
    thickness.coverings.truncate(1);
    (thickness.linear, thickness.quadratic) = (None, None);
    let html = page(&one_covering);
    // 2.22 + 0.497 x 1.016 less the declared slope leaves the declared intercept.
    assert!(html.contains(
        "With the declared slope of 0.497, its spread gives an intercept of 2.2200 \u{b1} 0.0007 mm."
    ));
    assert!(html.contains("Figure 5a") && !html.contains("distance from the line / "));

    let mut undecided = whole();
    let response = undecided.response.as_mut().unwrap();
    response.form = ResponseForm::Linear;
    response.shared_quadratic_per_mm = None;
    response.trials.iter_mut().for_each(|trial| trial.heldout_rms_counts = None);
    let html = page(&undecided);
    assert!(html.contains("<td>default</td>") && html.contains("depths are too few for parabolas"));
    assert!(!responses(undecided.response.as_ref().unwrap()).to_string().contains("quadratic"));
    response_of_nothing();
}

fn response_of_nothing() {
    let mut nothing = whole();
    nothing.response.as_mut().unwrap().elements.clear();
    let html = page(&nothing);
    assert!(html.contains("No element was fitted") && !html.contains("NaN"));
}

#[test]
fn a_line_that_is_no_spread_is_refused() {
    let mut falling = whole();
    falling.thickness.as_mut().unwrap().linear.as_mut().unwrap().coefficients[1] = sure(-0.1, 0.01);
    assert!(page(&falling).contains("A model cannot have this spread"));
}

#[test]
fn recalibrated_elements_lie_on_one_another() {
    let response = whole().response.unwrap();
    let drawn = |svg: String| -> Vec<String> {
        let dotted =
            svg.split("<path class=\"line ink\"").skip(1).filter(|path| path.contains("stroke-opacity"));
        dotted.filter_map(|path| path.split(" d=\"").nth(1)?.split('"').next().map(str::to_owned)).collect()
    };
    let before = drawn(responses(&response).to_string());
    let mut after = drawn(recalibrated(&response).to_string());
    assert_eq!((before.len(), after.len()), (43, 43));
    after.dedup();
    assert_eq!(after.len(), 1, "all elements of one form become the same");
    assert_ne!(before[0], before[42]);
    // rise - line = s (u + k u^2) - 1.08 mean(s) u, of which nothing is left after.
    let sensitivities: Vec<f64> = response.elements.iter().map(|one| 1000.0 + one.element as f64).collect();
    let line = 1.08 * sensitivities.iter().sum::<f64>() / 43.0;
    let off = |s: f64, u: f64| (s * (u + CURVATURE_PER_MM * u * u) - line * u).powi(2);
    let squares = sensitivities.iter().flat_map(|s| [0.2, 0.3, 0.4, 0.5, 0.6].map(|u| off(*s, u)));
    let before = (squares.sum::<f64>() / (5.0 * 43.0)).sqrt();
    let said = format!(
        "The distance of the readings from one line for all is {before:.1} counts rms before and 0.000"
    );
    assert!(page(&whole()).contains(&said), "{said}");
}

#[test]
fn sensitivities_of_both_signs_have_no_mean() {
    let mut signed = whole();
    let first = &mut signed.response.as_mut().unwrap().elements[0];
    first.sensitivity_counts_per_mm.value *= -1.0;
    let html = page(&signed);
    assert!(html.contains("The sensitivities have both signs: no mean is drawn."));
}

#[test]
fn figures_stand_alone_on_arrays_of_every_kind() {
    let row = Array::new("row", [0.4, 0.4], vec![0.25, 0.75], vec![0.25], 50.0, 4095.0, 1.0).unwrap();
    let calibration = whole();
    let (response, thickness) =
        (calibration.response.as_ref().unwrap(), calibration.thickness.as_ref().unwrap());
    for array in Array::shipped().into_iter().chain([row]) {
        for svg in [
            responses(response).to_string(),
            recalibrated(response).to_string(),
            sensitivity_map(&array, response).to_string(),
            health_map(&array, &calibration.health).to_string(),
            spread_against_thickness(&calibration.spreads, thickness, array.pitch_mm()).to_string(),
            point_spreads(thickness, array.pitch_mm()).to_string(),
        ] {
            assert!(svg.starts_with("<svg xmlns=") && svg.ends_with("</svg>"));
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{}", array.name());
        }
        assert!(!calibration_html(&report(&array, &calibration)).contains("NaN"));
    }
}

#[test]
fn pages_load_nothing_and_escape_all_text() {
    let mut calibration = whole();
    calibration.data.runs.push(HOSTILE.into());
    calibration.health.faults.push(fault(47, FaultKind::Dead, HOSTILE));
    calibration.missing.push(HOSTILE.into());
    calibration.warnings.push(HOSTILE.into());
    let registration = calibration.registration.as_mut().unwrap();
    registration.runs.push(HOSTILE.into());
    registration.left_out.insert(0, (HOSTILE.into(), 3));
    let array = Array::new(HOSTILE, [1.8; 2], vec![0.9, 2.9], vec![0.9], 30.0, 4095.0, 1.0).unwrap();
    let said = [HOSTILE.to_owned()];
    let report = CalibrationReport { rig: HOSTILE, notes: &said, ..report(&array, &calibration) };
    let rows = [ComparedQuantity {
        quantity: HOSTILE.into(),
        unit: HOSTILE.into(),
        paper: Some(HOSTILE.into()),
        found: FoundValue::Text(HOSTILE.into()),
        truth: None,
        inside: None,
        note: HOSTILE.into(),
    }];
    let runs = [StudyRun {
        name: HOSTILE.into(),
        run_id: HOSTILE.into(),
        presses: 1,
        duration_s: 1.0,
        path: HOSTILE.into(),
    }];
    let figures = [StudyFigure {
        number: HOSTILE.into(),
        title: HOSTILE.into(),
        caption: HOSTILE.into(),
        svg: String::new(),
    }];
    let study = StudyReport {
        rig: HOSTILE,
        simulated: true,
        runs: &runs,
        quantities: &rows,
        calibration: Some(report),
        figures: &figures,
        missing: &said,
        warnings: &said,
    };
    let escaped = "&lt;img src=x onerror=&#39;alert(&quot;1&quot;)&#39;&gt;";
    for (html, times) in [(calibration_html(&report), 10), (study_html(&study), 24)] {
        assert!(!html.contains("<img"), "markup came through");
        assert_eq!(html.matches(escaped).count(), times);
        // Links to its own sections load nothing.
        let html =
            html.replace("http://www.w3.org/2000/svg", "").replace(escaped, "").replace("href=\"#", "");
        for outside in ["http:", "https:", "//", "url(", "src=", "href=", "<script", "@import", "<link"] {
            assert!(!html.contains(outside), "{outside}");
        }
    }
}

#[test]
fn a_study_compares_first_and_shows_every_figure_in_the_order_of_the_paper() {
    let (array, calibration) = (Array::digitacts(), whole());
    let row = |quantity: &str, paper: Option<&str>, found, truth, inside| ComparedQuantity {
        quantity: quantity.into(),
        unit: "mm".into(),
        paper: paper.map(Into::into),
        found,
        truth,
        inside,
        note: String::new(),
    };
    let rows = [
        row("origin x", None, FoundValue::Estimate(sure(20.060_324, 0.000_309)), Some(20.0604), Some(true)),
        row("origin y", None, FoundValue::Estimate(sure(14.959_415, 0.000_376)), Some(14.9), Some(false)),
        row("best spread", Some("0.3"), FoundValue::Nothing, None, None),
    ];
    let figure = |number: &str| StudyFigure {
        number: number.into(),
        title: format!("Drawing {number}"),
        caption: String::new(),
        svg: format!("<svg id=\"f{number}\"></svg>"),
    };
    let figures = ["", "8a", "10b", "3b", "6a", "3a"].map(figure);
    let runs = [StudyRun {
        name: "grid-sweep".into(),
        run_id: "grid-2".into(),
        presses: 2_700,
        duration_s: 11_100.0,
        path: "runs/grid-2/recording.mcap".into(),
    }];
    let study = StudyReport {
        rig: "bench-3",
        simulated: true,
        runs: &runs,
        quantities: &rows,
        calibration: Some(report(&array, &calibration)),
        figures: &figures,
        missing: &[],
        warnings: &["Beware.".to_owned()],
    };
    let html = study_html(&study);
    show("study.html", &html);
    assert_in_order(
        &html,
        &[
            "SIMULATED",
            "2700 presses, 3 h 5 min",
            "Beware.",
            "<td class=\"n\">20.06032 \u{b1} 0.00031</td><td class=\"n\">20.05972 to 20.06093</td><td class=\"n\">20.0604</td><td class=\"good\">yes</td>",
            "<td class=\"bad\">no</td>",
            "<td class=\"n\">0.3</td><td class=\"n\">not determined</td>",
            "1 of 2 known truths lie inside",
            "runs/grid-2/recording.mcap",
            "Figure 2a.",
            "Figure 2b.",
            "id=\"f3a\"",
            "id=\"f3b\"",
            "Figure 5a.",
            "Figure 5b.",
            "id=\"f6a\"",
            "id=\"f8a\"",
            "id=\"f10b\"",
            "<h2>Drawing </h2>",
            "The calibration",
            "<h2>Registration</h2>",
        ],
    );
    assert_eq!(
        html.matches("Figure 5a").count(),
        3,
        "as a heading, in the list of sections, and as the drawing's name"
    );

    let bare = StudyReport {
        calibration: None,
        quantities: &[],
        runs: &[],
        figures: &[],
        simulated: false,
        ..study
    };
    let html = study_html(&bare);
    assert!(
        html.contains("Nothing was found.")
            && html.contains("No run was made.")
            && html.contains("There is no calibration.")
    );
    assert!(!html.contains("SIMULATED") && html.ends_with("</html>\n"));
}

#[test]
fn a_declared_place_keeps_its_digits() {
    let array = Array::digitacts();
    let calibration = whole();
    let declared_registration = Registration { origin_mm: [20.0604, 14.9594], rotation_deg: 0.2 };
    let html = calibration_html(&CalibrationReport { declared_registration, ..report(&array, &calibration) });
    assert!(html.contains("<td>origin x / mm</td><td class=\"n\">20.0604</td>"));
}
