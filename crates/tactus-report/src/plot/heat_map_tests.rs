use super::{HeatMap, Mosaic, Tile};
use crate::plot::Scale;

#[test]
fn row_zero_is_at_the_bottom_and_equal_values_share_a_path() {
    let values = [0.0, 1.0, 0.0, f32::NAN, 0.0, 0.0];
    let heat = HeatMap { values: &values, rows: 3, cols: 2 };
    let tile = Tile { at_px: [5.0, 7.0], heat, title: "press <0>".into() };
    let mosaic = Mosaic {
        name: "images".into(),
        size_px: [20.0, 20.0],
        cell_px: 3.0,
        scale: Scale::new(0.0, 1.0),
        tiles: vec![tile],
        captions: vec![],
    };
    let svg = mosaic.to_string();
    assert!(
        svg.contains(r##"<path fill="#440154" d="M0 2h1v1h-1zM0 1h1v1h-1zM0 0h1v1h-1zM1 0h1v1h-1z"/>"##),
        "{svg}"
    );
    assert!(svg.contains(r##"<path fill="#fde725" d="M1 2h1v1h-1z"/>"##), "{svg}");
    assert!(
        svg.contains(r#"<g transform="translate(5 7) scale(3)"><title>press &lt;0&gt;</title>"#),
        "{svg}"
    );
}
