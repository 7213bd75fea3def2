use super::*;

fn frame(seq: u64, counts: &[f32]) -> pb::Frame {
    pb::Frame { seq, t_wall_ns: i64::try_from(seq).unwrap(), counts: counts.to_vec(), ..Default::default() }
}

fn of(seqs: impl IntoIterator<Item = u64>) -> History {
    let mut history = History::default();
    for seq in seqs {
        history.push(&frame(seq, &[seq as f32, 1.0]), None);
    }
    history
}

#[test]
fn it_keeps_the_last_minutes_and_no_more() {
    let history = of(0..20_000);
    assert_eq!(history.moments.len(), FRAMES_MAX);
    assert_eq!(history.moments.back().unwrap().seq, 19_999);
    let mut large = History::default();
    for seq in 0..40 {
        large.push(&frame(seq, &vec![0.0; 200_000]), None);
    }
    assert!(large.bytes().len() <= BYTES_MAX + 8, "{}", large.bytes().len());
    let mut huge = History::default();
    huge.push(&frame(0, &vec![0.0; 5 << 20]), None);
    assert_eq!(huge.moments.len(), 1, "the last frame is kept in any case");
}

#[test]
fn another_array_or_a_new_start_begins_anew() {
    let mut history = of(10..20);
    assert_eq!(history.push(&frame(3, &[0.0, 0.0]), None), Order::Again);
    assert_eq!(history.moments.len(), 10);
    let restarted = pb::Frame { t_wall_ns: 100, ..frame(3, &[0.0, 0.0]) };
    assert_eq!(history.push(&restarted, None), Order::Restarted);
    assert_eq!(history.moments.len(), 1);
    history.push(&frame(4, &[0.0; 5]), None);
    assert_eq!(history.moments.len(), 1);
}

#[test]
fn a_mean_is_over_frames_without_a_gap() {
    assert_eq!(of(0..4).mean(3), Some(vec![2.0, 1.0]));
    assert_eq!(of(0..2).mean(3), None);
    assert_eq!(of([0, 1, 3]).mean(3), None);
    assert_eq!(of([0, 2, 3, 4]).mean(3), Some(vec![3.0, 1.0]));
    assert_eq!(of(0..4).mean(0), None);
}

#[test]
fn the_lowest_place_of_the_tip_is_known_if_each_is() {
    let at = |z_mm| pb::StageState { z_mm, ..Default::default() };
    let mut history = of(0..2);
    assert_eq!(history.lowest_z_mm(1), None, "it is not known where the tip was");
    for (seq, z_mm) in [(2, -0.5), (3, 2.0), (4, 1.5)] {
        history.push(&frame(seq, &[0.0, 0.0]), Some(&at(z_mm)));
    }
    assert_eq!(history.lowest_z_mm(2), Some(1.5));
    assert_eq!(history.lowest_z_mm(3), Some(-0.5));
    assert_eq!(history.lowest_z_mm(4), None);
    assert_eq!(history.lowest_z_mm(9), None);
    assert_eq!(history.lowest_z_mm(0), None);
}

#[test]
fn the_page_gets_numbers_in_a_fixed_order() {
    let mut history = History::default();
    let stage = pb::StageState { x_mm: 1.0, y_mm: 2.0, z_mm: -0.5, ..Default::default() };
    let frame = pb::Frame { t_mono_ns: 2_500_000_000, lost_before: 3, ..frame(7, &[11.0, 12.0]) };
    history.push(&frame, Some(&stage));
    let bytes = history.bytes();
    assert_eq!(bytes.len(), 8 + HEAD_BYTES + 8);
    assert_eq!(bytes[..8], [2, 0, 0, 0, 1, 0, 0, 0]);
    assert_eq!(bytes[8..24], [7.0_f64.to_le_bytes(), 2.5_f64.to_le_bytes()].concat());
    let floats: Vec<_> =
        bytes[24..].chunks_exact(4).map(|four| f32::from_le_bytes(four.try_into().unwrap())).collect();
    assert_eq!(floats, [1.0, 2.0, -0.5, 3.0, 11.0, 12.0]);
}
