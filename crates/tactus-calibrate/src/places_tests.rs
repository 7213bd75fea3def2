use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;

/// Compares each place with all.
fn truly_distinct(places_mm: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut distinct: Vec<[f64; 2]> = Vec::new();
    for place in places_mm {
        if distinct.iter().all(|other| (place[0] - other[0]).hypot(place[1] - other[1]) > 0.05) {
            distinct.push(*place);
        }
    }
    distinct
}

#[test]
fn places_are_told_apart_as_if_each_were_compared_with_all() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for (presses, width_mm) in [(40, 0.05), (40, 0.3), (200, 1.0), (200, 5.0)] {
        let mut place = || [0, 1].map(|_| rng.random_range(-0.5 * width_mm..0.5 * width_mm));
        let places: Vec<[f64; 2]> = (0..presses).map(|_| place()).collect();
        assert_eq!(distinct_places(places.iter().copied()), truly_distinct(&places), "{presses} {width_mm}");
    }
}
