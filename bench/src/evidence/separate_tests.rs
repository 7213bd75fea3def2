use std::fs;
use std::num::NonZeroUsize;
use std::time::Duration;

use tactus_sets::{Content, Recipe};
use tactus_work::Claims;

use super::super::campaign::Campaign;
use super::*;

#[test]
fn a_label_gets_its_separation_once() -> Result<()> {
    let folder = std::env::temp_dir().join(format!("tactus-separate-{}", std::process::id()));
    let places = Places { work: folder.join("work"), labels: folder.join("labels") };
    let content = Content { physics: vec!["late-touch".into()], ..Content::default() };
    let recipe = Recipe { frames: Some(400), content, ..Recipe::new(3) };
    let set = Planned { id: "names/one".into(), campaign: Campaign::Names, recipe };
    let path = places.label(&set.id);
    fs::create_dir_all(path.parent().context("a folder")?)?;
    fs::write(&path, serde_json::to_string(&set.recipe.make()?.label)?)?;
    let worker = Worker {
        claims: Claims::new(folder.join("claims"), Duration::from_mins(1)),
        threads: NonZeroUsize::MIN,
        stop: Stop::default(),
    };
    let separated = || separate(std::slice::from_ref(&set), &places, &worker, &|_, _| ());
    let done = [separated()?.done, separated()?.done];
    let label: Label = parsed(&path)?;
    fs::remove_dir_all(&folder)?;
    let fits = label.physics[0].class_fits().context("it has them")?;
    assert_eq!(done, [1, 0]);
    assert_eq!(fits.effects.len(), tactus_model::effect::REGISTRY.len());
    let nearest = fits.z_name(Some("surface-offset")).context("it is an effect")?;
    assert!(nearest > 0.0 && nearest <= 1.001 * fits.base, "{nearest} of {}", fits.base);
    Ok(())
}
