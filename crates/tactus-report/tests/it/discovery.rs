//! Pages and numbers of made-up discoveries: what they say, and what they must not.
//!
//! With `TACTUS_REPORT_DIR` set, the pages are also written there, to be looked at.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::{env, fs, path::Path};

use crate::made_up::discovery::{
    cannot_judge, data, draft, empty, explained, faulty, nothing_missing, report, unexplained,
};
use serde_json::Value;
use tactus_discover::{
    Because, Closed, Discovery, DraftedEffect, Estimated, FittedCurve, FittedKnot, Gap, GivenUp, GlobalTest,
    LeftOut, NextExperiment, NoDraft, RefutedFormula, Round, TriedEffect, Unexplained, Verdict,
};
use tactus_model::effect::Definition;
use tactus_model::{Array, Effect};
use tactus_report::discovery::{
    ActiveRun, AmbiguousEffect, DiscoveryReport, LabEffect, closed, discovery_html, discovery_json,
    element_maps, flags, gap_in_words, in_words, not_proposed, not_shown, proposals, residual_against,
    staircase,
};
use tactus_schema::draft::DraftStatus;

const HOSTILE: &str = "<img src=x onerror='alert(\"1\")'>";

fn json(discovery: &Discovery) -> Value {
    serde_json::from_str(&discovery_json(&report(&Array::digitacts(), &data(), discovery))).unwrap()
}

fn html(discovery: &Discovery) -> String {
    discovery_html(&report(&Array::digitacts(), &data(), discovery))
}

/// Writes a page to be looked at, if that is asked for.
fn show(name: &str, html: &str) {
    if let Ok(dir) = env::var("TACTUS_REPORT_DIR") {
        fs::write(Path::new(&dir).join(name), html).unwrap();
    }
}

