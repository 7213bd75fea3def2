use tactus_model::Covariate;
use tactus_model::effect::{Carrier, Draft, Law, When};
use tactus_schema::draft::DraftConfirmation;

use super::*;

/// A draft that new data have told of, or not.
fn file(status: DraftStatus) -> DraftFile {
    let draft = Draft {
        name: "draft-1".into(),
        sentence: "Counts jump.".into(),
        carrier: Carrier::Counts,
        when: When::Always,
        covariates: vec![Covariate::Counts],
        ranges: vec![[0.0, 4096.0]],
        law: Law::Threshold { scale: 3.0, at: 200.0 },
        weights: None,
    };
    let confirmation = DraftConfirmation {
        data: [("set".to_owned(), "hash".to_owned())].into(),
        strength: 0.98,
        strength_se: Some(0.02),
        closed_share: Some(0.93),
        closed_share_se: None,
    };
    DraftFile {
        draft,
        status,
        was: None,
        covariance: Vec::new(),
        nearest: Vec::new(),
        evidence: None,
        confirmation: (!status.is_open()).then_some(confirmation),
    }
}

#[test]
fn what_the_program_tells_is_in_the_drafts_file() {
    let told = |exit: i32, status: DraftStatus, said: &str| measured(Some(exit), &file(status), said);
    let confirmed = told(0, DraftStatus::Confirmed, "").ok();
    let of = |told| Measured {
        told,
        strength: Some(0.98),
        strength_se: Some(0.02),
        closed_share: Some(0.93),
        closed_share_se: None,
    };
    assert_eq!(confirmed, Some(of(Told::Confirmed)));
    assert_eq!(told(0, DraftStatus::Refuted, "").ok(), Some(of(Told::Refuted)));
    let short = told(2, DraftStatus::Drafted, "the recordings are too short to tell whether draft-1 holds");
    assert_eq!(short.ok().map(|one| one.told), Some(Told::TooLittle));
}

#[test]
fn a_program_that_fails_has_told_nothing() {
    for (exit, status) in [(2, DraftStatus::Drafted), (1, DraftStatus::Confirmed), (0, DraftStatus::Partial)]
    {
        assert!(measured(Some(exit), &file(status), "no such file").is_err(), "{exit} {status:?}");
    }
    assert!(measured(None, &file(DraftStatus::Refuted), "").is_err());
}

#[test]
fn each_physics_has_another_one_in_its_place() {
    let mut seen = vec!["supply-droop"];
    while let Some(next) = next_after(seen[seen.len() - 1]).filter(|next| *next != "supply-droop") {
        assert!(!seen.contains(&next), "{next}");
        seen.push(next);
    }
    assert_eq!((seen.len(), next_after("range-switch")), (20, Some("supply-droop")));
    assert_eq!((next_after("bit-flips"), next_after("backlash")), (None, None));
}

#[test]
fn the_table_counts_all_sets_and_those_with_right_drafts() {
    let untold = Measured::TOO_LITTLE;
    let of =
        |told, strength, closed_share| Measured { told, strength: Some(strength), closed_share, ..untold };
    let case = |physics: &str, draft: Option<(bool, Measured, Measured)>| Case {
        physics: physics.into(),
        is_right: draft.map(|(is_right, ..)| is_right),
        confirmed: draft.map(|(_, with, other)| Confirmed {
            draft: String::new(),
            program: String::new(),
            with,
            without: of(Told::Refuted, 0.0, None),
            other,
        }),
    };
    let refuted = of(Told::Refuted, 0.1, Some(0.2));
    let text = confirm_table(&[
        case("grit", Some((true, of(Told::Confirmed, 1.0, Some(0.96)), refuted))),
        case("grit", Some((true, refuted, untold))),
        case("bulge", Some((false, untold, of(Told::Confirmed, 0.9, Some(0.9))))),
        case("bulge", None),
    ]);
    for row in [
        "| all | 4 | 3 | 2 | 1 / 1 / 1 | 0.55 | 58 % | 0 / 3 / 0 | 1 / 1 / 1 |",
        "| all, with a right draft | 2 | 2 | 2 | 1 / 1 / 0 | 0.55 | 58 % | 0 / 2 / 0 | 0 / 1 / 1 |",
        "| all, with another draft | 1 | 1 | 0 | 0 / 0 / 1 | - | - | 0 / 1 / 0 | 1 / 0 / 0 |",
        "| bulge | 2 | 1 | 0 | 0 / 0 / 1 | - | - | 0 / 1 / 0 | 1 / 0 / 0 |",
    ] {
        assert!(text.lines().any(|line| line == row), "{row}\n{text}");
    }
    let rows: Vec<&str> = text.lines().filter(|line| line.starts_with("| ")).skip(1).collect();
    assert_eq!(rows.len(), 5);
    assert!(rows[0].starts_with("| all |") && rows[4].starts_with("| grit |"), "{text}");
}
