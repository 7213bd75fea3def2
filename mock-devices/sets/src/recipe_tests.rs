use std::fs;

use tactus_model::Contact;
use tactus_record::table;
use tactus_schema::table::RowView;
use tempfile::TempDir;

use super::*;

fn short(content: Content) -> Recipe {
    Recipe { frames: Some(900), content, ..Recipe::new(21) }
}

#[test]
fn a_set_without_physics_is_the_base_model_and_noise() {
    let recipe = Recipe { noise: NoiseKind::Coloured, ..short(Content { none: true, ..Content::default() }) };
    let set = recipe.make().unwrap();
    let base = RandomRig::new(recipe.seed_of(RandomStream::Base)).unwrap();
    let mut image = vec![0.0; 48];
    let (mut squares, mut largest) = (0.0, 0.0_f64);
    for row in &set.rows {
        let [x, y, z] = row.position_mm;
        let contact = Contact {
            indenter: base.sensor.indenter.clone(),
            position_mm: set.rig.registration.to_sensor([x, y]),
            rotation_deg: 0.0,
            depth_mm: -z,
        };
        base.sensor.model.image(&contact, set.rig.covering, &mut image);
        for (count, clean) in row.counts.iter().zip(&image) {
            squares += (f64::from(*count) - clean).powi(2);
            largest = largest.max((f64::from(*count) - clean).abs());
        }
    }
    let rms = (squares / (900.0 * 48.0)).sqrt();
    let expected = (set.label.noise.rms_counts.powi(2) + 1.0 / 12.0).sqrt();
    assert!((rms / expected - 1.0).abs() < 0.05, "{rms} for {expected}");
    assert!(largest < 7.0 * expected, "{largest}");
    assert!(set.label.physics.is_empty() && set.label.z.abs() < 1e-9);
}

#[test]
fn a_recipe_makes_the_same_set_again_and_another_seed_another_one() {
    let recipe = short(Content { combine: Some(2), ..Content::default() });
    let [once, again] = [recipe.make().unwrap(), recipe.make().unwrap()];
    assert_eq!(once.rows, again.rows);
    assert_eq!(once.label, again.label);
    let other = Recipe { seed: 22, ..recipe }.make().unwrap();
    assert_ne!(once.rows, other.rows);
}

#[test]
fn combined_effects_are_all_different() {
    for seed in 0..20 {
        let content = Content { combine: Some(3), ..Content::default() };
        let recipe = Recipe { seed, frames: Some(30), ..short(content) };
        let set = recipe.make().unwrap();
        let mut effects = set.label.effects();
        effects.sort_unstable();
        effects.dedup();
        assert_eq!(effects.len(), 3);
    }
}

#[test]
fn a_separation_asked_for_is_met() {
    for id in
        ["relaxation-prony", "saturation-knee", "cocked-tool", "supply-droop", "low-pass-moving-average"]
    {
        let content = Content { physics: vec![id.into()], ..Content::default() };
        let set = Recipe { amount: Amount::Separation(20.0), ..short(content) }.make().unwrap();
        assert!(set.label.physics[0].reached, "{id}");
        assert!((set.label.z - 20.0).abs() < 0.5, "{id}: {}", set.label.z);
    }
}

#[test]
fn a_separation_out_of_reach_is_said_to_be() {
    let content = Content { physics: vec!["dead-element".into()], ..Content::default() };
    let set = Recipe { amount: Amount::Separation(1e7), ..short(content) }.make().unwrap();
    assert!(!set.label.physics[0].reached);
    assert!(set.label.physics[0].strength > 0.0);
}

#[test]
fn a_tool_of_another_size_is_another_spread_and_a_slow_readout_is_not() {
    let left = |id: &str| {
        let content = Content { physics: vec![id.into()], ..Content::default() };
        let label = Recipe { amount: Amount::Strength(0.3), ..short(content) }.make().unwrap().label;
        label.z_beyond_spread / label.z
    };
    assert!(left("worn-tool") < 0.05, "{}", left("worn-tool"));
    assert!(left("low-pass-second-order") > 0.99);
}

#[test]
fn what_is_not_there_is_refused() {
    let of_effect = |effect: &str| Content { effects: vec![effect.into()], ..Content::default() };
    assert!(matches!(short(of_effect("magic")).make(), Err(RecipeError::UnknownEffect(_))));
    let of_physics = Content { physics: vec!["magic".into()], ..Content::default() };
    assert!(matches!(short(of_physics).make(), Err(RecipeError::UnknownPhysics(_))));
    let negative = Recipe { amount: Amount::Strength(-1.0), ..short(Content::default()) };
    assert!(matches!(negative.make(), Err(RecipeError::Range { field: "strength", .. })));
}

#[test]
fn the_table_is_whole_and_says_nothing_of_the_label() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("set.parquet");
    for plan in [Plan::Bundle, Plan::Paper] {
        for physics in CATALOGUE.iter().step_by(13) {
            let content = Content { physics: vec![physics.id.into()], ..Content::default() };
            let set = Recipe { plan, frames: Some(600), ..short(content) }.make().unwrap();
            set.write(&path).unwrap();
            let bytes = fs::read(&path).unwrap();
            let says = |word: &str| bytes.windows(word.len()).any(|window| window == word.as_bytes());
            assert!(says("set-0000"));
            for dosed in &set.label.physics {
                assert!(!says(&dosed.id), "{}", dosed.id);
                assert!(dosed.effect.as_ref().is_none_or(|effect| !says(effect)), "{:?}", dosed.effect);
            }
            let table = table::read(&path).unwrap();
            assert_eq!(table.len(), 600);
            assert!(table.rows().eq(set.rows.iter().map(RowView::from)));
            assert!(table.head().rig.simulated);
        }
    }
}

#[test]
fn tables_with_and_without_physics_differ_in_their_counts_alone() {
    let set = |content| short(content).make().unwrap();
    let none = set(Content { none: true, ..Content::default() });
    let some = set(Content { physics: vec!["late-frames".into()], ..Content::default() });
    assert_eq!(none.rig, some.rig);
    let without_counts = |set: &DataSet| -> Vec<Row> {
        set.rows.iter().map(|row| Row { counts: Vec::new(), ..row.clone() }).collect()
    };
    assert_eq!(without_counts(&none), without_counts(&some));
    assert_ne!(none.rows, some.rows);
}
