use std::collections::BTreeSet;

use tactus_model::Effect;
use tactus_model::effect::Definition;
use tactus_schema::table::{Phase, RowView};

use super::Excerpt;
use crate::fixtures::{ELEMENTS, base, known, measured};
use crate::{Frames, predict};

fn of_most(elements: usize, frames_most: usize) -> Frames {
    let mut frames = Frames::new(elements);
    frames.excerpt = Excerpt::of_frames(frames_most);
    frames
}

/// Presses of so many frames; between two of them the tip is clear of the surface for two.
fn push(frames: &mut Frames, run: &str, presses: i32, each: i32) {
    for (frame, t_ns) in (0..presses * (each + 2)).zip((0..).step_by(33_000_000)) {
        let press = frame / (each + 2);
        let touches = frame % (each + 2) < each;
        frames.push(RowView {
            run,
            press: if touches { press } else { -1 },
            phase: if touches { Phase::Hold } else { Phase::Idle },
            t_ns,
            position_mm: [f64::from(press % 8), 0.0, if touches { -0.5 } else { 2.0 }],
            covering_mm: 1.0,
            indenter: "cyl1",
            temperature_c: None,
            counts: &[0.0],
        });
    }
}

/// The presses that are read, in order.
fn presses(frames: &Frames) -> Vec<i32> {
    let mut presses: Vec<i32> = frames.press.iter().copied().filter(|press| *press >= 0).collect();
    presses.dedup();
    presses
}

#[test]
fn a_recording_that_is_not_long_is_read_whole() {
    let mut frames = of_most(1, 120);
    push(&mut frames, "a", 10, 10);
    assert_eq!((frames.len(), frames.left_out()), (120, 0));
    assert!(frames.way.is_empty());
}

#[test]
fn of_a_long_recording_whole_presses_from_all_of_it_are_read() {
    let mut frames = of_most(1, 240);
    push(&mut frames, "a", 1000, 10);
    assert!((120..=240).contains(&frames.len()), "{}", frames.len());
    assert_eq!(frames.left_out(), 12_000 - frames.len() as u64);
    let read = presses(&frames);
    for press in &read {
        assert_eq!(frames.press.iter().filter(|one| *one == press).count(), 10, "press {press}");
    }
    // One of each group, 12 frames each.
    let group = 1 << frames.excerpt.halvings;
    let groups: Vec<i32> = read.iter().map(|press| press / group).collect();
    assert_eq!(groups, (0..i32::try_from(groups.len()).unwrap()).collect::<Vec<_>>());
    assert!(1000 - groups.last().unwrap() * group <= 2 * group);
    assert!(frames.numbers().is_sorted_by(|one, next| one < next));
    assert_eq!(frames.runs, [("a".to_owned(), frames.len())]);
}

#[test]
fn a_rhythm_of_the_presses_hides_no_place() {
    let mut frames = of_most(1, 1200);
    push(&mut frames, "a", 4000, 10);
    let places: BTreeSet<i32> = presses(&frames).into_iter().map(|press| press % 8).collect();
    assert_eq!(places.len(), 8);
}

#[test]
fn never_is_more_kept_than_may_be() {
    let mut frames = of_most(1, 100);
    for run in 0..60 {
        // Presses of one frame, of many, and one that is longer than all that may be read.
        push(&mut frames, &format!("short {run}"), 40, 1);
        push(&mut frames, &format!("long {run}"), 1, 300);
        assert!(frames.len() <= 100);
        // The last part's way is as it was given, up to its end.
        assert!(frames.way.len() <= 100 + 7, "{}", frames.way.len());
    }
    assert!(frames.len() > 40);
    assert_eq!(frames.len() as u64 + frames.left_out(), 60 * (120 + 302));
}

#[test]
fn runs_of_which_nothing_is_read_are_gone_with_their_way() {
    let mut frames = of_most(1, 160);
    for run in 0..80 {
        push(&mut frames, &format!("{run}"), 1, 8);
    }
    assert!((5..=20).contains(&frames.runs.len()), "{:?}", frames.runs);
    let ends: Vec<usize> = frames.runs.iter().map(|(_, end)| *end).collect();
    assert!(ends.windows(2).all(|two| two[0] < two[1]));
    assert_eq!(ends.last(), Some(&frames.len()));
    // The last run might go on.
    assert!(frames.way.iter().all(|point| point.before == frames.len()), "{:?}", frames.way);
}

#[test]
fn a_frame_that_is_read_is_as_it_was_given() {
    let (mut all, mut some) = (of_most(1, usize::MAX), of_most(1, 200));
    push(&mut all, "a", 300, 10);
    push(&mut some, "a", 300, 10);
    for (row, number) in some.rows().zip(some.numbers()) {
        let same = all.rows().nth(usize::try_from(number).unwrap()).unwrap();
        assert_eq!((row.press, row.t_ns, row.position_mm), (same.press, same.t_ns, same.position_mm));
    }
}

/// What the model predicts for the frames that are read.
fn predicted(frames: &Frames, effects: &[Effect]) -> Vec<f32> {
    let known = known();
    predict(&known, frames, &base(&known), effects).unwrap()
}

#[test]
fn a_covering_remembers_presses_that_are_not_read() {
    let rms = |one: &[f32], other: &[f32]| {
        let squares = one.iter().zip(other).map(|(one, other)| f64::from(one - other).powi(2));
        (squares.sum::<f64>() / one.len() as f64).sqrt()
    };
    let neutral = |name| Effect::neutral(Definition::find(name).unwrap());
    let effects = [
        neutral("imprint").with("set_share", 0.3).unwrap(),
        neutral("relaxation").with("relaxed_share", 0.3).unwrap().with("time_constant_s", 20.0).unwrap(),
        neutral("softening").with("softened_share", 0.3).unwrap(),
        neutral("backlash").with("play_x_mm", 0.3).unwrap().with("play_y_mm", 0.3).unwrap(),
    ];
    for effect in effects {
        let name = effect.name();
        let all = measured(&known(), &[], &vec![vec![0.0; ELEMENTS]; 30 * ELEMENTS]);
        let mut part = of_most(ELEMENTS, 400);
        all.rows().for_each(|row| part.push(row));
        assert!(part.left_out() > 900);
        let effects = [effect];
        let of_all = predicted(&all, &effects);
        let number = |number: u64| usize::try_from(number).unwrap() * ELEMENTS;
        let wanted: Vec<f32> =
            part.numbers().flat_map(|one| of_all[number(one)..number(one) + ELEMENTS].to_vec()).collect();
        let off = rms(&predicted(&part, &effects), &wanted);
        part.way.clear();
        let off_without = rms(&predicted(&part, &effects), &wanted);
        let of_effect = rms(&wanted, &predicted(&part, &[]));
        println!("{name}: {of_effect} {off} {off_without}");
        assert!(off < 0.05 * of_effect, "{name}: off by {off} of {of_effect} counts");
        assert!(off < 0.2 * off_without, "{name}: without the way off by {off_without} counts");
    }
}
