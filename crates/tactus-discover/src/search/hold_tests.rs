use std::sync::Mutex;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use tactus_model::Effect;

use super::*;
use crate::fit::Prepared;
use crate::fixtures::{ELEMENTS, OPTIONS, known, measured, processes, search};
use crate::progress::{Progress, Reporter};
use crate::search::Candidate;

#[test]
fn names_that_have_held_their_place_are_not_judged_again() {
    let known = known();
    let noise = processes(ELEMENTS, 1.0, 1e-3, &mut ChaCha8Rng::seed_from_u64(5));
    let hardening =
        Effect::new("hardening", [("growth_at_1_mm", 0.3), ("exponent", 2.0), ("own_share", 0.0)]).unwrap();
    let frames = measured(&known, &[hardening], &noise);
    let prepared = Prepared::new(&known, &frames, OPTIONS.seed).unwrap();
    let problem = prepared.problem();
    let candidates = Candidate::all(&problem, &prepared.base, &[]).unwrap();
    let compared = Mutex::new(0);
    let see = |now: Progress| {
        if matches!(now.stage, Stage::Comparing { .. }) {
            *compared.lock().unwrap() += 1;
        }
    };
    let reporter = Reporter::new(&see);
    let search = search(&problem, &candidates, &reporter);
    let mut grown = search.grow(&prepared.base).unwrap();
    assert_eq!(search.sorted_names(&grown.at), ["hardening"]);
    let held = grown.at.parameters.clone();
    assert!(*compared.lock().unwrap() > 0, "its place was compared with others");

    // One more, which is nothing, is added.
    let mut more = held.clone();
    more.terms
        .push(Term::of(&Effect::new("softening", [("softened_share", 0.01), ("width_share", 1.0)]).unwrap()));
    grown.at = problem.fit_from(more, POLISH_ROUNDS).unwrap();
    grown.held.as_mut().unwrap().rounds -= 1;
    grown.rounds.last_mut().unwrap().round.taken = Some("softening");
    *compared.lock().unwrap() = 0;
    search.hold(&mut grown).unwrap();
    assert_eq!((search.sorted_names(&grown.at), &grown.at.parameters), (vec!["hardening"], &held));
    assert_eq!(*compared.lock().unwrap(), 0);
    assert!(grown.equivalent.contains_key("hardening"));

    // If a rival has beaten some of what was added, all of it is left alone.
    assert!(grown.barred.is_empty());
    grown.barred.push((vec!["hardening", "softening"], "saturation"));
    assert!(search.is_back(&mut grown, 0));
    assert_eq!(grown.barred[1..], [(vec!["hardening"], "softening")]);
}

#[test]
fn a_search_that_has_done_as_much_as_it_may_takes_nothing_more_and_says_so() {
    let known = known();
    let noise = processes(ELEMENTS, 1.0, 1e-3, &mut ChaCha8Rng::seed_from_u64(5));
    let hidden = Effect::new("time-lag", [("lag_s", 0.15)]).unwrap();
    let frames = measured(&known, &[hidden], &noise);
    let prepared = Prepared::new(&known, &frames, OPTIONS.seed).unwrap();
    let grown = |more_work: u64| {
        // Each has counted its own work.
        let problem = prepared.problem();
        let candidates = Candidate::all(&problem, &prepared.base, &[]).unwrap();
        let work_most = problem.predictor.work() + more_work;
        let reporter = Reporter::new(&|_| {});
        let search = Search { work_most, ..search(&problem, &candidates, &reporter) };
        let grown = search.grow(&prepared.base).unwrap();
        (search.sorted_names(&grown.at), grown.is_cut)
    };
    assert_eq!(grown(0), (vec![], true));
    assert_eq!(grown(u64::MAX / 2), (vec!["time-lag"], false));
}
