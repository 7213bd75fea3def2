use super::StraightLine;

#[test]
fn it_is_the_line_of_least_squares() {
    // By hand: 1, 2, 6 have the mean 3 and the slope (6 - 1) / 2.
    let line = StraightLine::through([1.0, 2.0, 6.0].into_iter());
    for (place, wanted) in [0.5, 3.0, 5.5].into_iter().enumerate() {
        assert!((line.at(place) - wanted).abs() < 1e-12, "{}", line.at(place));
    }
    let level = StraightLine::through([7.0].into_iter());
    assert!((level.at(0) - 7.0).abs() < 1e-12);
}
