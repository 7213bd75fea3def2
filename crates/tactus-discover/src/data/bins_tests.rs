use tactus_schema::table::{Phase, RowView};

use super::{HeldOut, same};
use crate::Frames;

/// A press of one frame in contact between frames in the clear: its run, depth and covering.
type Press = (usize, f64, f64);

/// Frames of presses, each 4 s after the one before.
fn frames(presses: &[Press]) -> Frames {
    let mut frames = Frames::new(1);
    for (index, (run, depth_mm, covering_mm)) in presses.iter().enumerate() {
        let press = i32::try_from(index).unwrap();
        for (within, z_mm) in [1.0, -depth_mm, 1.0].into_iter().enumerate() {
            frames.push(RowView {
                run: &run.to_string(),
                press,
                phase: if z_mm < 0.0 { Phase::Hold } else { Phase::Approach },
                t_ns: i64::from(press) * 4_000_000_000 + i64::try_from(within).unwrap() * 1_000_000_000,
                position_mm: [0.0, 0.0, z_mm],
                covering_mm: *covering_mm,
                indenter: "cyl1",
                temperature_c: None,
                counts: &[0.0],
            });
        }
    }
    frames
}

/// So many presses of each depth, in turn, in one run.
fn of_depths(depths: &[(f64, usize)]) -> Vec<Press> {
    let most = depths.iter().map(|(_, count)| *count).max().unwrap();
    let in_turn = (0..most).flat_map(|nth| depths.iter().filter(move |(_, count)| nth < *count));
    in_turn.map(|(depth_mm, _)| (0, *depth_mm, 1.0)).collect()
}

/// For each press, whether it is held out.
fn held(presses: &[Press], chosen: &HeldOut) -> Vec<bool> {
    (0..presses.len()).map(|press| chosen.frames[3 * press]).collect()
}

#[test]
fn the_middle_depth_is_held_out_whole() {
    let presses = of_depths(&[(0.2, 20), (0.3, 20), (0.4, 20), (0.5, 20)]);
    for seed in 0..10 {
        let chosen = HeldOut::choose(&frames(&presses), seed);
        assert_eq!((chosen.depths_mm.as_slice(), chosen.presses), (&[0.4][..], 26));
        let of_depth = presses.iter().zip(held(&presses, &chosen)).filter(|((_, mm, _), _)| same(*mm, 0.4));
        assert!(of_depth.into_iter().all(|(_, held)| held));
    }
}

#[test]
fn a_depth_of_most_presses_is_not_held_out_whole() {
    let presses = of_depths(&[(0.3, 7), (0.4, 7), (0.508, 110), (0.7, 7)]);
    for seed in 0..10 {
        let chosen = HeldOut::choose(&frames(&presses), seed);
        assert_eq!((chosen.depths_mm.as_slice(), chosen.presses), (&[0.4][..], 43), "the next one is");
        let out = held(&presses, &chosen);
        let fitted = presses.iter().zip(&out).filter(|((_, mm, _), out)| same(*mm, 0.508) && !**out).count();
        assert!(fitted > 60, "{fitted}");
    }
    // All others are rare, or at an end.
    let chosen = HeldOut::choose(&frames(&of_depths(&[(0.3, 7), (0.4, 3), (0.508, 110), (0.7, 7)])), 1);
    assert_eq!((chosen.depths_mm.as_slice(), chosen.presses), (&[][..], 42));
}

/// For each run, how many of its presses are fitted.
fn fitted_of_runs(presses: &[Press], chosen: &HeldOut) -> Vec<usize> {
    let runs = presses.iter().map(|(run, ..)| run + 1).max().unwrap();
    let out = held(presses, chosen);
    let is_fitted = |run: usize| move |((of, ..), out): &(&Press, &bool)| *of == run && !**out;
    (0..runs).map(|run| presses.iter().zip(&out).filter(is_fitted(run)).count()).collect()
}

#[test]
fn each_run_keeps_a_fitted_press() {
    // One covering a run.
    let coverings: Vec<Press> =
        (0..40).map(|press| (press / 10, 0.4, [1.0, 1.5, 2.0, 2.5][press / 10])).collect();
    // Runs of two presses.
    let pairs: Vec<Press> = (0..24).map(|press| (press / 2, 0.4, 1.0)).collect();
    // Runs of a single press beside a long one.
    let singles: Vec<Press> = (0..30).map(|press| (press.max(20_usize) - 20, 0.4, 1.0)).collect();
    for (presses, wanted) in [(coverings, 13), (pairs, 8), (singles, 10)] {
        for seed in 0..20 {
            let chosen = HeldOut::choose(&frames(&presses), seed);
            assert_eq!((chosen.presses, &chosen.coverings_mm), (wanted, &Vec::new()), "seed {seed}");
            let fitted = fitted_of_runs(&presses, &chosen);
            assert!(fitted.iter().all(|count| *count > 0), "seed {seed}: {fitted:?}");
        }
    }
}

#[test]
fn some_are_held_out_though_no_run_has_another_press() {
    let presses: Vec<Press> = (0..12).map(|press| (press, 0.4, 1.0)).collect();
    for seed in 0..10 {
        assert_eq!(HeldOut::choose(&frames(&presses), seed).presses, 3);
    }
}

#[test]
fn a_run_keeps_a_rest_that_shows_its_zeros() {
    // Presses without a frame in the clear, and a rest that is no press of either run, long before the first one.
    for seed in 0..20 {
        let mut frames = frames(&(0..12).map(|press| (press / 6, 0.4, 1.0)).collect::<Vec<Press>>());
        for frame in 0..frames.len() {
            let is_rest = frame % 18 < 3;
            frames.press[frame] = if is_rest { -1 } else { frames.press[frame] };
            frames.position_mm[frame][2] = if is_rest { 1.0 } else { -0.4 };
        }
        let chosen = HeldOut::choose(&frames, seed);
        for run in [0, 18] {
            let rest = run..run + 3;
            assert!(rest.into_iter().any(|frame| !chosen.frames[frame]), "seed {seed}: {:?}", chosen.frames);
        }
    }
}
