use crate::Effect;
use crate::effect::bench::model;
use crate::effect::{BaseModel, Make, Now};

const NAMES: [&str; 5] =
    ["neighbour_share", "diagonal_share", "row_neighbour_share", "row_share", "column_share"];

fn crossed(shares: [f64; 5], signal: &[f64]) -> Vec<f64> {
    with(std::array::from_fn::<_, 5, _>(|k| (NAMES[k], shares[k])), signal)
}

/// With shares of some kinds, and none of the others.
fn kinds<const N: usize>(shares: [(&str, f64); N], signal: &[f64]) -> Vec<f64> {
    let none = NAMES.into_iter().filter(|name| shares.iter().all(|(given, _)| given != name));
    with(none.map(|name| (name, 0.0)).chain(shares).collect::<Vec<_>>(), signal)
}

fn with<'a>(parameters: impl IntoIterator<Item = (&'a str, f64)>, signal: &[f64]) -> Vec<f64> {
    let effect = Effect::new("crosstalk", parameters).expect("parameters");
    let Make::Element(make) = effect.definition().make else { panic!("an effect of the elements") };
    let (model, mut out) = (model(), signal.to_vec());
    let base = BaseModel { model: &model, covering: crate::effect::bench::THIN };
    let mut crosstalk = make(effect.values());
    let now = Now { t_s: 0.0, dt_s: 0.0, temperature_c: None, base, contact: None, signal_mm: &[] };
    crosstalk.signal(now, signal, &mut out);
    let response = model.response();
    let gains = || response.sensitivity_counts_per_mm.iter().zip(&response.baseline_counts);
    out.iter_mut().zip(gains()).for_each(|(u, (gain, baseline))| *u = baseline + gain * *u);
    crosstalk.counts(base, &mut out);
    out.iter_mut().zip(gains()).for_each(|(count, (gain, baseline))| *count = (*count - baseline) / gain);
    out
}

/// Six rows of eight, 1 at the element and 0 elsewhere.
fn spike(element: usize) -> Vec<f64> {
    (0..48).map(|index| f64::from(u8::from(index == element))).collect()
}

/// Elements that read something, with what.
fn read(values: &[f64]) -> Vec<(usize, f64)> {
    values.iter().copied().enumerate().filter(|(_, value)| *value != 0.0).collect()
}

#[test]
fn a_signal_shows_at_its_neighbours_and_not_around_the_edge() {
    assert_eq!(
        read(&crossed([0.1, 0.0, 0.0, 0.0, 0.0], &spike(18))),
        [(10, 0.1), (17, 0.1), (18, 1.0), (19, 0.1), (26, 0.1)]
    );
    assert_eq!(
        read(&crossed([0.1, 0.0, 0.0, 0.0, 0.0], &spike(8))),
        [(0, 0.1), (8, 1.0), (9, 0.1), (16, 0.1)]
    );
    assert_eq!(read(&crossed([0.1, 0.0, 0.0, 0.0, 0.0], &spike(47))), [(39, 0.1), (46, 0.1), (47, 1.0)]);
}

#[test]
fn a_signal_shows_across_corners_and_beside() {
    let corners = crossed([0.0, 0.1, 0.0, 0.0, 0.0], &spike(8));
    assert_eq!(read(&corners), [(1, 0.1), (8, 1.0), (17, 0.1)]);
    let beside = crossed([0.0, 0.0, 0.1, 0.0, 0.0], &spike(15));
    assert_eq!(read(&beside), [(14, 0.1), (15, 1.0)]);
}

#[test]
fn a_signal_shows_in_its_row_and_its_column() {
    let row = crossed([0.0, 0.0, 0.0, 0.25, 0.0], &spike(10));
    assert_eq!(read(&row).iter().map(|(at, _)| *at).collect::<Vec<_>>(), (8..16).collect::<Vec<_>>());
    assert_eq!((row[8], row[10]), (0.25, 1.0));
    let column = crossed([0.0, 0.0, 0.0, 0.0, -0.25], &spike(10));
    assert_eq!(read(&column), [(2, -0.25), (10, 1.0), (18, -0.25), (26, -0.25), (34, -0.25), (42, -0.25)]);
}

#[test]
fn a_signal_shows_two_away() {
    let second = kinds([("second_share", 0.1)], &spike(18));
    assert_eq!(read(&second), [(2, 0.1), (16, 0.1), (18, 1.0), (20, 0.1), (34, 0.1)]);
    let ring = kinds([("ring_share", 0.1)], &spike(0));
    assert_eq!(read(&ring), [(0, 1.0), (10, 0.1), (17, 0.1), (18, 0.1)]);
}

#[test]
fn a_signal_shows_in_the_element_that_is_read_next_and_not_in_the_one_before() {
    let carried = kinds([("row_neighbour_share", 0.1), ("row_lean_share", 0.1)], &spike(10));
    assert_eq!(read(&carried), [(10, 1.0), (11, 0.2)]);
    let down = kinds([("column_lean_share", 0.1)], &spike(10));
    assert_eq!(read(&down), [(2, -0.1), (10, 1.0), (18, 0.1)]);
}
