use super::Figure;
use crate::plot::{Axis, Ink, Series};

fn figure() -> Figure {
    let x = Axis::new("x", "mm").spanning([0.0, 10.0]);
    let y = Axis::new("y", "counts").spanning([0.0, 100.0]);
    Figure::new("<b>", x, y).size_px([196.0, 156.0])
}

#[test]
fn points_stand_where_the_axes_say() {
    // Axes from (78, 12) to (178, 112): 10 px a mm, 1 px a count.
    let svg = figure().with(Series::line(vec![[0.0, 0.0], [5.0, 100.0], [10.0, 50.0]])).to_string();
    assert!(svg.contains(r#"d="M78.0 112.0L128.0 12.0L178.0 62.0""#), "{svg}");
    let svg = figure().with(Series::stems(vec![[5.0, 20.0]])).to_string();
    assert!(svg.contains(r#"d="M128.0 112V92.0""#), "{svg}");
}

#[test]
fn a_line_breaks_where_there_is_no_number() {
    let svg = figure().with(Series::line(vec![[0.0, 0.0], [5.0, f64::NAN], [10.0, 50.0]])).to_string();
    assert!(svg.contains(r#"d="M78.0 112.0M178.0 62.0""#), "{svg}");
    assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
}

#[test]
fn text_is_escaped() {
    let svg = figure().with(Series::dots(vec![]).ink(Ink::Red).label("a < b")).to_string();
    assert!(svg.contains("<title>&lt;b&gt;</title>") && svg.contains(">a &lt; b</text>"), "{svg}");
}
