//! Pages and numbers of made-up discoveries: what they say, and what they must not.
//!
//! With `TACTUS_REPORT_DIR` set, the pages are also written there, to be looked at.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

#[path = "made_up/discovery.rs"]
mod made_up;

use made_up::{data, empty, explained, nothing_missing, report, unexplained};
use serde_json::Value;
use tactus_discover::{Discovery, Unexplained, Verdict};
use tactus_model::Array;
use tactus_report::discovery::{discovery_json, in_words, not_shown};

fn json(discovery: &Discovery) -> Value {
    serde_json::from_str(&discovery_json(&report(&Array::digitacts(), &data(), discovery))).unwrap()
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
        ("/base/heldout_rms_counts", "9.35"),
        ("/base/heldout_chi2", "21.855625"),
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
        ("/not_shown/2/effect", "\"imprint\""),
        ("/rounds/2/taken", "null"),
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
        "The model was missing hysteresis and miswired. On held-out presses the residual falls from 9.35 to 2.08 counts rms, which \
         closes 99.6 % of the gap between model and noise; the noise is 2.00 counts."
    );
    assert_eq!(
        in_words(&nothing_missing()),
        "Nothing that these data can show is missing from the model: on held-out presses its residual is 2.01 counts rms, the noise is \
         2.00 counts, and noise alone shows as much structure with a chance of 0.431."
    );
    assert_eq!(
        in_words(&unexplained()),
        "The model is missing something that no known effect matches: on held-out presses its residual is 9.35 counts rms, and how large \
         the noise is, these data do not tell. What is left, 100.0 % of the gap, depends on time since contact and depth."
    );
    let partly = Discovery {
        verdict: Verdict::PartlyExplained,
        unexplained: Unexplained { depends_on: vec!["temperature"], share: 0.3 },
        ..explained()
    };
    assert!(in_words(&partly).ends_with("What is left, 30 % of the gap, depends on temperature."));
}

#[test]
fn effects_that_cannot_be_shown_stand_by_their_reason() {
    let found = explained();
    let reasons = not_shown(&found);
    assert_eq!(reasons.len(), 2);
    assert_eq!(reasons[1].1, ["softening", "imprint"]);
}
