use std::fs;
use std::num::NonZeroUsize;
use std::time::Duration;

use tactus_model::effect::REGISTRY;
use tactus_sets::{Amount, ClassFits, Content, Recipe};
use tactus_work::Claims;

use super::super::campaign::Campaign;
use super::*;

/// The label of a set with one physics at a strength, separated twice, and how many labels the two rounds made.
fn separated(physics: &str, strength: f64) -> Result<(Label, [usize; 2])> {
    let folder =
        std::env::temp_dir().join(format!("tactus-separate-{physics}-{strength}-{}", std::process::id()));
    let places = Places { work: folder.join("work"), labels: folder.join("labels") };
    let content = Content { physics: vec![physics.into()], ..Content::default() };
    let amount = Amount::Strength(strength);
    let recipe = Recipe { frames: Some(400), content, amount, ..Recipe::new(3) };
    let set = Planned { id: "names/one".into(), campaign: Campaign::Names, recipe };
    let path = places.label(&set.id);
    fs::create_dir_all(path.parent().context("a folder")?)?;
    fs::write(&path, serde_json::to_string(&set.recipe.make()?.label)?)?;
    let worker = Worker {
        claims: Claims::new(folder.join("claims"), Duration::from_mins(1)),
        threads: NonZeroUsize::MIN,
        stop: Stop::default(),
    };
    let round = || separate(std::slice::from_ref(&set), &places, &worker, &|_, _| ());
    let done = [round()?.done, round()?.done];
    let label: Label = parsed(&path)?;
    fs::remove_dir_all(&folder)?;
    Ok((label, done))
}

fn fits(label: &Label) -> Result<ClassFits> {
    label.physics[0].class_fits().context("it has them")
}

#[test]
fn a_label_gets_its_separation_once() -> Result<()> {
    let (label, done) = separated("late-frames-clock", 1.0)?;
    assert_eq!(done, [1, 0]);
    let fits = fits(&label)?;
    let nearest = fits.z_name("time-lag").context("it is an effect")?;
    assert!(nearest > 0.0 && nearest <= 1.001 * fits.base, "{nearest} of {}", fits.base);
    Ok(())
}

#[test]
fn the_fits_end_where_a_wrong_effect_is_near() -> Result<()> {
    let (label, _) = separated("toe", 1e-3)?;
    let fits = fits(&label)?;
    assert!(fits.base < Z_NAMEABLE, "{}", fits.base);
    assert_eq!(fits.effects.keys().collect::<Vec<_>>(), ["surface-offset"]);
    Ok(())
}

#[test]
fn a_far_physics_has_fits_of_all_effects() -> Result<()> {
    let (label, _) = separated("sheared-stage", 1.0)?;
    assert_eq!(fits(&label)?.effects.len(), REGISTRY.len());
    Ok(())
}

#[test]
fn a_point_of_the_librarys_own_parameters_gets_no_fits() -> Result<()> {
    let (label, done) = separated("late-touch", 1.0)?;
    assert_eq!(done, [0, 0]);
    assert_eq!(label.physics[0].class_fits(), None);
    Ok(())
}
