use std::num::NonZeroUsize;
use std::time::Duration;

use tactus_model::Covariate;
use tactus_model::effect::{Carrier, Draft, Law, When};
use tactus_schema::draft::DraftStatus;
use tactus_sets::{Amount, Content, Recipe};
use tactus_work::Claims;

use super::super::campaign::Campaign;
use super::*;

/// A set that hides a step of counts, and a draft of a share of it.
fn with_draft(places: &Places, physics: &str, share: f64) -> Result<Planned> {
    let content = Content { physics: vec![physics.into()], ..Content::default() };
    let recipe = Recipe { frames: Some(600), content, amount: Amount::Strength(1.0), ..Recipe::new(21) };
    let set = Planned { id: format!("outside/{physics}"), campaign: Campaign::Outside, recipe };
    let label = set.recipe.make()?.label;
    let of = |name: &str| label.physics[0].parameters.get(name).copied().unwrap_or(1.0);
    let draft = Draft {
        name: "draft-1".into(),
        sentence: "Counts jump.".into(),
        carrier: Carrier::Counts,
        when: When::Always,
        covariates: vec![Covariate::Counts],
        ranges: vec![[0.0, 4096.0]],
        law: Law::Threshold { scale: share * of("step_counts"), at: of("limit_counts") },
        weights: None,
    };
    let file = DraftFile {
        draft,
        status: DraftStatus::Drafted,
        was: None,
        covariance: Vec::new(),
        nearest: Vec::new(),
        evidence: None,
        confirmation: None,
    };
    write_whole(&places.label(&set.id), &serde_json::to_vec(&label)?)?;
    write_whole(&places.draft(&set.id), file.to_toml()?.as_bytes())?;
    Ok(set)
}

#[test]
fn the_error_of_a_draft_is_computed_once_and_again_for_another_draft() -> Result<()> {
    let folder = tempfile::tempdir()?;
    let places = Places { work: folder.path().join("work"), labels: folder.path().join("labels") };
    let worker = Worker {
        claims: Claims::new(folder.path().join("claims"), Duration::from_mins(1)),
        threads: NonZeroUsize::MIN,
        stop: Stop::default(),
    };
    let computed = |share: f64| -> Result<(usize, f64)> {
        let set = with_draft(&places, "range-switch", share)?;
        let done = curves(std::slice::from_ref(&set), &places, &worker, &|_, _| ())?.done;
        let curve = Curve::read(&set.id, &places)?.context("it is computed")?;
        Ok((done, curve.error.context("the physics shows")?))
    };
    let [(done, half), (again, same), (anew, right)] = [computed(0.5)?, computed(0.5)?, computed(1.0)?];
    assert_eq!([done, again, anew], [1, 0, 1]);
    assert!((half - 0.5).abs() < 0.02 && half.to_bits() == same.to_bits() && right < 1e-6, "{half} {right}");
    Ok(())
}

#[test]
fn what_has_no_mean_or_no_draft_has_no_curve() -> Result<()> {
    let folder = tempfile::tempdir()?;
    let places = Places { work: folder.path().join("work"), labels: folder.path().join("labels") };
    let set = with_draft(&places, "bit-flips", 1.0)?;
    assert_eq!(drafted(&set, &places)?, None);
    let set = with_draft(&places, "range-switch", 1.0)?;
    assert_eq!(drafted(&set, &places)?.map(|hidden| hidden.id), Some("range-switch".into()));
    fs::remove_file(places.draft(&set.id))?;
    assert_eq!(drafted(&set, &places)?, None);
    Ok(())
}
