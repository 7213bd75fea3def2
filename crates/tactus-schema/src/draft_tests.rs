use tactus_model::Covariate;
use tactus_model::effect::{Carrier, Draft, Law, When};

use super::{DraftConfirmation, DraftEvidence, DraftFile, DraftStatus, Nearest};
use crate::model::Model;

const STATED: &str = r#"
schema = "tactus.draft/1"
status = "drafted"

[effect]
name = "draft-1"
sentence = "While the tool touches, the counts of each element rise."
stage = "readout"
carrier = "counts"
combine = "add"
when = "in contact"
law = "linear"
numbers = { offset = 3.0, slope = 0.0 }

[[effect.covariate]]
name = "depth"
unit = "mm"
range = [0.0, 0.6]
"#;

fn file() -> DraftFile {
    DraftFile {
        draft: Draft {
            name: "draft-7".into(),
            sentence: "the signal falls with the sum of all signals".into(),
            carrier: Carrier::OwnSignal,
            when: When::InContact,
            covariates: vec![Covariate::SumOfSignals, Covariate::Depth],
            ranges: vec![[0.0, 4.0], [0.0, 0.7]],
            law: Law::Table {
                at: vec![vec![0.0, 1.0 / 3.0], vec![0.1, 0.2]],
                values: vec![0.1 + 0.2, -0.1, 1e-17, 0.7],
            },
            weights: Some(vec![1.0 / 7.0; 48]),
        },
        status: DraftStatus::Partial,
        was: None,
        covariance: vec![vec![1e-4, 0.0, 0.0, 0.0]; 4],
        nearest: vec![Nearest { class: "saturation".into(), ln_odds_behind: 31.4 }],
        evidence: Some(DraftEvidence {
            data: [("run-1".to_owned(), "00ff".to_owned())].into(),
            seed: 7,
            p_value: 0.0005,
            ln_odds: 103.25,
            folds: 5,
            closed_share: Some(0.93),
            closed_share_se: Some(0.04),
        }),
        confirmation: Some(DraftConfirmation {
            data: [("run-2".to_owned(), "11ee".to_owned())].into(),
            strength: 1.0 / 3.0,
            strength_se: Some(0.02),
            closed_share: None,
            closed_share_se: None,
        }),
    }
}

#[test]
fn a_stated_draft_is_read() {
    let read = DraftFile::from_toml(STATED).unwrap();
    assert_eq!(
        (read.status, read.draft.carrier, read.draft.when),
        (DraftStatus::Drafted, Carrier::Counts, When::InContact)
    );
    assert_eq!(read.draft.law, Law::Linear { offset: 3.0, slope: 0.0 });
    assert!(read.evidence.is_none() && read.nearest.is_empty());
    assert_eq!(read.define().unwrap().name, "draft-1");
}

#[test]
fn there_and_back_is_the_same_to_the_bit() {
    let text = file().to_toml().unwrap();
    let back = DraftFile::from_toml(&text).unwrap();
    assert_eq!(back, file());
    assert_eq!(back.to_toml().unwrap(), text);
}

#[test]
fn a_model_file_holds_its_drafts_whole() {
    let digitacts = include_str!("../../../config/models/digitacts.toml");
    let indented = STATED[STATED.find("name = \"draft-1\"").unwrap()..]
        .replace("[[effect.covariate]]", "[[effect.draft.covariate]]");
    let text = format!(
        "{digitacts}\n[[effect]]\nname = \"draft-1\"\nparameters = {{ strength = 0.5 }}\n[effect.draft]\n{indented}"
    );
    let model = Model::from_toml(&text).unwrap();
    let effect = &model.effects[0].effect;
    assert_eq!((effect.name(), effect.value("strength")), ("draft-1", Some(0.5)));
    let back = Model::from_toml(&model.to_toml().unwrap()).unwrap();
    assert_eq!(back, model, "the effect is the same definition again");

    let another = text.replacen("name = \"draft-1\"", "name = \"draft-2\"", 1);
    let told = Model::from_toml(&another).unwrap_err().to_string();
    assert!(told.contains("effect[0].draft.name: must be \"draft-2\" here"), "{told}");
}

#[test]
fn a_damaged_or_foreign_file_is_refused_with_its_place() {
    for (from, to, want) in [
        ("tactus.draft/1", "tactus.model/1", "schema: this program reads \"tactus.draft/1\""),
        ("\"drafted\"", "\"hopeful\"", "line 3"),
        ("\"counts\"", "\"voltage\"", "effect.carrier: must be one of depth, x, y"),
        ("\"in contact\"", "\"now\"", "effect.when: must be one of always"),
        ("\"depth\"", "\"luck\"", "effect.covariate[0].name: must be one of time"),
        ("\"mm\"", "\"s\"", "effect.covariate[0].unit: must be \"mm\" here"),
        ("\"readout\"", "\"covering\"", "effect.stage: must be \"readout\" here"),
        ("\"add\"", "\"multiply\"", "effect.combine: must be \"add\" here"),
        ("slope = 0.0", "rise = 0.0", "effect.law: \"linear\" is no law"),
        ("numbers", "values", "line 13"),
        ("[0.0, 0.6]", "[0.6, 0.0]", "least value first"),
        ("draft-1", "hardening", "of the library"),
    ] {
        let text = STATED.replacen(from, to, 1);
        assert_ne!(text, STATED, "{from}");
        let told = DraftFile::from_toml(&text).unwrap_err().to_string();
        assert!(told.contains(want), "{want}: {told}");
    }
}

