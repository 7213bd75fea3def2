use super::*;

#[test]
fn digitacts_has_the_geometry_of_figure_1() {
    let array = Array::digitacts();
    assert_eq!((array.rows(), array.cols(), array.elements()), (6, 8, 48));
    let [[x0, x1], [y0, y1]] = array.extent_mm();
    for (got, want) in [(x0, 0.0), (x1, 16.2), (y0, 0.0), (y1, 11.8)] {
        assert!((got - want).abs() < 1e-12, "{got} {want}");
    }
    let sensed = 48.0 * 1.8 * 1.8 / ((x1 - x0) * (y1 - y0));
    assert!((sensed - 0.81).abs() < 0.005, "the paper says 81 %, got {sensed}");
}

#[test]
fn index_runs_along_rows_first() {
    let array = Array::digitacts();
    assert_eq!(array.centre_mm(0), Some([0.9, 0.9]));
    assert_eq!(array.centre_mm(1), Some([2.9, 0.9]));
    assert_eq!(array.centre_mm(8), Some([0.9, 2.9]));
    assert_eq!(array.centre_mm(48), None);
}

#[test]
fn overlapping_and_non_finite_descriptions_are_refused_with_the_field() {
    let describe =
        |cols: Vec<f64>, rate_hz| Array::new("a", [1.8, 1.8], cols, vec![0.0], rate_hz, 4095.0, 1.0);
    assert_eq!(
        describe(vec![0.0, 2.0, 3.0], 30.0),
        Err(ArrayError::Overlap { field: "col_centres_mm", index: 2, element_mm: 1.8 })
    );
    assert!(matches!(describe(vec![0.0, f64::NAN], 30.0), Err(ArrayError::Overlap { index: 1, .. })));
    assert!(matches!(describe(vec![0.0], 0.0), Err(ArrayError::NotPositive { field: "rate_hz", .. })));
    assert_eq!(describe(vec![], 30.0), Err(ArrayError::Empty));
}

#[test]
fn the_shipped_arrays_have_the_papers_resolutions() {
    let wanted = [("digitacts", 6, 8, 25.0), ("fingertip", 14, 20, 70.0), ("tekscan-5027", 26, 36, 248.0)];
    for (array, (name, rows, cols, per_cm2)) in Array::shipped().into_iter().zip(wanted) {
        assert_eq!((array.name(), array.rows(), array.cols()), (name, rows, cols));
        let density = 100.0 / array.pitch_mm().powi(2);
        assert!((density / per_cm2 - 1.0).abs() < 1e-9, "{name}: {density} per cm2");
        let Array { name, element_mm, col_centres_mm, row_centres_mm, .. } = array.clone();
        assert_eq!(
            Array::new(name, element_mm, col_centres_mm, row_centres_mm, 30.0, 4095.0, 1.0),
            Ok(array)
        );
    }
}

#[test]
fn arrays_are_alike_if_one_does_not_say_its_least_reading() {
    let with = |least| Array::digitacts().with_least_counts(least).unwrap();
    assert!(with(-4095.0).is_like(&Array::digitacts()) && Array::digitacts().is_like(&with(-4095.0)));
    assert!(with(-4095.0).is_like(&with(-4095.0)));
    assert!(!with(-4095.0).is_like(&with(-100.0)));
    assert!(!Array::fingertip().is_like(&with(-4095.0)));
}
