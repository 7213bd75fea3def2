use super::{Label, Sheet};
use crate::plot::{HeatMap, Image, Scale};

#[test]
fn panels_stand_where_they_are_put() {
    let mut sheet = Sheet::new("a < b", [100.0, 50.0]);
    sheet.put([10.0, 20.5], &Label::new("x & y").centred());
    let heat = HeatMap { values: &[0.0, 1.0], rows: 1, cols: 2 };
    sheet.put([0.0, 30.0], &Image { heat, cell_px: 4.0, scale: Scale::new(0.0, 1.0), title: "two".into() });
    let svg = sheet.to_string();
    assert!(svg.starts_with(r#"<svg xmlns="http://www.w3.org/2000/svg""#), "{svg}");
    assert!(svg.contains(r#"viewBox="-12 -12 124 74""#) && svg.contains("<title>a &lt; b</title>"), "{svg}");
    let label = r#"<g transform="translate(10.00 20.50)"><text class="name" text-anchor="middle">x &amp; y</text></g>"#;
    assert!(svg.contains(label), "{svg}");
    assert!(
        svg.contains(r#"<g transform="translate(0.00 30.00)"><g class="cells" transform="scale(4)">"#),
        "{svg}"
    );
}
