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

/// A model with a draft of this file at half its strength.
fn in_a_model(draft: &str) -> String {
    let digitacts = include_str!("../../../config/models/digitacts.toml");
    let indented = draft[draft.find("name = \"draft-1\"").unwrap()..]
        .replace("[[effect.covariate]]", "[[effect.draft.covariate]]");
    format!(
        "{digitacts}\n[[effect]]\nname = \"draft-1\"\nparameters = {{ strength = 0.5 }}\n[effect.draft]\n{indented}"
    )
}

#[test]
fn a_model_file_holds_its_drafts_whole() {
    let text = in_a_model(STATED);
    let model = Model::from_toml(&text).unwrap();
    let effect = &model.effects[0].effect;
    assert_eq!((effect.name(), effect.value("strength")), ("draft-1", Some(0.5)));
    let back = Model::from_toml(&model.to_toml().unwrap()).unwrap();
    assert_eq!(back, model, "the effect is the same definition again");

    let versioned = |version: &str| {
        let named = format!("name = \"draft-1\"\nversion = \"{version}\"\nparameters");
        Model::from_toml(&text.replacen("name = \"draft-1\"\nparameters", &named, 1))
    };
    let hash = "5a".repeat(32);
    let model = versioned(&hash).unwrap();
    assert_eq!(model.effects[0].version.as_ref(), Some(&hash));
    assert_eq!(Model::from_toml(&model.to_toml().unwrap()).unwrap(), model);
    let told = versioned("new").unwrap_err().to_string();
    assert!(told.contains("effect[0].version: must be the SHA-256 of a draft"), "{told}");

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
        ("[0.0001, 0.0]", "[nan, 0.0]", "line 3: covariance[0]: must be finite, not NaN"),
        ("ln_odds_behind = 31.4", "ln_odds_behind = inf", "nearest[0].ln_odds_behind: must be finite"),
        ("ln_odds = 103.25", "ln_odds = nan", "evidence.ln_odds: must be finite"),
        ("folds = 5", "folds = 6", "evidence.folds: must be at most 5, not 6"),
        ("closed_share = 0.93", "closed_share = nan", "evidence.closed_share: must be finite and at most 1"),
        ("closed_share = 0.93", "closed_share = 1.2", "evidence.closed_share: must be finite and at most 1"),
        (
            "closed_share_se = 0.04",
            "closed_share_se = -0.04",
            "evidence.closed_share_se: must be finite and not",
        ),
        (
            "strength_se = 0.02",
            "strength_se = inf",
            "confirmation.strength_se: must be finite and not negative",
        ),
        (
            "strength = 0.3",
            "closed_share = -inf\nstrength = 0.3",
            "confirmation.closed_share: must be finite",
        ),
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

#[test]
fn a_curve_that_gives_no_finite_number_is_refused_in_draft_and_model_files() {
    let law = |name: &str, numbers: &str| {
        let given = format!("law = \"{name}\"\nnumbers = {numbers}");
        STATED.replacen("law = \"linear\"\nnumbers = { offset = 3.0, slope = 0.0 }", &given, 1)
    };
    let table = "law = \"table\"\nat = [[0.0, 0.6]]\nvalues = [-1e308, 1e308]";
    for (text, want) in [
        (law("power", "{ scale = 1.0, exponent = -3.0 }"), "effect.numbers: must not give an effect beyond"),
        (
            law("power", "{ scale = 1.0, exponent = -1e300 }"),
            "effect.numbers: must not give an effect beyond",
        ),
        (law("exponential", "{ scale = 1e13, length = 1.0 }"), "it gives 1e13"),
        (
            law("logarithm", "{ scale = 1.0, length = 1e-320 }"),
            "effect.numbers: must not give an effect beyond",
        ),
        (
            law("periodic", "{ offset = 0.0, sine = 1.0, cosine = 1.0, per_unit = 1e308 }"),
            "effect.numbers.per_unit: must not give",
        ),
        (
            law("linear", "{ offset = 3.0, slope = 0.0 }\nweights = [1.0, 1e12]"),
            "effect.weights: must not give",
        ),
        (
            STATED.replacen("law = \"linear\"\nnumbers = { offset = 3.0, slope = 0.0 }", table, 1),
            "effect.values: must not give",
        ),
    ] {
        let told = DraftFile::from_toml(&text).unwrap_err().to_string();
        assert!(told.contains(want), "{want}: {told}");
    }
    let power = law("power", "{ scale = 1.0, exponent = -3.0 }");
    assert!(DraftFile::from_toml(&power.replace("[0.0, 0.6]", "[0.1, 0.6]")).is_ok(), "it never gets to 0");
    let told = Model::from_toml(&in_a_model(&power)).unwrap_err().to_string();
    assert!(told.contains("effect[0].draft.numbers: must not give an effect beyond"), "{told}");
}

#[test]
fn control_characters_are_refused_since_texts_are_shown_on_terminals() {
    let text = STATED.replacen("rise.", "rise.\\u001b[2J", 1);
    let told = DraftFile::from_toml(&text).unwrap_err().to_string();
    assert!(told.starts_with("line 7: effect.sentence: must have no control characters"), "{told}");
    for (from, want) in [
        ("saturation", "nearest[0].class: must have no control"),
        ("run-1", "evidence.data: must have no control"),
        ("run-2", "confirmation.data: must have no control"),
    ] {
        let with = format!("\"{from}\\u0007\"");
        let text = confirmed().replacen(&format!("\"{from}\""), &with, 1);
        let text = text.replacen(&format!("{from} ="), &format!("{with} ="), 1);
        let told = DraftFile::from_toml(&text).unwrap_err().to_string();
        assert!(told.contains(want), "{want}: {told}");
    }
}

#[test]
fn a_withdrawn_draft_must_have_what_taking_it_back_needs() {
    let mut file = DraftFile::from_toml(&confirmed()).unwrap();
    file.retire();
    let text = file.to_toml().unwrap();
    let cut = &text[..text.find("[confirmation]").unwrap()];
    let told = DraftFile::from_toml(cut).unwrap_err().to_string();
    assert!(told.contains("confirmation: is missing: a draft is confirmed by a new measurement"), "{told}");
    let cut = cut.replacen("was = \"confirmed\"", "was = \"drafted\"", 1);
    assert!(DraftFile::from_toml(&cut).is_ok(), "it was never measured anew");
    let told =
        DraftFile::from_toml(&text.replacen("\"confirmed\"", "\"retired\"", 1)).unwrap_err().to_string();
    assert!(told.contains("was: must be what the draft was before"), "{told}");
    let stated = STATED.replacen("\"drafted\"", "\"retired\"\nwas = \"partial\"", 1);
    let told = DraftFile::from_toml(&stated).unwrap_err().to_string();
    assert!(told.contains("evidence: is missing"), "{told}");
}

/// Reports, libraries and models name a version by this text, so it stays as it is.
#[test]
fn a_version_is_of_all_that_the_effect_is_and_of_nothing_else() {
    let mut read = DraftFile::from_toml(STATED).unwrap();
    let text = DraftFile::versioned(&read.draft).unwrap();
    assert_eq!(
        text,
        "name = \"\"\nsentence = \"While the tool touches, the counts of each element rise.\"\nstage = \"readout\"\n\
         carrier = \"counts\"\ncombine = \"add\"\nwhen = \"in contact\"\nlaw = \"linear\"\n\n[numbers]\noffset = 3.0\nslope = 0.0\n\n\
         [[covariate]]\nname = \"depth\"\nunit = \"mm\"\nrange = [0.0, 0.6]\n"
    );
    read.draft.name = "grounding".into();
    assert_eq!(DraftFile::versioned(&read.draft).unwrap(), text);
    read.draft.law = Law::Linear { offset: 3.0, slope: 1e-9 };
    assert_ne!(DraftFile::versioned(&read.draft).unwrap(), text);
}
