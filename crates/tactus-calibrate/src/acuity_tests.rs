use std::collections::HashSet;

use super::{
    AcuityError, DiscretisingSensor, Grid, NYQUIST_FREQUENCY, NYQUIST_SIGMA, OFFSETS, OFFSETS_BETWEEN, passed,
};

fn sensor(sigma: f64, force_steps: f64) -> DiscretisingSensor {
    DiscretisingSensor::new(sigma, 1.0 / force_steps).unwrap()
}

/// The paper's procedure, literally: every step, and the set of all readings.
fn count_all(sensor: DiscretisingSensor) -> usize {
    let step = 0.02 * sensor.force_resolution();
    let steps = (0..).map(|nth| f64::from(nth) * step).take_while(|at| *at <= 1.0 + 1e-12);
    steps.map(|at| sensor.reading([at])).collect::<HashSet<_>>().len()
}

fn step_apart(sensor: DiscretisingSensor, offset: f64) -> Option<f64> {
    let step = 0.02 * sensor.force_resolution();
    let together = sensor.reading([offset; 2]);
    let mut apart =
        (0..).map(|nth| f64::from(nth) * step).take_while(|apart| *apart < 10.0 + 18.0 * sensor.sigma());
    apart.find(|apart| sensor.reading([offset - 0.5 * apart, offset + 0.5 * apart]) != together)
}

/// Irregular spreads and force steps, and others that make exact ties: half-integer steps under nearly no spread, odd
/// steps at an edge.
fn awkward() -> impl Iterator<Item = DiscretisingSensor> {
    let sigmas = [0.001, 0.02, 0.05, 0.11, 0.24, 0.313, 0.5, 0.955, 1.36, 3.0, 10.0];
    let force_steps = [1.0, 2.0, 3.0, 4.5, 5.0, 7.3, 16.0, 33.0, 100.5, 141.421_356, 256.0];
    sigmas.into_iter().flat_map(move |sigma| force_steps.map(|steps| sensor(sigma, steps)))
}

#[test]
fn steps_left_out_change_no_count() {
    for sensor in awkward() {
        assert_eq!(sensor.locations(), count_all(sensor), "{sensor:?}");
    }
}

#[test]
fn steps_left_out_change_no_separation() {
    for sensor in awkward() {
        for offset in [0.0, 0.05, 0.3, 0.5, 0.777, 0.95] {
            assert_eq!(sensor.separation(offset), step_apart(sensor, offset), "{sensor:?} at {offset}");
        }
    }
}

#[test]
#[expect(clippy::float_cmp, reason = "numbers of steps are whole")]
fn every_reading_on_the_way_is_met() {
    for sensor in awkward().filter(|sensor| sensor.force_resolution() > 0.01) {
        let step = 0.02 * sensor.force_resolution();
        let mut seen = sensor.glide([0.2, 0.3], [1.0, -0.25], 2000.0).peekable();
        let mut reading = [0; 5];
        for nth in 0..=2000 {
            if let Some((_, next)) = seen.next_if(|(step, _)| *step == f64::from(nth)) {
                reading = next;
            }
            let way = f64::from(nth) * step;
            assert_eq!(sensor.reading([0.2 + way, 0.3 - 0.25 * way]), reading, "{sensor:?}, step {nth}");
        }
    }
}

/// From an independent program (numpy and `scipy.special.ndtr`, every step, `numpy.unique`), with spreads in steps
/// of 0.01: the greatest number of locations and the least spread that has it.
#[test]
fn the_ridge_stands_where_another_program_found_it() {
    let force_steps = [4.0, 10.0, 20.0, 50.0, 100.0, 256.0, 1000.0];
    let found = [(0.31, 8), (0.30, 19), (0.30, 37), (0.27, 93), (0.27, 189), (0.26, 485), (0.24, 1925)];
    for (force_steps, (sigma, locations)) in force_steps.into_iter().zip(found) {
        let grid = Grid {
            sigmas: (2..=60).map(|hundredths| f64::from(hundredths) / 100.0).collect(),
            force_resolutions: vec![1.0 / force_steps],
        };
        let counts = grid.map(|sensor| (sensor.sigma(), sensor.locations())).unwrap();
        let most = counts.iter().rev().max_by_key(|(_, count)| *count).unwrap();
        assert_eq!(*most, (sigma, locations), "1/f = {force_steps}");
    }
}

#[test]
fn between_whole_numbers_of_steps_there_is_a_plateau_and_no_ridge() {
    for force_steps in [10.37, 23.7, 57.3, 141.42, 700.3] {
        let counts: Vec<_> =
            (5..=15).map(|s| sensor(0.01 * f64::from(s), force_steps).locations() as f64).collect();
        let plateau = 2.0 * force_steps;
        assert!(counts.iter().all(|count| (count / plateau - 1.0).abs() < 0.02), "{force_steps}: {counts:?}");
        assert!((sensor(0.3, force_steps).locations() as f64) < 1.02 * plateau);
    }
    // Whole numbers of steps: neighbours change together, so there are half as many readings.
    for force_steps in [10.0, 57.0, 256.0, 700.0] {
        let count = sensor(0.1, force_steps).locations() as f64;
        assert!((count / force_steps - 1.0).abs() < 0.11, "{force_steps}: {count}");
    }
}