#[test]
fn the_json_has_every_field_of_its_schema_where_it_belongs() {
    let found = json(&explained());
    for (place, value) in [
        ("/schema", "\"tactus.discovery/1\""),
        ("/data/1/id", "\"grid-sweep-2\""),
        ("/data/1/frames", "16000"),
        ("/data/1/presses", "50"),
        ("/seed", "7"),
        ("/noise_rms_counts", "2.0"),
        ("/base/heldout_rms_counts", "9.36"),
        ("/base/heldout_chi2", "21.902399999999997"),
        ("/base/heldout_rms_noise", "4.68"),
        ("/base/heldout_variance_counts2", "87.60959999999999"),
        ("/final/structured/of", "\"readings with a signal\""),
        ("/final/structured/upper95_counts", "0.7141428428542855"),
        ("/floor/source", "\"repeats in time\""),
        ("/tolerance/counts", "2.5"),
        ("/tolerance/declared", "\"beforehand\""),
        ("/gap/0/where/covariate", "\"time since contact\""),
        ("/gap/0/where/range", "[0.4,30.0]"),
        ("/gap/0/effect_size", "3.81"),
        ("/gap/0/q_value", "1e-9"),
        ("/steps/0/effect", "\"hysteresis\""),
        ("/steps/0/parameters/loss_share", r#"{"se":0.0041,"value":0.1234}"#),
        ("/steps/0/p_value", "3e-7"),
        ("/steps/0/q_value", "0.0017"),
        ("/steps/0/heldout_rms_before", "9.12"),
        ("/steps/0/heldout_rms_after", "2.08"),
        ("/steps/0/equivalent", "[\"backlash\"]"),
        ("/steps/1/equivalent", "[]"),
        ("/final/heldout_rms_counts", "2.08"),
        ("/final/shrink", "0.9961"),
        ("/verdict", "\"explained\""),
        ("/unexplained/depends_on", "[]"),
        ("/unexplained/share", "0.0039"),
        ("/next_experiments/0/experiment", "\"diagnose\""),
        ("/next_experiments/0/separates", "[\"hysteresis\",\"backlash\"]"),
        ("/next_experiments/0/expected_z", "11.3"),
        ("/next_experiments/0/seed", "2718281828"),
        ("/open_questions/0/separates", "[\"miswired\",\"crosstalk\"]"),
        ("/left_out/0/reason", "\"deep.star:7: no sample\""),
        ("/active_ended", "null"),
        ("/not_shown/2/effect", "\"imprint\""),
        ("/rounds/1/taken", "\"gain-drift\""),
        ("/rounds/3/taken", "null"),
        ("/given_up/0/effect", "\"gain-drift\""),
        ("/given_up/0/closed_share", "null"),
        ("/staircase/0/with", "\"base model\""),
        ("/staircase/3/heldout_rms_counts", "2.08"),
        ("/unexplained/gap", "[]"),
        ("/lab", "[]"),
        ("/curves/11/points/15/se", "0.00296875"),
        ("/elements/47/before_rms_counts", "15.75"),
        ("/simulated", "true"),
    ] {
        let is = found.pointer(place).unwrap_or_else(|| panic!("{place} is missing")).to_string();
        assert_eq!(is, value, "{place}");
    }
    assert_eq!(found["data"][0]["sha256"].as_str().unwrap().len(), 64);
}

#[test]
fn an_effect_with_knots_has_them_beside_its_formula() {
    let mut discovery = explained();
    let knot = |at: f64, value: f64, standard_error| FittedKnot { at, value, standard_error };
    discovery.steps[0].curves = vec![FittedCurve {
        at: "at_mm",
        of: "loss_share",
        knots: vec![knot(0.05, 0.31, Some(0.02)), knot(0.4, 0.77, None)],
        formula: Some(RefutedFormula { values: vec![0.05, 0.4], heldout_rms_counts: 3.45 }),
    }];
    let (page, json) = (html(&discovery), json(&discovery));
    show("knots.html", &page);
    for part in ["refute its formula", "would be 3.45 counts", "at_mm", "0.31", "Free curve of hysteresis"] {
        assert!(page.contains(part), "{part}");
    }
    assert_eq!((&json["steps"][0]["form"], &json["steps"][1]["form"]), (&"knots".into(), &"formula".into()));
    let knots = &json["steps"][0]["knots"];
    assert_eq!(knots["points"][0].to_string(), r#"{"at":0.05,"formula":0.05,"se":0.02,"value":0.31}"#);
    assert_eq!((&knots["at"], &knots["heldout_rms_formula"]), (&"at_mm".into(), &3.45.into()));
    assert_eq!(json["steps"][0]["tables"].to_string(), "[]");
}

#[test]
fn an_effect_with_a_table_shows_it() {
    let mut discovery = explained();
    let knot = |at: f64, value: f64| FittedKnot { at, value, standard_error: Some(0.02) };
    discovery.steps[0].curves = vec![FittedCurve {
        at: "depth_mm",
        of: "ratio",
        knots: vec![knot(0.0, 0.81), knot(0.4, 1.0)],
        formula: None,
    }];
    let (page, json) = (html(&discovery), json(&discovery));
    show("table.html", &page);
    for part in ["No one value of <code>ratio</code>", "<code>depth_mm</code>", "0.81", "Table of hysteresis"]
    {
        assert!(page.contains(part), "{part}");
    }
    let step = &json["steps"][0];
    assert_eq!((&step["form"], &step["knots"]), (&"table".into(), &Value::Null));
    let table = r#"{"by":"depth_mm","parameter":"ratio","points":[{"at":0.0,"se":0.02,"value":0.81},{"at":0.4,"se":0.02,"value":1.0}]}"#;
    assert_eq!(step["tables"][0].to_string(), table);
}

#[test]
fn a_draft_has_its_sentence_its_curve_and_what_speaks_for_it() {
    let mut discovery = explained();
    discovery.draft = Some(Ok(Box::new(draft())));
    let page = html(&discovery);
    show("draft.html", &page);
    for part in [
        "Draft of an effect",
        "a share &lt;that&gt; follows",
        "badge warn\">drafted<",
        "Curve of draft-1",
        "power: scale \u{2212}0.0125, exponent 2.00",
        "sum of signals, 0.00 to 4.00 mm (times the mean sensitivity: 0 to 4000 counts)",
        "saturation (behind by 76.2 in the logarithm of the odds), hardening (behind by 98.0)",
        "depth in contact, by temperature",
        "5 of 5",
        "3.45 counts rms",
        "93 %",
    ] {
        assert!(page.contains(part), "{part}");
    }
    let json = json(&discovery);
    let draft = &json["draft"];
    assert_eq!(
        (&draft["status"], &draft["stage"], &draft["law"]),
        (&"drafted".into(), &"element".into(), &"power".into())
    );
    assert_eq!(draft["knots"][1].to_string(), r#"{"at":2.0,"formula":-0.05,"se":0.002,"value":-0.05}"#);

    let closed = Some(Closed { share: 0.4, standard_error: None, most: f64::INFINITY });
    discovery.draft = Some(Ok(Box::new(DraftedEffect { closed, ..self::draft() })));
    assert!(html(&discovery).contains("badge warn\">partial<"));
    discovery.draft = Some(Err(NoDraft::Class("hardening")));
    assert!(html(&discovery).contains("None: hardening of the library explains nearly as much."));
    assert_eq!(
        self::json(&discovery)["draft"]["none_because"],
        "hardening of the library explains nearly as much"
    );
    discovery.draft = None;
    assert!(!html(&discovery).contains("Draft of an effect"));
}

/// A discovery with every kind of field filled, compared byte for byte with `golden/discovery.json`.
///
/// With `TACTUS_WRITE_GOLDEN` set, the file is written anew.
#[test]
fn the_json_keeps_its_form_to_the_byte() {
    let mut discovery = explained();
    discovery.curves.truncate(1);
    discovery.curves[0].points.truncate(2);
    discovery.elements.truncate(2);
    discovery.heldout_frames.clear();
    discovery.faulty = faulty().faulty;
    discovery.tentative = discovery.steps[..1].to_vec();
    discovery.draft = Some(Ok(Box::new(draft())));
    discovery.global = discovery.global.map(|global| GlobalTest { statistic: f64::NAN, ..global });
    discovery.base.heldout_chi2 = Some(f64::INFINITY);
    let undecided = |equivalent| AmbiguousEffect { effect: "hysteresis", equivalent };
    let active = [ActiveRun {
        experiment: "diagnose".into(),
        parameters: vec![("parts", "hold".into()), ("depth_mm", "0.5".into())],
        recording: "run-3".into(),
        duration_s: 61.5,
        separates: ["hysteresis".into(), "backlash".into()],
        expected_z: None,
        before: vec![undecided(vec!["backlash"])],
        after: vec![undecided(vec![])],
    }];
    let (array, data, notes) = (Array::digitacts(), data(), ["one note".to_owned()]);
    let settled = ["draft-1 is confirmed".to_owned()];
    let lab =
        [LabEffect { name: "grounding".into(), status: DraftStatus::Confirmed, version: "5a".repeat(32) }];
    let report = DiscoveryReport {
        notes: &notes,
        active: &active,
        settled: &settled,
        lab: &lab,
        ..report(&array, &data, &discovery)
    };
    let text = discovery_json(&report);
    if env::var_os("TACTUS_WRITE_GOLDEN").is_some() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/it/golden/discovery.json");
        fs::write(path, &text).unwrap();
    }
    assert_eq!(text, include_str!("golden/discovery.json"));
}

#[test]
fn what_held_out_presses_do_not_confirm_is_tentative() {
    let mut discovery = explained();
    assert!(!in_words(&discovery).contains("Tentative"));
    discovery.tentative = vec![discovery.steps.remove(0)];
    let name = discovery.tentative[0].effect;
    let text = in_words(&discovery);
    assert!(text.contains(&format!("Tentative: {name}: presses that its fit has not seen")), "{text}");
}

#[test]
fn a_name_that_is_only_the_nearest_is_tentative_with_what_it_closes() {
    let mut discovery = explained();
    discovery.tentative = vec![discovery.steps.remove(0)];
    let effect = discovery.tentative[0].effect;
    discovery.given_up.push(GivenUp { effect, because: Because::Far(0.62) });
    let text = in_words(&discovery);
    assert!(text.contains(&format!("Tentative: {effect}: it comes nearest, and closes 62 %")), "{text}");
    assert_eq!(json(&discovery)["given_up"][1]["closed_share"], 0.62);
}

#[test]
fn an_effect_that_acts_twice_has_its_parameters_twice() {
    let step = &json(&explained())["steps"][1];
    let names: Vec<&String> = step["parameters"].as_object().unwrap().keys().collect();
    assert_eq!(names.len(), 8);
    assert_eq!(step["parameters"]["element"]["value"], 18.0);
    assert_eq!(step["parameters"]["element#2"], serde_json::json!({ "value": 19.0, "se": null }));
    assert_eq!(step["terms"][1]["element"]["value"], 19.0);
}

#[test]
fn what_is_not_known_is_null_and_the_text_is_always_the_same() {
    let found = json(&empty());
    for place in ["/noise_rms_counts", "/base/heldout_rms_counts", "/global/p_value", "/final/shrink"] {
        assert_eq!(found.pointer(place), Some(&Value::Null), "{place}");
    }
    let (array, data, whole) = (Array::digitacts(), data(), explained());
    let text = || discovery_json(&report(&array, &data, &whole));
    assert_eq!(text(), text());
}

#[test]
fn the_verdict_says_what_it_rests_on() {
    assert_eq!(
        in_words(&explained()),
        "The model was missing hysteresis (or backlash) and miswired. On held-out presses the residual falls from 9.36 to 2.08 counts rms, which \
         closes 99.6 % +- 0.4 % of the gap between model and noise; the noise is 2.00 counts, from repeats in time. Of readings with a signal, 0.29 \
         times the noise (0.57 counts) is not noise; with 95 % confidence it is at most 0.36 times the noise (0.71 counts). A structured \
         residual of 2.50 counts was declared tolerable beforehand. Faulty: element 18 answers for 19 and element 19 answers for 18."
    );
    assert_eq!(
        in_words(&nothing_missing()),
        "The model is missing no effect that these data can show: on held-out presses its residual is 2.01 counts rms and the noise is \
         2.00 counts, from repeats in time. The probability of as much structure by noise alone is 0.431. Of readings with a signal, 0.10 \
         times the noise (0.20 counts) is not noise; with 95 % confidence it is at most 0.13 times the noise (0.25 counts)."
    );
    assert_eq!(
        in_words(&unexplained()),
        "The model is missing something that no known effect matches: on held-out presses its residual is 9.36 counts rms and the noise \
         is 2.00 counts, from repeats of a place. Of readings with a signal, 4.6 times the noise (9.1 counts) is not noise; with 95 % \
         confidence it is at most 5.7 times the noise (11 counts). What is left depends on time since contact and depth. \
         hysteresis alone would close 82 % of it, but is not named: what explains more has no name in the library: a dependence on place along \
         x."
    );
    assert_eq!(
        in_words(&cannot_judge()),
        "Nothing can be judged: no frame and no press of these data repeats another, so noise and missing physics look the same. On \
         held-out presses the residual is 54.0 counts rms. Give a run that rests and repeats a press together with these data, such as \
         `tactus run diagnose -p parts=drift,repeats`."
    );
    let partly = Discovery {
        verdict: Verdict::PartlyExplained,
        unexplained: Unexplained { depends_on: vec!["temperature"], gap: vec![], share: 0.3 },
        ..explained()
    };
    assert!(in_words(&partly).ends_with(
        "What is left depends on temperature. Faulty: element 18 answers for 19 and element 19 answers for 18."
    ));
}

#[test]
fn a_residual_falls_only_where_it_does_and_what_closes_nothing_is_not_shown() {
    let mut found = explained();
    let level = |found: &mut Discovery, counts| found.final_.level.heldout_rms_counts = counts;
    found.base.heldout_rms_counts = 3.49;
    found.final_.closed = Some(Closed { share: -0.01, standard_error: None, most: f64::INFINITY });
    level(&mut found, 3.501);
    let told = in_words(&found);
    let wanted = "On held-out presses the residual goes from 3.49 to 3.50 counts rms: held-out presses do not show them; the noise";
    assert!(told.contains(wanted), "{told}");
    found.steps.truncate(1);
    level(&mut found, 3.491);
    let told = in_words(&found);
    assert!(
        told.contains("the residual stays at 3.49 counts rms: held-out presses do not show it; the noise"),
        "{told}"
    );
}

#[test]
fn what_a_class_explains_nearly_as_well_is_not_said_to_match_none() {
    let nearly = Discovery { draft: Some(Err(NoDraft::Class("softening"))), ..unexplained() };
    let told = in_words(&nearly);
    let wanted = "The model is missing something that no effect explains well enough (the nearest is softening): on held-out presses";
    assert!(told.starts_with(wanted), "{told}");
    let partly = Discovery { verdict: Verdict::PartlyExplained, draft: nearly.draft, ..explained() };
    let told = in_words(&partly);
    let wanted = ", and something more that no effect explains well enough (the nearest is softening). On held-out presses";
    assert!(told.contains(wanted), "{told}");
}

#[test]
fn faulty_elements_are_listed_with_their_evidence_and_have_no_figure() {
    let discovery = faulty();
    assert_eq!(
        in_words(&discovery),
        "The model was missing miswired. On held-out presses the residual is 2.01 counts rms; the noise is 2.00 counts, from \
         repeats in time. Of readings with a signal, 0.10 times the noise (0.20 counts) is not noise; with 95 % confidence it is at most \
         0.13 times the noise (0.25 counts). Faulty: elements 5 and 39 are dead, element 12 is stuck, element 30 is noisy, element 18 answers for 19 and element 19 answers for 18."
    );
    let html = html(&discovery);
    show("faulty.html", &html);
    for text in [
        "<h2>Faulty elements</h2>",
        "<td class=\"n\">39</td><td>(4, 7)</td><td>dead</td><td class=\"prose\">rises by 2.0 +- 3.3 counts per mm</td>",
        "<td>stuck at 812</td>",
        "<td>cross-wired to 19 (2, 3)</td>",
        "<td>noisy, 31.4 counts rms</td>",
    ] {
        assert!(html.contains(text), "{text}");
    }
    let found = json(&discovery);
    assert_eq!(found["faulty"][0]["kind"], serde_json::json!({ "kind": "dead" }));
    assert_eq!(found["faulty"][2]["kind"], serde_json::json!({ "kind": "cross-wired", "answers_for": 19 }));
    assert_eq!(found["faulty"][4]["evidence"], "rises by 2.0 +- 3.3 counts per mm");
    assert_eq!(found["elements"][5]["before_rms_counts"], Value::Null);
    let map = element_maps(&Array::digitacts(), &discovery.elements, Some(2.0)).to_string();
    assert!(!map.contains("grown") && map.matches("h1v1h-1z").count() == 44);
}

#[test]
fn without_a_fault_no_page_speaks_of_faults() {
    assert!(!html(&nothing_missing()).contains("Faulty"));
}

#[test]
fn effects_that_cannot_be_shown_stand_by_their_reason() {
    let found = explained();
    let reasons = not_shown(&found);
    assert_eq!(reasons.len(), 2);
    assert_eq!(reasons[1].1, ["softening", "imprint"]);
}

#[test]
fn what_cannot_be_shown_comes_first_and_what_it_rests_on_last() {
    let html = html(&explained());
    show("discovery.html", &html);
    let mut from = 0;
    for text in [
        "SIMULATED",
        "No physical sensor was read",
        "Effects that these data cannot show",
        "softening, imprint: no press is followed",
        "To know before using a number",
        ">explained</span>",
        "The model was missing hysteresis (or backlash) and miswired.",
        "Where the gap is",
        "The residual against each covariate",
        "The residual of each element",
        "The largest is that of element 47, 15.8 counts rms, 7.88 times the noise; with the grown model that of element 47, 2.47 counts rms, 1.24 times the noise.",
        "What was tried",
        "taken, given up later",
        "Round 4: the model has misregistration, hysteresis and miswired",
        "<h3>Given up</h3>",
        "<li>gain-drift: hysteresis explains more in its place (with misregistration it closes 61 % of the gap).</li>",
        "What was added",
        "The gap before and after",
        "What stays unexplained",
        "What to measure next",
        "<code>tactus run diagnose -p parts=approach</code>",
        "distinguishes hysteresis from backlash (z = 11)",
        "<h2>Data</h2>",
        "no physical sensor was read",
    ] {
        let at = html[from..].find(text);
        from += at.unwrap_or_else(|| panic!("{text:?} is missing or out of order"));
    }
    let (array, data, whole) = (Array::digitacts(), data(), explained());
    let measured = discovery_html(&DiscoveryReport { simulated: false, ..report(&array, &data, &whole) });
    assert!(!measured.contains("SIMULATED") && !measured.contains("No physical sensor"));
}

#[test]
fn the_pages_numbers_are_those_that_were_found() {
    let html = html(&explained());
    for text in [
        "<dd>9.36 <small>4.68 &#215; noise</small></dd>",
        "<dt>gap closed</dt><dd>99.6 % <small>&#177; 0.4 %</small></dd>",
        "<dd>96 <small>24 held out</small></dd>",
        "<td>time since contact</td><td class=\"n\">0.4</td><td class=\"n\">30.0</td><td>s</td><td class=\"n\">3.81</td><td class=\"n\">&lt; 0.001</td>",
        "<td>hysteresis</td><td class=\"n\">39.4</td><td class=\"n\">&lt; 0.001</td><td class=\"n\">4.31</td><td class=\"n\">2.15</td><td class=\"n\">82 %</td><td class=\"prose\">taken</td>",
        "Scored only: hardening (3.2, p 0.410) and crosstalk (1.1, p 1.000).",
        "Load and unload differ, independent of rate.",
        "<th class=\"n\">loss_share</th><th class=\"n\">threshold_mm</th>",
        "<td>found</td><td class=\"n\">0.123 \u{b1} 0.004</td><td class=\"n\">0.0510 \u{b1} 0.0020</td>",
        "<td>possible range</td><td class=\"n\">\u{2212}1 to 5</td><td class=\"n\">0.001 to 2</td>",
        "<td>found, 2</td><td class=\"n\">19</td><td class=\"n\">18</td>",
        "cannot distinguish it from backlash, which explains the fitted presses nearly as well",
        "<th class=\"n\">closed with it, by mean squares</th>",
        "closes 99.6 % +- 0.4 % of the base model's gap. The share is the fall of the mean square",
        "<td class=\"n\">13 %</td><td class=\"prose\">not taken: hysteresis has greater odds</td>",
        "each has at most 3 %; before the data each effect had a probability of 5 %.",
        "The data distinguish it from every other effect",
        "and fitted again with the rest: misregistration.",
        "<td>residual / noise</td><td class=\"n\">4.68</td><td class=\"n\">1.04</td>",
        "<td>its variance / counts\u{b2}</td><td class=\"n\">87.6</td><td class=\"n\">4.33</td>",
        "<td>structured at most (95 %) / noise</td><td class=\"n\">5.71</td><td class=\"n\">0.357</td>",
        "<dt>structured / noise, 95 % bound</dt><dd>0.286 <small>&#8804; 0.357</small></dd>",
        "<th>noise</th><td>2.00 counts rms, from repeats in time (90 % interval 1.93 to 2.08)</td>",
        "<th>tolerance</th><td>2.50 counts rms, declared beforehand</td>",
        "whole coverings</th><td>2.54 mm",
        "<td>grid-sweep-2</td><td class=\"n\">16\u{202f}000</td>",
    ] {
        assert!(html.contains(text), "{text}");
    }
    assert_eq!(html.matches("<title>Residual against").count(), 12);
}

#[test]
fn a_page_of_nothing_says_so() {
    let html = html(&nothing_missing());
    show("nothing-missing.html", &html);
    for text in [
        "can show every effect",
        ">nothing-missing</span>",
        "depends on no covariate",
        "Nothing: there is no structure",
        "<p>Nothing.</p>",
        "No experiment is proposed",
    ] {
        assert!(html.contains(text), "{text}");
    }
}

#[test]
fn what_no_effect_matches_has_no_name() {
    let html = html(&unexplained());
    show("unexplained.html", &html);
    for text in [
        ">unexplained</span>",
        "from repeats of a place",
        "depends on time since contact and depth",
        "None was taken: a dependence on place along x, which has no name, explains more.",
    ] {
        assert!(html.contains(text), "{text}");
    }
}

#[test]
fn what_cannot_be_judged_has_figures_in_counts_and_says_what_to_run() {
    let found = cannot_judge();
    let html = html(&found);
    show("cannot-judge.html", &html);
    for text in [
        ">cannot-judge</span>",
        "<dd>unknown</dd>",
        "<dd>54.0</dd>",
        "Nothing was tested",
        "Nothing: nothing can be judged.",
        "Unknown: these data do not tell it from noise.",
        "<code>tactus run diagnose -p parts=drift,repeats</code>",
        "distinguishes what is missing from noise",
    ] {
        assert!(html.contains(text), "{text}");
    }
    let found = json(&found);
    for (place, value) in [
        ("/verdict", "\"cannot-judge\""),
        ("/noise_rms_counts", "null"),
        ("/floor/source", "\"none\""),
        ("/base/heldout_rms_noise", "null"),
        ("/base/structured", "null"),
        ("/base/heldout_variance_counts2", "2916.0"),
        ("/global", "null"),
        ("/next_experiments/0/expected_z", "null"),
    ] {
        assert_eq!(found.pointer(place).unwrap().to_string(), value, "{place}");
    }
}

#[test]
fn no_page_has_a_number_that_is_none() {
    for discovery in [explained(), nothing_missing(), unexplained(), cannot_judge(), empty(), faulty()] {
        let html = html(&discovery);
        assert!(!html.contains("NaN") && !html.contains("inf"), "{:?}", discovery.verdict);
        assert!(html.ends_with("</main>\n</body>\n</html>\n"));
    }
}

#[test]
fn text_from_outside_is_escaped() {
    let mut hostile = explained();
    hostile.not_shown[0].reason = HOSTILE.into();
    hostile.warnings = vec![HOSTILE.into()];
    hostile.plan.left_out[0].reason = HOSTILE.into();
    hostile.plan.next[0].separates = [HOSTILE.into(), HOSTILE.into()];
    let mut data = data();
    (data[0].id, data[1].sha256) = (HOSTILE.into(), HOSTILE.into());
    let (array, notes) = (Array::digitacts(), [HOSTILE.to_owned()]);
    let report = DiscoveryReport { rig: HOSTILE, notes: &notes, ..report(&array, &data, &hostile) };
    let html = discovery_html(&report);
    assert!(!html.contains("<img") && html.contains("&lt;img src=x"));
    assert_eq!(serde_json::from_str::<Value>(&discovery_json(&report)).unwrap()["rig"], HOSTILE);
}

#[test]
fn figures_draw_what_was_found() {
    let found = explained();
    let curve = residual_against(&found.curves[1]).to_string();
    assert!(curve.contains("time since contact / s") && curve.contains("residual / share of the signal"));
    let maps = element_maps(&Array::digitacts(), &found.elements, Some(2.0)).to_string();
    assert!(maps.contains("units of the noise") && maps.matches("h1v1h-1z").count() == 96);
    let flat = nothing_missing();
    let [curve, map] = [
        residual_against(&flat.curves[1]).to_string(),
        element_maps(&Array::digitacts(), &flat.elements, Some(2.0)).to_string(),
    ];
    assert!([&curve, &map].iter().all(|figure| figure.contains("base") && !figure.contains("grown")));
    assert!(element_maps(&Array::digitacts(), &found.elements, None).to_string().contains("rms in counts"));
    let stairs = staircase(&found).to_string();
    for name in ["base model", "with hysteresis", "with miswired", "noise", "9.36, 4.68 \u{d7} noise", "2.08"]
    {
        assert!(stairs.contains(name), "{name}");
    }
}

#[test]
fn an_experiment_that_answers_several_questions_is_proposed_once() {
    let mut found = explained();
    let first = found.plan.next[0].clone();
    let separates = |one: &str, other: &str| [one.to_owned(), other.to_owned()];
    let parameters = vec![("parts", "hold".to_owned())];
    found.plan.next.extend([
        NextExperiment { separates: separates("imprint", "nothing"), parameters, ..first.clone() },
        NextExperiment { separates: separates("imprint", "nothing"), expected_z: Some(4.0), ..first.clone() },
        NextExperiment { separates: separates("relaxation", "nothing"), expected_z: Some(5.0), ..first },
    ]);
    let proposals = proposals(&found);
    let told: Vec<[&str; 2]> = proposals.iter().map(|one| [&*one.command, &*one.decides]).collect();
    assert_eq!(
        told,
        [
            [
                "tactus run diagnose -p parts=approach",
                "distinguishes hysteresis from backlash (z = 11); shows imprint (z = 4.0) and relaxation (z = 5.0)"
            ],
            ["tactus run diagnose -p parts=hold", "shows imprint (z = 11)"],
        ]
    );
}

#[test]
fn why_nothing_is_proposed_is_told() {
    let said = |found: &Discovery| not_proposed(found).join(" ");
    assert_eq!(said(&nothing_missing()), "No experiment is proposed: no two explanations are undecided.");
    assert!(said(&unexplained()).contains("what remains is no effect of the library"));
    let mut found = explained();
    assert_eq!(
        said(&found),
        "No experiment would distinguish miswired from crosstalk: none of those that would could be rehearsed. Left out: `tactus run \
         lab/deep.star`: deep.star:7: no sample."
    );
    let weak = NextExperiment { expected_z: Some(1.24), ..found.plan.next[0].clone() };
    found.plan.open[0].best = Some(weak);
    let same = LeftOut { experiment: "other.star".into(), ..found.plan.left_out[0].clone() };
    found.plan.left_out.push(same);
    assert_eq!(
        said(&found),
        "No experiment would distinguish miswired from crosstalk: the best, `tactus run diagnose -p parts=approach`, would show 1.2 \
         standard errors, and less than 2 is not worth its time. Left out: `tactus run lab/deep.star` and `tactus run other.star`: \
         deep.star:7: no sample."
    );
    assert!(html(&found).contains("Left out: `tactus run lab/deep.star`"));
}

#[test]
fn a_page_tells_why_no_further_experiment_was_run() {
    let (array, data, found) = (Array::digitacts(), data(), explained());
    let report =
        DiscoveryReport { active_ended: Some("the budget is <spent>"), ..report(&array, &data, &found) };
    assert!(discovery_html(&report).contains("<p>the budget is &lt;spent&gt;</p>"));
    let json: Value = serde_json::from_str(&discovery_json(&report)).unwrap();
    assert_eq!(json["active_ended"], "the budget is <spent>");
}

#[test]
fn a_parameter_at_the_end_of_its_range_or_within_its_error_is_flagged() {
    let mut discovery = explained();
    let [loss_share, threshold_mm] = &mut discovery.steps[0].terms[0][..] else { panic!("two parameters") };
    let range = Definition::find("hysteresis").unwrap().parameters[0].range;
    loss_share.value = range[1];
    (threshold_mm.value, threshold_mm.standard_error) = (0.03, Some(0.04));
    let html = html(&discovery);
    for text in [
        "loss_share is at the end of its range: the true value may lie beyond.",
        "threshold_mm has a standard error greater than its value: these data hardly determine it.",
    ] {
        assert!(html.contains(text), "{text}");
        assert!(json(&discovery)["steps"][0]["flags"].to_string().contains(text), "{text}");
    }
    assert!(!self::html(&explained()).contains("end of its range"));
    assert_eq!(json(&explained())["steps"][0]["flags"].to_string(), "[]");
}

#[test]
fn a_parameter_or_a_curve_without_an_error_is_tested_too() {
    let mut discovery = explained();
    let of_step = |discovery: &Discovery| flags(discovery, &discovery.steps[0]);
    let range = Definition::find("hysteresis").unwrap().parameters[0].range;
    let loss_share = &mut discovery.steps[0].terms[0][0];
    (loss_share.value, loss_share.standard_error) = (0.5 * range[1], None);
    let told = ["loss_share: no error is known, so these data may hardly determine it."];
    assert_eq!(of_step(&discovery), told);
    let again = discovery.steps[0].terms[0].clone();
    discovery.steps[0].terms.push(again);
    assert_eq!(of_step(&discovery), told, "two terms say it once");
    for term in &mut discovery.steps[0].terms {
        term[0].value = range[1];
    }
    assert_eq!(
        of_step(&discovery),
        ["loss_share is at the end of its range: the true value may lie beyond."]
    );

    let hardening = Definition::find("hardening").unwrap();
    let curve = hardening.curve.as_ref().unwrap();
    let step = &mut discovery.steps[0];
    (step.effect, step.terms) = (hardening.name, Vec::new());
    let knot = |at, value, standard_error| FittedKnot { at, value, standard_error };
    let [_, most] = curve.range;
    let knots = vec![knot(0.1, 0.0, None), knot(0.2, 0.5 * most, None), knot(0.3, most, Some(0.1))];
    step.curves = vec![FittedCurve { at: curve.at, of: curve.of, knots, formula: None }];
    assert_eq!(
        of_step(&discovery),
        [
            format!(
                "1 of the 3 values of {} is at the end of the range: the true curve may lie beyond.",
                curve.of
            ),
            format!(
                "1 of the 3 values of {}: no error is known, so these data may hardly determine them.",
                curve.of
            ),
        ]
    );
    discovery.steps[0].curves[0].knots = vec![knot(0.1, 0.01, Some(0.1)), knot(0.2, -0.02, Some(0.1))];
    assert_eq!(
        of_step(&discovery),
        [format!(
            "All values of {} have a standard error greater than they are: these data hardly determine them.",
            curve.of
        )]
    );
}

#[test]
fn the_element_at_which_alone_a_residual_is_largest_is_named() {
    let mut found = explained();
    (found.gap[0].covariate, found.gap[0].element) = ("element and depth", Some(17));
    assert_eq!(gap_in_words(&found.gap[0]), "element and depth (element 17)");
    assert!(html(&found).contains("<td>element and depth (element 17)</td>"));
    let gap = &json(&found)["gap"];
    assert_eq!((&gap[0]["element"], &gap[1]["element"]), (&Value::from(17), &Value::Null));
}

#[test]
fn the_effects_of_the_lab_are_told_with_their_version() {
    let (array, data, found) = (Array::digitacts(), data(), nothing_missing());
    let lab = [LabEffect { name: "grounding".into(), status: DraftStatus::Drafted, version: "5a5a".into() }];
    let html = discovery_html(&DiscoveryReport { lab: &lab, ..report(&array, &data, &found) });
    assert!(html.contains("effect of the lab") && html.contains("grounding") && html.contains("5a5a"));
}

#[test]
fn what_was_fitted_and_lost_against_a_rival_is_told_with_what_it_closes() {
    let page = html(&unexplained());
    for text in [
        "<td class=\"n\">82 %</td><td class=\"prose\">not taken: a dependence on place along x, which has no name, explains more</td>",
        "<p>None was taken: a dependence on place along x, which has no name, explains more.</p>",
    ] {
        assert!(page.contains(text), "{text}");
    }
    assert!(!page.contains("None was fitted"));
    assert_eq!(json(&unexplained())["rounds"][0]["rival"], "place along x");
}

#[test]
fn a_share_that_is_closed_beside_others_is_not_told_as_if_it_were_closed_alone() {
    let whole = unexplained();
    let first = &whole.rounds[0].candidates[0];
    let round = |with: &[&'static str], tried: &[(&'static str, f64)], taken| Round {
        with: with.to_vec(),
        candidates: tried
            .iter()
            .map(|(effect, shrink)| TriedEffect { effect, shrink: Some(*shrink), ..first.clone() })
            .collect(),
        taken,
        rival: None,
    };
    let pair = ["indenter-size", "edge-effect"];
    let given_up = |effect, because| GivenUp { effect, because };
    let found = Discovery {
        rounds: vec![
            round(&[], &[("indenter-size", 0.879)], Some("indenter-size")),
            round(&pair[..1], &[("edge-effect", 0.937), ("gain-drift", -3.46)], Some("edge-effect")),
            round(&pair, &[("surface-tilt", 0.959)], None),
            round(&[], &[("indenter-size", 0.879)], Some("indenter-size")),
            round(&pair[..1], &[("edge-effect", 0.937)], Some("edge-effect")),
            round(&pair, &[], None),
            round(&[], &[("hardening", -0.000_4), ("softening", 0.31)], None),
        ],
        given_up: vec![
            given_up("surface-tilt", Because::Little),
            given_up("indenter-size", Because::Rival("sum of signals")),
            given_up("edge-effect", Because::Rival("sum of signals")),
            given_up("hardening", Because::Far(-0.002)),
        ],
        ..whole.clone()
    };
    let text = in_words(&found);
    assert!(text.contains("indenter-size alone would close 88 % of it, but is not named"), "{text}");
    assert!(!text.contains("surface-tilt"), "{text}");
    let page = html(&found);
    show("anew.html", &page);
    for text in [
        "by itself or beside the others (with indenter-size and edge-effect it closes 96 % of the gap, 2 points more than they do).",
        "(with indenter-size it closes 94 % of the gap, 6 points more than indenter-size does).",
        "closes nothing of the gap on presses that its fit has not seen: an effect closes more of its own physics (alone it would close nothing of the gap).",
        "Round 4: the base model alone</h3>\n<p>The search begins anew.</p>",
        "Round 7: the base model alone</h3>\n<p>The search begins anew, without indenter-size and edge-effect, which a rival took over.</p>",
    ] {
        assert!(page.contains(text), "{text}");
    }
    assert_eq!(page.matches("begins anew").count(), 2);
}

/// The draft of [`draft`] is in the model, as after a confirmation.
fn with_added_draft() -> Discovery {
    let mut discovery = explained();
    let definition = draft().draft.define().unwrap();
    discovery.steps.truncate(1);
    let step = &mut discovery.steps[0];
    step.effect = definition.name;
    step.equivalent.clear();
    step.terms = vec![vec![Estimated { name: "strength", value: 1.01, standard_error: Some(0.02) }]];
    discovery.effects.push(Effect::neutral(definition));
    discovery
}

#[test]
fn an_added_draft_keeps_its_sentence_its_curve_and_its_facts() {
    let page = html(&with_added_draft());
    show("added-draft.html", &page);
    for text in [
        "<h3>draft-1</h3>\n<p>While the tool touches, the signal changes by a share &lt;that&gt; follows the sum of signals.</p>",
        "<td>found</td><td class=\"n\">1.010 \u{b1} 0.020</td>",
        "Curve of draft-1",
        "<td>law</td><td>power: scale \u{2212}0.0125, exponent 2.00</td>",
        "sum of signals, 0.00 to 4.00 mm",
    ] {
        assert!(page.contains(text), "{text}");
    }
}

#[test]
fn what_the_folds_of_presses_do_not_test_has_no_probability() {
    let mut discovery = explained();
    discovery.steps[0].folds_p_value = None;
    assert_eq!(json(&discovery)["steps"][0]["folds_p_value"], Value::Null);
    let page = html(&discovery);
    assert!(page.contains("On fitted presses it is not tested: beside a random walk"));
    assert_eq!(page.matches("this decides whether the effect is confirmed").count(), 1);
}

#[test]
fn the_headline_and_the_levels_tell_what_a_draft_gains() {
    let page = html(&Discovery { draft: Some(Ok(Box::new(draft()))), ..unexplained() });
    for text in [
        "<dt>with draft-1 / counts</dt><dd>2.11 <small>1.05 &#215; noise</small></dd>",
        "<dt>draft-1 closes, of what is left</dt><dd>93 % <small>&#177; 4 %</small></dd>",
        "<th class=\"n\">grown model without the draft</th>",
        "<th class=\"n\">with the draft</th>",
        "no effect of the library explains it, so the grown model without the draft does not contain it.",
        "<td>residual / noise</td><td class=\"n\">4.68</td><td class=\"n\">4.68</td><td class=\"n\">1.05</td>",
    ] {
        assert!(page.contains(text), "{text}");
    }
    let page = html(&unexplained());
    assert!(!page.contains("with the draft") && page.contains("so the grown model does not contain it."));
}

#[test]
fn what_is_left_names_three_covariates_and_counts_the_others() {
    let names = ["depth", "time", "speed", "press", "signal"];
    let whole = unexplained();
    let gap = |covariate: &&'static str| Gap { covariate, ..whole.gap[0].clone() };
    let found = Discovery {
        unexplained: Unexplained {
            depends_on: names.into_iter().chain(["noise that grows with the signal"]).collect(),
            gap: names.iter().map(gap).collect(),
            share: 1.0,
        },
        ..whole.clone()
    };
    let told = "depends on depth, time, speed, noise that grows with the signal and 2 more (in the table of the report)";
    assert!(in_words(&found).contains(&format!("What is left {told}.")), "{}", in_words(&found));
    assert!(html(&found).contains(&format!("What is left of the gap {told}, and no effect")));
}

#[test]
fn what_is_left_of_an_explained_gap_is_no_warning() {
    let left = Unexplained { depends_on: vec!["depth"], gap: vec![], share: 0.01 };
    let mut found = Discovery { unexplained: left, ..explained() };
    let told = |found: &Discovery| {
        let page = html(found);
        assert!(!page.contains("no effect of the library explains it"));
        page
    };
    assert!(told(&found).contains(
        "<p>What is left is seen, but certainly below half the noise; it does not count. It depends on depth.</p>"
    ));
    found.final_.level.structured.as_mut().unwrap().upper_noise = 0.7;
    assert!(told(&found).contains("certainly below the tolerance that was declared beforehand;"));
}

#[test]
fn both_ends_of_a_range_have_the_same_decimals() {
    let mut found = explained();
    found.gap[0].range = [0.999_999_999, 1.000_000_1];
    found.gap[1].range = [-1.8e-15, 0.001];
    let page = html(&found);
    for text in [
        "<td class=\"n\">1.00</td><td class=\"n\">1.00</td>",
        "<td class=\"n\">0.00000</td><td class=\"n\">0.00100</td>",
    ] {
        assert!(page.contains(text), "{text}");
    }
}

#[test]
fn a_gap_that_is_not_closed_is_closed_by_nothing() {
    let closed = |share| closed(Closed { share, standard_error: Some(0.001), most: 1.0 });
    assert_eq!([closed(-0.002), closed(0.0), closed(0.97)], ["nothing", "nothing", "97.0 % +- 0.1 %"]);
}
