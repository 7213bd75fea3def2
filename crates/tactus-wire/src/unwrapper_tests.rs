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

    #[test]
    fn a_step_is_the_shorter_way_round(
        modulus in prop_oneof![2..300u128, 2..=1u128 << 64, Just(1 << 64)],
        before: u64,
        after: u64,
    ) {
        let [before, after] = [before, after].map(|raw| u128::from(raw) % modulus);
        let raw = [before, after].map(|raw| u64::try_from(raw).unwrap());
        let by = u64::try_from((after + modulus - before) % modulus).unwrap();
        let expected = match by {
            0 => Advance::Same { total: raw[0] },
            _ if u128::from(by) > modulus / 2 => Advance::Anew { total: raw[1] },
            _ => Advance::Ahead { by, total: raw[0].saturating_add(by) },
        };
        prop_assert_eq!(steps(modulus, &raw)[1], expected);
    }

    #[test]
    fn numbers_are_taken_modulo_the_modulus(modulus in 2..300u64, number: u64) {
        prop_assert_eq!(steps(modulus.into(), &[number]), [Advance::Anew { total: number % modulus }]);
    }
}
