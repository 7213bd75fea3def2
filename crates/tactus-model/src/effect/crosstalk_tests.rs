use crate::effect::bench::{effect, model};
use crate::effect::{BaseModel, Make};

const NAMES: [&str; 5] =
    ["neighbour_share", "diagonal_share", "row_neighbour_share", "row_share", "column_share"];

fn crossed(shares: [f64; 5], signal: &[f64]) -> Vec<f64> {
    let effect = effect("crosstalk", std::array::from_fn::<_, 5, _>(|k| (NAMES[k], shares[k])));
    let Make::Element(make) = effect.definition().make else { panic!("an effect of the elements") };
    let (model, mut out) = (model(), signal.to_vec());
    let base = BaseModel { model: &model, covering: crate::effect::bench::THIN };
    make(effect.values()).signal(base, signal, &mut out);
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
