use super::*;

/// Every stage, with small and large numbers.
fn all() -> Vec<Stage> {
    let alone = [
        Stage::Base,
        Stage::Locating,
        Stage::Scattering,
        Stage::Withdrawing,
        Stage::Forms,
        Stage::Contests,
        Stage::Confirming,
        Stage::LocatingLeft,
        Stage::Judging,
        Stage::Drafting,
    ];
    let numbered = (0..=5).flat_map(|number| {
        [
            Stage::Scoring { names: number },
            Stage::Testing { names: number },
            Stage::Fitting { names: number },
            Stage::Comparing { left: number },
            Stage::Planning { questions: number },
        ]
    });
    alone.into_iter().chain(numbered).collect()
}

#[test]
fn every_stage_has_a_row_and_every_row_a_stage() {
    for stage in all() {
        assert!(stage.left().is_some(), "{stage:?}");
    }
    for (name, _) in LEFT {
        assert!(all().iter().any(|stage| stage.name() == name), "{name}");
    }
}

#[test]
fn quantiles_are_in_order() {
    for (name, left) in LEFT {
        assert!(left[0] >= 0.0 && left.is_sorted(), "{name}");
    }
}

#[test]
fn the_time_left_is_in_proportion_to_the_time_so_far() {
    let left = TimeLeft { least: 0.5, median: 1.0, most: 4.0 };
    assert_eq!(left.range_s(10.0).map(f64::to_bits), [5.0, 40.0].map(f64::to_bits));
    assert_eq!(left.range_s(20.0).map(f64::to_bits), [10.0, 80.0].map(f64::to_bits));
    assert!((left.share_done() - 0.5).abs() < 1e-12);
}

#[test]
fn activities_of_parallel_work_belong_to_the_stage() {
    let told = Mutex::new(Vec::new());
    let progress = |now: Progress| told.lock().unwrap_or_else(PoisonError::into_inner).push(now);
    let reporter = Reporter::new(&progress);
    reporter.enter(Stage::Fitting { names: 1 }, "round 2: fitting effects");
    std::thread::scope(|scope| {
        scope.spawn(|| reporter.tell("fitting hysteresis"));
    });
    let told = told.into_inner().unwrap_or_else(PoisonError::into_inner);
    let stages: Vec<Stage> = told.iter().map(|now| now.stage).collect();
    assert_eq!(stages, [Stage::Fitting { names: 1 }; 2]);
    assert_eq!(told[1].what, "fitting hysteresis");
}