#[test]
fn a_refused_file_names_the_line_of_the_wrong_key() {
    for (from, to, line) in [
        ("tactus.draft/1", "tactus.model/1", 2),
        ("draft-1", "Draft 1", 6),
        ("\"readout\"", "\"covering\"", 8),
        ("\"counts\"", "\"voltage\"", 9),
        ("\"linear\"", "\"cubic\"", 12),
        ("offset = 3.0", "offset = nan", 13),
        ("\"depth\"", "\"luck\"", 16),
        ("\"mm\"", "\"s\"", 17),
        ("[0.0, 0.6]", "[0.6, 0.0]", 18),
        ("[0.0, 0.6]", "[0.0, inf]", 18),
    ] {
        let text = STATED.replacen(from, to, 1);
        let told = DraftFile::from_toml(&text).unwrap_err().to_string();
        assert!(told.starts_with(&format!("line {line}: ")), "{to}: {told}");
    }
}

/// A draft of a straight line, with all that discovery and a new measurement write.
fn confirmed() -> String {
    let mut file = file();
    file.status = DraftStatus::Confirmed;
    file.draft.law = Law::Linear { offset: 3.0, slope: 0.5 };
    file.draft.covariates.truncate(1);
    file.draft.ranges.truncate(1);
    file.draft.weights = Some(vec![0.5, 1.0]);
    file.covariance = vec![vec![1e-4, 0.0], vec![0.0, 1e-4]];
    file.to_toml().unwrap()
}

#[test]
fn a_file_that_has_lost_what_speaks_for_it_is_refused() {
    let text = confirmed();
    assert!(DraftFile::from_toml(&text).is_ok());
    let lines: Vec<&str> = text.lines().collect();
    for kept in 0..lines.len() {
        let cut = lines[..kept].join("\n");
        assert!(DraftFile::from_toml(&cut).is_err(), "cut after line {kept}:\n{cut}");
    }
    let within = |section: &str| text.find(section).unwrap();
    for (cut, want) in [
        (&text[..within("[evidence]")], "evidence: is missing"),
        (
            &text[..within("[confirmation]")],
            "confirmation: is missing: a draft is confirmed by a new measurement",
        ),
        (&text[..within("run-2")], "confirmation.data: must name the new data"),
    ] {
        let told = DraftFile::from_toml(cut).unwrap_err().to_string();
        assert!(told.contains(want), "{want}: {told}");
    }
    let drafted = text[..within("[confirmation]")].replacen("\"confirmed\"", "\"drafted\"", 1);
    assert!(DraftFile::from_toml(&drafted).is_ok(), "a draft is not measured anew yet");
}

#[test]
fn damaged_numbers_are_refused_with_their_place() {
    let covariance = "covariance = [[0.0001, 0.0], [0.0, 0.0001]]";
    for (from, to, want) in [
        (covariance, "covariance = [[1, 2], [3]]", "line 3: covariance[1]: must have 2 numbers, not 1"),
        (
            covariance,
            "covariance = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]",
            "line 3: covariance: must have 1 or 2 rows",
        ),
        ("weights = [0.5, 1.0]", "weights = []", "effect.weights: must have a number for each element"),
        ("weights = [0.5, 1.0]", "weights = [0.5, nan]", "effect.weights: draft"),
        ("p_value = 0.0005", "p_value = 5.0", "evidence.p_value: must be between 0 and 1"),
        ("strength = 0.3333333333333333", "strength = nan", "confirmation.strength: must be finite"),
        ("seed = 7", "seed = 7\nsead = 7", "unknown field `sead`"),
    ] {
        let text = confirmed().replacen(from, to, 1);
        assert_ne!(text, confirmed(), "{from}: {text}");
        let told = DraftFile::from_toml(&text).unwrap_err().to_string();
        assert!(told.contains(want), "{want}: {told}");
    }
}

#[test]
fn a_withdrawn_draft_comes_back_as_what_it_was() {
    let mut file = DraftFile::from_toml(&confirmed()).unwrap();
    file.retire();
    file.retire();
    assert_eq!((file.status, file.was), (DraftStatus::Retired, Some(DraftStatus::Confirmed)));
    let mut back = DraftFile::from_toml(&file.to_toml().unwrap()).unwrap();
    back.take_back();
    assert_eq!(back.to_toml().unwrap(), confirmed());
    let older = confirmed().replacen("\"confirmed\"", "\"retired\"", 1);
    let mut older = DraftFile::from_toml(&older).unwrap();
    older.take_back();
    assert_eq!(older.status, DraftStatus::Drafted, "the file does not say what it was");
}
