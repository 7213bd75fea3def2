use proptest::prelude::*;

use super::{Advance, Unwrapper};

fn steps(modulus: u128, numbers: &[u64]) -> Vec<Advance> {
    let mut wrapping = Unwrapper::new(modulus);
    numbers.iter().map(|raw| wrapping.advance(*raw)).collect()
}

#[test]
fn wraps_without_a_trace() {
    assert_eq!(
        steps(256, &[254, 255, 0, 0, 3]),
        [
            Advance::Anew { total: 254 },
            Advance::Ahead { by: 1, total: 255 },
            Advance::Ahead { by: 1, total: 256 },
            Advance::Same { total: 256 },
            Advance::Ahead { by: 3, total: 259 },
        ]
    );
}

#[test]
fn a_step_back_begins_anew() {
    assert_eq!(
        steps(1000, &[900, 20, 19])[1..],
        [Advance::Ahead { by: 120, total: 1020 }, Advance::Anew { total: 19 }]
    );
}

#[test]
fn the_widest_number_wraps_too() {
    assert_eq!(steps(1 << 64, &[u64::MAX, 0])[1], Advance::Ahead { by: 1, total: u64::MAX });
}

proptest! {
    #[test]
    fn small_steps_add_up(modulus in 4..70_000u64, by in prop::collection::vec(0..2u64, 1..50)) {
        let mut sum = 0;
        let mut wrapping = Unwrapper::new(u128::from(modulus));
        wrapping.advance(0);
        for by in by {
            sum += by;
            prop_assert_eq!(wrapping.advance(sum % modulus).total(), sum);
        }
    }
}
