use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{Score, deviate, flipped, largest, p_value, q_values, sign_flip_p, standardised};

#[test]
fn q_values_are_those_of_the_published_example() {
    // Benjamini and Hochberg (1995), Sec. 3.2: 15 p-values, of which the procedure rejects the first four at 0.05.
    let p_values = [
        0.0001, 0.0004, 0.0019, 0.0095, 0.0201, 0.0278, 0.0298, 0.0344, 0.0459, 0.3240, 0.4262, 0.5719,
        0.6528, 0.7590, 1.0,
    ];
    let q_values = q_values(&p_values);
    let rejected = q_values.iter().filter(|q| **q <= 0.05).count();
    assert_eq!(rejected, 4, "{q_values:?}");
    assert!((q_values[3] - 0.0095 * 15.0 / 4.0).abs() < 1e-12);
    assert!(q_values.windows(2).all(|pair| pair[0] <= pair[1]));
}

#[test]
fn a_chi_square_number_becomes_a_normal_deviate() {
    // Upper 1 % points of chi-square (Abramowitz and Stegun, table 26.8); the normal's is 2.326.
    for (freedom, chi_square) in [(4, 13.277), (10, 23.209), (30, 50.892)] {
        assert!((deviate(chi_square, f64::from(freedom)) - 2.326).abs() < 0.02, "{freedom}");
    }
}

#[test]
fn a_statistic_that_no_other_reaches_has_the_least_possible_p_value() {
    assert!((p_value(5.0, &[1.0, 2.0, 3.0]) - 0.25).abs() < 1e-12);
    assert!((p_value(2.0, &[1.0, 2.0, 3.0]) - 0.75).abs() < 1e-12);
}

#[test]
fn gains_of_one_sign_are_significant_and_gains_of_both_are_not() {
    assert!(sign_flip_p(&[1.0; 12], 1999, 1) < 0.005);
    let both: Vec<f64> = (0..12).map(|k| if k % 2 == 0 { 1.0 } else { -1.0 }).collect();
    assert!(sign_flip_p(&both, 1999, 1) > 0.3);
}

/// Scores of one direction and of three, in one panel and over the edge of the next.
#[test]
fn the_largest_of_a_group_is_that_of_its_scores_one_by_one() {
    const FLIPS: usize = 39;
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let mut score = |directions: usize, blocks: usize| {
        let mut draw = || -> Vec<f64> { (0..blocks).map(|_| rng.random_range(0.1..1.0)).collect() };
        Score::of((0..directions).map(|_| standardised(&draw(), &draw())).collect())
    };
    let groups: Vec<Vec<Score>> = vec![
        (0..super::PANEL).map(|_| score(1, 20)).collect(),
        (0..7).map(|_| score(3, 17)).collect(),
        Vec::new(),
        vec![score(super::PANEL + 5, 20), score(0, 20)],
    ];
    let borrowed: Vec<Vec<&Score>> = groups.iter().map(|group| group.iter().collect()).collect();
    let largest = flipped(&borrowed, FLIPS, 5);
    let signs = super::signs(20, FLIPS, 5);
    for (group, largest) in groups.iter().zip(&largest) {
        for (flip, largest) in largest.iter().enumerate() {
            let of_score = |score: &Score| {
                let signs = signs.column(flip);
                let sum = |parts: &Vec<f32>| -> f64 {
                    parts.iter().zip(&signs).map(|(part, sign)| f64::from(*part) * f64::from(*sign)).sum()
                };
                let squares = score.parts.iter().map(|parts| sum(parts).powi(2)).sum();
                deviate(squares, score.parts.len() as f64)
            };
            let one_by_one = group.iter().map(of_score).fold(0.0, f64::max);
            assert!((largest - one_by_one).abs() < 1e-4, "flip {flip}: {largest}, not {one_by_one}");
        }
    }
    assert!(largest[0].iter().any(|value| *value > 1.0), "{largest:?}");
}

/// Residuals without any effect, and the pair of elements that they suggest most. Each residual is noise; the signals are not.
#[test]
fn the_best_of_many_pairs_is_significant_no_more_often_than_its_level_says() {
    const ELEMENTS: usize = 12;
    const BLOCKS: usize = 60;
    const NULLS: u32 = 400;
    let pairs = (ELEMENTS * (ELEMENTS - 1)) as f64;
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    let (mut alarms, mut uncharged) = (0, 0);
    for seed in 0..NULLS {
        let mut draw =
            || -> Vec<f64> { (0..ELEMENTS * BLOCKS).map(|_| rng.random_range(-1.0..1.0)).collect() };
        let (signal, noise) = (draw(), draw());
        let of_pair = |element: usize, other: usize| {
            let at = |block: usize, of: usize| block * ELEMENTS + of;
            let along: Vec<f64> =
                (0..BLOCKS).map(|block| noise[at(block, element)] * signal[at(block, other)]).collect();
            // The variance of the noise is a third.
            let squares: Vec<f64> = (0..BLOCKS).map(|block| signal[at(block, other)].powi(2) / 3.0).collect();
            Score::of(vec![standardised(&along, &squares)])
        };
        let all = (0..ELEMENTS).flat_map(|one| (0..ELEMENTS).map(move |other| [one, other]));
        let scores = all.filter(|[one, other]| one != other).map(|[one, other]| of_pair(one, other));
        let best = scores.max_by(|a, b| a.z.total_cmp(&b.z)).unwrap();
        let significant = |score: Score| {
            let under_none = largest(&flipped(&[vec![&score]], 199, u64::from(seed)));
            u32::from(p_value(score.z, &under_none) <= 0.05)
        };
        uncharged += significant(best.clone());
        alarms += significant(best.picked_from(pairs));
    }
    // Three standard errors above 5 %.
    assert!(
        f64::from(alarms) <= f64::from(NULLS) * (0.05 + 3.0 * (0.05 * 0.95 / f64::from(NULLS)).sqrt()),
        "{alarms}"
    );
    // The same test sees the pick if nothing is charged for it.
    assert!(uncharged > NULLS / 2, "{uncharged}");
}
