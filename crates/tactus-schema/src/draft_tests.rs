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
        covariance: vec![vec![1e-4, 0.0], vec![0.0, 1e-4]],
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
