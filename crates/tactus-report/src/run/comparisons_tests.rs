use super::*;
use crate::run::DwellSummary;

/// A press whose element 1 reads `rises` at `depths_mm`, a second each.
fn press(at_mm: [f64; 2], way: PressWay, depths_mm: &[f64], rises: &[f32]) -> PressSummary {
    let dwell = |(nth, (depth_mm, rise)): (usize, (&f64, &f32))| DwellSummary {
        at_s: nth as f64,
        depth_mm: *depth_mm,
        covering_mm: 1.0,
        frames: 8,
        rise_counts: vec![0.1 * rise, *rise],
    };
    let dwells = depths_mm.iter().zip(rises).enumerate().map(dwell).collect();
    PressSummary { index: 0, at_mm, element: None, way, dwells }
}

fn plain(depths_mm: &[f64], rises: &[f32]) -> PressSummary {
    press([1.0, 2.0], PressWay::default(), depths_mm, rises)
}

#[test]
fn a_held_depth_shows_its_change() {
    let held = plain(&[0.5; 5], &[100.0, 98.0, 97.0, 96.5, 96.0]);
    let found = Comparisons::of(&[held], &[]);
    assert_eq!(found.holds[0].element, 1, "the element that reads most");
    for (point, want) in [(0, [0.0, 100.0]), (4, [4.0, 96.0])] {
        assert_eq!(found.holds[0].points[point].map(f64::to_bits), want.map(f64::to_bits));
    }
    assert!(found.ladders.is_empty() && found.repeats.is_empty() && found.maps.is_empty());
}

#[test]
fn depths_up_and_down_show_their_loop() {
    let ladder = plain(&[0.2, 0.4, 0.6, 0.4, 0.2], &[20.0, 40.0, 60.0, 37.0, 18.0]);
    let found = Comparisons::of(&[ladder, plain(&[0.2, 0.4, 0.6], &[20.0, 40.0, 60.0])], &[]);
    assert_eq!(found.ladders.len(), 1);
    assert_eq!(found.ladders[0].widths, [[0.2, 2.0], [0.4, 3.0]]);
}

#[test]
fn speeds_and_directions_are_no_repeats() {
    let at = |speed| PressWay { speed_mm_per_s: Some(speed), from_mm: None };
    let from = |x_mm| PressWay { speed_mm_per_s: None, from_mm: Some([x_mm, 0.0]) };
    let mut presses: Vec<PressSummary> = (0_u8..5).map(|_| plain(&[0.5], &[50.0])).collect();
    presses.extend(
        [(0.1, 49.0), (1.0, 55.0)].map(|(speed, rise)| press([1.0, 2.0], at(speed), &[0.5], &[rise])),
    );
    presses.extend(
        [(-1.0, 50.0), (1.0, 52.0)].map(|(x_mm, rise)| press([1.0, 2.0], from(x_mm), &[0.5], &[rise])),
    );
    let found = Comparisons::of(&presses, &[]);
    assert_eq!(found.repeats[0].points.len(), 5);
    assert_eq!(found.speeds[0].points, [[0.1, 49.0], [1.0, 55.0]]);
    assert_eq!(found.directions[0].ways, [([-1.0, 0.0], 50.0, 1), ([1.0, 0.0], 52.0, 1)]);
}

#[test]
fn places_on_a_grid_make_a_map() {
    let places = (0_u8..3).flat_map(|y| (0_u8..4).map(move |x| [x, y]));
    let at = |[x, y]: [u8; 2]| {
        let at_mm = [x, y].map(|place| 0.1 * f64::from(place));
        press(at_mm, PressWay::default(), &[0.5], &[f32::from(10 * y + x)])
    };
    let presses: Vec<PressSummary> = places.map(at).collect();
    let maps = Comparisons::of(&presses, &[]).maps;
    assert_eq!((maps.len(), maps[0].x_mm.len(), maps[0].y_mm.len()), (1, 4, 3));
    assert_eq!(maps[0].rise_counts, [0.0, 1.0, 2.0, 3.0, 10.0, 11.0, 12.0, 13.0, 20.0, 21.0, 22.0, 23.0]);
    // Presses at element centres are not a map of places.
    let centres: Vec<PressSummary> = presses
        .into_iter()
        .enumerate()
        .map(|(element, press)| PressSummary { element: Some(element), ..press })
        .collect();
    assert!(Comparisons::of(&centres, &[]).maps.is_empty());
}

#[test]
fn a_long_rest_shows_its_drift() {
    let frames = |seconds: u32| {
        (0..4 * seconds).map(|nth| [0.25 * f64::from(nth), 100.0 + f64::from(nth / 4)]).collect::<Vec<_>>()
    };
    let rest = Comparisons::of(&[], &frames(30)).rest;
    assert_eq!((rest.len(), rest[0][1], rest[29][1]), (30, 0.0, 29.0));
    assert!(Comparisons::of(&[], &frames(10)).rest.is_empty());
}
