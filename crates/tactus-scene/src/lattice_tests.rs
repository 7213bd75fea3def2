use super::*;

#[test]
fn all_of_what_an_element_collects_comes_from_some_cell() {
    for cell_mm in [0.05, 0.17, 0.4] {
        let lattice = Lattice::new(&Array::digitacts(), 2.7, cell_mm).unwrap();
        for axis in &lattice.axes {
            for (_, shares_mm) in axis.shares_mm(0, axis.cells) {
                let side_mm: f32 = shares_mm.iter().sum();
                assert!((side_mm - 1.8).abs() < 1e-5, "{side_mm}");
            }
        }
    }
}

#[test]
fn a_window_takes_the_shares_of_its_own_cells() {
    let lattice = Lattice::new(&Array::digitacts(), 0.4, 0.1).unwrap();
    let [x, _] = &lattice.axes;
    let (reach, all) = x.shares_mm(0, x.cells).nth(3).unwrap();
    let (first, cells) = (reach.start + 4, 9);
    let (within, shares_mm) = x.shares_mm(first, cells).nth(3).unwrap();
    assert_eq!((within, shares_mm), (0..cells, &all[4..4 + cells]));
    let (beside, shares_mm) = x.shares_mm(reach.end + 2, cells).nth(3).unwrap();
    assert!(beside.is_empty() && shares_mm.is_empty());
}

#[test]
fn cells_that_are_no_size_or_too_many_are_refused() {
    for cell_mm in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-9] {
        assert!(
            matches!(Lattice::new(&Array::digitacts(), 2.7, cell_mm), Err(RenderError::Cell { .. })),
            "{cell_mm}"
        );
    }
}
