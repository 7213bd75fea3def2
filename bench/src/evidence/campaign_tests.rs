use std::collections::BTreeSet;

use super::*;

fn all(sizes: &Sizes) -> Vec<Planned> {
    Campaign::ALL.into_iter().flat_map(|campaign| campaigns(campaign, sizes, Seeds::Tuning)).collect()
}

#[test]
fn the_whole_has_what_the_evidence_asks_for() {
    let sets = all(&Sizes::whole());
    let count = |campaign| sets.iter().filter(|set| set.campaign == campaign).count();
    assert!(count(Campaign::FalseAlarms) >= 500);
    assert_eq!(count(Campaign::Names), within().count() * 7);
    assert_eq!((count(Campaign::Pairs), count(Campaign::Triples)), (100, 60));
    assert_eq!(count(Campaign::Outside), outside().count() * 3 * 2);
}

#[test]
fn no_two_sets_share_an_id_or_a_seed() {
    let sets = all(&Sizes::whole());
    let ids: BTreeSet<&str> = sets.iter().map(|set| set.id.as_str()).collect();
    let seeds: BTreeSet<u64> = sets.iter().map(|set| set.recipe.seed).collect();
    assert_eq!((ids.len(), seeds.len()), (sets.len(), sets.len()));
}

#[test]
fn sealed_sets_have_the_ids_of_tuning_sets_and_none_of_their_seeds() {
    let sizes = Sizes::whole();
    let sealed: Vec<Planned> =
        Campaign::ALL.into_iter().flat_map(|campaign| campaigns(campaign, &sizes, Seeds::Sealed)).collect();
    let tuning = all(&sizes);
    let seeds: BTreeSet<u64> = tuning.iter().chain(&sealed).map(|set| set.recipe.seed).collect();
    assert_eq!(seeds.len(), tuning.len() + sealed.len());
    assert!(tuning.iter().zip(&sealed).all(|(one, other)| one.id == other.id));
}

#[test]
fn a_set_is_the_same_in_a_small_campaign_and_in_the_whole() {
    let whole = all(&Sizes::whole());
    for set in [Sizes::quick(), Sizes::slice(), Sizes::sample()].iter().flat_map(all) {
        let twin = whole.iter().find(|other| other.id == set.id);
        assert_eq!(twin.map(|twin| twin.recipe.seed), Some(set.recipe.seed), "{}", set.id);
    }
}

#[test]
fn the_table_does_not_say_what_is_hidden() {
    assert!(all(&Sizes::whole()).iter().all(|set| set.recipe.name == "set"));
}

#[test]
fn the_quick_sets_take_two_forms_of_each_free_class() {
    assert_eq!(all(&Sizes::quick()).len(), 8 + 26 + 6 + 4 + 10);
}

#[test]
fn the_sample_is_as_small_as_ci_can_bear() {
    assert_eq!(all(&Sizes::slice()).len(), 12 + 24 + 4 + 6);
    assert_eq!(all(&Sizes::sample()).len(), 3 + 6 + 1 + 1);
}

#[test]
fn what_ci_watches_is_of_other_forms_than_the_librarys() {
    for sizes in [Sizes::sample(), Sizes::slice()] {
        let points = sizes.physics.iter().filter(|physics| physics.is_library_point);
        assert_eq!(points.map(|physics| physics.id).collect::<Vec<_>>(), [""; 0]);
        let effects: BTreeSet<_> = sizes.physics.iter().map(|physics| physics.effect).collect();
        assert_eq!(effects.len(), sizes.physics.len(), "each effect has one set");
    }
}

#[test]
fn the_sample_is_a_part_of_the_slice() {
    let slice: BTreeSet<String> = all(&Sizes::slice()).into_iter().map(|set| set.id).collect();
    assert!(all(&Sizes::sample()).iter().all(|set| slice.contains(&set.id)));
}

#[test]
fn sealed_sets_are_run_all_together_or_not_at_all() {
    let sizes = [Size::Whole, Size::Ablation, Size::Glance, Size::Quick, Size::Slice, Size::Sample];
    let whole = [true, true, false, false, false, false];
    assert_eq!(sizes.map(|size| Seeds::Sealed.may_show(size, false)), whole);
    assert!(sizes.iter().all(|size| !Seeds::Sealed.may_show(*size, true)));
    assert!(sizes.iter().all(|size| Seeds::Tuning.may_show(*size, true)));
}
