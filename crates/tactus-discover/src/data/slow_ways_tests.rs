use tactus_schema::table::{Phase, RowView};

use super::{DEPTH_PARTS, SHOWS_Z};
use crate::Frames;
use crate::data::bins::{Averaged, Bins};
use crate::data::{Noise, still};

const COUNTS_PER_MM: f64 = 1000.0;
const DEEPEST_MM: f64 = 0.4;

/// Depth and phase at the frames of a press: down by so much a frame, a hold, and up again as fast as a frame allows.
fn press(step_mm: f64) -> Vec<(f64, Phase)> {
    let idle = std::iter::repeat_n((-1.0, Phase::Idle), 30);
    let steps = std::iter::successors(Some(-10.0 * step_mm), move |depth_mm| Some(depth_mm + step_mm));
    let load = steps.take_while(|depth_mm| *depth_mm < DEEPEST_MM).map(|depth_mm| (depth_mm, Phase::Load));
    let hold = std::iter::repeat_n((DEEPEST_MM, Phase::Hold), 30);
    let unload = [0.2, 0.0, -0.2].map(|depth_mm| (depth_mm, Phase::Unload));
    idle.chain(load).chain(hold).chain(unload).collect()
}

/// Presses of an element whose counts follow the depth, with a noise of so many counts that changes its sign from frame to frame.
fn frames(press_of: &[(f64, Phase)], noise_counts: f64) -> Frames {
    let mut frames = Frames::new(1);
    for (number, (depth_mm, phase)) in std::iter::repeat_n(press_of, 4).flatten().copied().enumerate() {
        let noise = if number % 2 == 0 { noise_counts } else { -noise_counts };
        #[expect(clippy::cast_possible_truncation, reason = "counts are stored so")]
        let counts = (100.0 + COUNTS_PER_MM * depth_mm.max(0.0) + noise) as f32;
        let press = i32::try_from(number / press_of.len()).unwrap();
        frames.push(RowView {
            run: "a",
            press: if phase == Phase::Idle { -1 } else { press },
            phase,
            t_ns: i64::try_from(number).unwrap() * 33_333_333,
            position_mm: [0.0, 0.0, -depth_mm],
            covering_mm: 1.0,
            indenter: "cyl1",
            temperature_c: None,
            counts: &[counts],
        });
    }
    frames
}

/// The frames of presses and their bins, and the bins of a way.
fn binned(press: &[(f64, Phase)], noise_counts: f64) -> (Frames, Bins, Vec<usize>) {
    let frames = frames(press, noise_counts);
    let (noise, _) = Noise::measured(&frames, &still(&frames), 1.0);
    let bins = Bins::of(&frames, Averaged::RestsAndSlowWays(&noise)).unwrap();
    let ways = (0..bins.len()).filter(|bin| bins.moves[*bin]).collect();
    (frames, bins, ways)
}

#[test]
fn a_slow_way_is_averaged_once_its_contact_shows() {
    let (frames, bins, ways) = binned(&press(0.004), 1.0);
    let in_ways: usize = ways.iter().map(|bin| bins.frames_in(*bin)).sum();
    assert!(in_ways > 4 * 80, "{in_ways} of 4 x 111 frames of a load");
    for bin in ways {
        let (first, last) = (bins.first[bin], bins.first[bin + 1] - 1);
        let [above, below] = [first, last].map(|frame| -frames.position_mm[frame][2]);
        assert!(COUNTS_PER_MM * above > SHOWS_Z, "{above} mm");
        assert!(below - above <= DEEPEST_MM / DEPTH_PARTS + 1e-9, "from {above} to {below} mm");
        assert!((first..=last).all(|frame| frames.phase[frame] == Phase::Load));
    }
}

#[test]
fn a_way_is_predicted_as_its_middle_and_its_frames_along_it() {
    let (frames, bins, ways) = binned(&press(0.004), 1.0);
    let expected = |z_mm: f64| 100.0 - COUNTS_PER_MM * z_mm;
    let predicted: Vec<f64> =
        (0..bins.len()).map(|bin| expected(bins.position_mm(&frames, bin)[2].min(0.0))).collect();
    for bin in ways {
        let most = if bins.frames_in(bin) % 2 == 0 { 1e-3 } else { 1.0 };
        assert!((bins.counts[bin] - predicted[bin]).abs() <= most, "{}", bins.counts[bin] - predicted[bin]);
        let slope = bins.slope_per_s(&predicted, bin, 0);
        for frame in bins.first[bin]..bins.first[bin + 1] {
            let of_frame = predicted[bin] + slope * (frames.t_s[frame] - bins.t_s[bin]);
            assert!((of_frame - expected(frames.position_mm[frame][2])).abs() < 1e-3, "{of_frame}");
        }
    }
}

#[test]
fn a_way_whose_contact_no_reading_shows_is_not_averaged() {
    // Eight standard deviations are more than the deepest press.
    let press = press(0.004);
    let (_, bins, ways) = binned(&press, COUNTS_PER_MM * DEEPEST_MM / 7.0);
    assert!(ways.is_empty() && bins.len() < 4 * press.len(), "rests are");
}

/// On its last frames before a hold the tip hardly moves faster than one that rests.
#[test]
fn a_hold_after_a_way_is_a_rest_of_its_own() {
    let (frames, bins, ways) = binned(&press(0.0015), 1.0);
    assert!(!ways.is_empty());
    let is_hold = |frame: usize| frames.phase[frame] == Phase::Hold;
    let mut holds = 0;
    for bin in 0..bins.len() {
        let (first, end) = (bins.first[bin], bins.first[bin + 1]);
        if (first..end).any(is_hold) {
            assert!((first..end).all(is_hold) && !bins.moves[bin]);
            // A bin is short where a relaxation is fast.
            let since = (0..first).rev().take_while(|frame| is_hold(*frame)).count();
            assert!(end - first == 1 || 4 * (end - first) <= since + 4, "{} after {since}", end - first);
            holds += 1;
        }
    }
    assert!(holds > 4 * 10, "{holds}");
}

#[test]
fn a_way_that_bends_is_averaged_in_short_parts() {
    // Two seconds down and two up again, by 0.2 micrometres a frame less each frame: never a step that counts as another.
    let around = (-60..=60).map(|frame| (DEEPEST_MM - 1e-4 * f64::from(frame).powi(2), Phase::Load));
    let idle = std::iter::repeat_n((-1.0, Phase::Idle), 30);
    // A hold that shows that positions do not jitter.
    let hold = std::iter::repeat_n((0.04, Phase::Hold), 30);
    let press: Vec<(f64, Phase)> = idle.chain(around).chain(hold).collect();
    let (frames, bins, ways) = binned(&press, 1.0);
    assert!(!ways.is_empty());
    for bin in ways {
        let depths = frames.position_mm[bins.first[bin]..bins.first[bin + 1]].iter().map(|at| at[2]);
        let mean = depths.clone().sum::<f64>() / bins.frames_in(bin) as f64;
        let off_mm = mean - bins.position_mm(&frames, bin)[2];
        assert!(off_mm.abs() <= 1e-3, "{off_mm} mm");
    }
}

#[test]
fn positions_that_jitter_tell_no_straight_way() {
    let mut press = press(0.004);
    for (number, (depth_mm, _)) in press.iter_mut().enumerate() {
        *depth_mm += 1e-3 * (2.7 * (number * number) as f64).sin();
    }
    assert!(binned(&press, 1.0).2.is_empty());
}