/// The same program, with the spreads and force steps of [`Grid::whole`].
#[test]
fn the_optimum_for_two_points_hangs_on_where_they_are() {
    let best = |offsets: &[f64]| {
        let grid = Grid::whole();
        let means = grid.map(|sensor| sensor.mean_separation(offsets)).unwrap();
        let rows = means.chunks(25).map(|row| {
            let known =
                row.iter().zip(&grid.sigmas).filter_map(|(mean, sigma)| mean.map(|mean| (mean, *sigma)));
            let (_, sigma) = known.min_by(|one, other| one.0.total_cmp(&other.0)).unwrap();
            (100.0 * sigma).round() / 100.0
        });
        rows.collect::<Vec<_>>()
    };
    let on_the_paper: [f64; 25] = [
        0.34, 0.55, 0.16, 0.21, 0.34, 0.21, 0.34, 0.34, 0.26, 0.43, 0.34, 0.34, 0.43, 0.43, 0.55, 0.26, 0.34,
        0.34, 0.34, 0.34, 0.34, 0.34, 0.43, 0.43, 0.43,
    ];
    assert_eq!(best(&OFFSETS), on_the_paper);
    assert_eq!(on_the_paper.iter().filter(|sigma| (0.26..=0.43).contains(*sigma)).count(), 20);
    let between: [f64; 25] = [
        0.26, 0.34, 0.13, 0.16, 0.43, 0.43, 0.16, 0.26, 0.21, 0.16, 0.16, 0.26, 0.16, 0.34, 0.21, 0.21, 0.26,
        0.16, 0.26, 0.21, 0.21, 0.16, 0.26, 0.21, 0.16,
    ];
    assert_eq!(best(&OFFSETS_BETWEEN), between);
    assert_eq!(between.iter().filter(|sigma| (0.10..=0.34).contains(*sigma)).count(), 23);
}

#[test]
fn a_change_that_never_comes_is_none() {
    // Each element gets a tenth of the force: less than half the resolution, whether the points are together or apart.
    let coarse = sensor(10.0, 4.0);
    assert_eq!(coarse.separation(0.5), None);
    assert_eq!(coarse.mean_separation(&OFFSETS), None);
    assert_eq!(coarse.locations(), 1);
    assert_eq!(sensor(0.3, 4.0).mean_separation(&[]), None);
}

#[test]
fn without_spread_an_element_says_nothing_of_the_place_inside_it() {
    // At either edge two elements share the force; inside, one element gets all of it.
    assert_eq!(sensor(0.001, 4.0).reading([0.0]), [0, 2, 2, 0, 0]);
    assert_eq!(sensor(0.001, 4.0).reading([0.5]), [0, 0, 4, 0, 0]);
    // From the middle, each point moves half an element until it reaches the next neighbour.
    let apart = sensor(0.001, 4.0).separation(0.5).unwrap();
    assert!((apart - 1.0).abs() < 0.01, "{apart}");
}

#[test]
fn at_the_nyquist_frequency_three_standard_deviations_are_left() {
    assert!((NYQUIST_SIGMA - 0.955).abs() < 5e-4);
    // exp(-3^2 / 2)
    assert!((passed(NYQUIST_SIGMA, NYQUIST_FREQUENCY) - (-4.5_f64).exp()).abs() < 1e-15);
    assert!((passed(1.0, NYQUIST_FREQUENCY) - 0.007_19).abs() < 1e-5);
    assert!((passed(2.0, 0.0) - 1.0).abs() < 1e-15);
}

#[test]
fn panels_are_in_order_and_name_what_they_cannot_do() {
    let grid = Grid { sigmas: vec![0.1, 0.2], force_resolutions: vec![0.25, 0.5, 1.0] };
    let cells = grid.map(|sensor| (sensor.sigma(), sensor.force_resolution())).unwrap();
    assert_eq!(cells, [(0.1, 0.25), (0.2, 0.25), (0.1, 0.5), (0.2, 0.5), (0.1, 1.0), (0.2, 1.0)]);
    for (sigma, force_resolution) in
        [(0.0, 0.1), (f64::NAN, 0.1), (1e3, 0.1), (0.3, 0.0), (0.3, f64::NAN), (0.3, 2.0)]
    {
        let error =
            Grid { sigmas: vec![sigma], force_resolutions: vec![force_resolution] }.map(|_| ()).unwrap_err();
        let of_sigma = matches!(error, AcuityError::Sigma { .. });
        assert_eq!(of_sigma, (force_resolution - 0.1).abs() < 1e-9, "{error}");
    }
    let steps: Vec<_> = Grid::whole().force_resolutions.iter().map(|f| 1.0 / f).collect();
    assert_eq!((steps.len(), steps[0].round(), steps[24].round()), (25, 4.0, 256.0));
}

#[test]
fn the_number_of_threads_changes_no_cell_of_a_map() {
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| Grid::even(7).map(|sensor| sensor.separation(0.3).map(f64::to_bits)).unwrap())
    };
    assert_eq!(on(1), on(3));
}
