use super::*;

#[test]
fn every_element_has_its_colour_where_it_stands() {
    let array = Array::digitacts();
    let values: Vec<f64> = (0..48).map(f64::from).collect();
    let scale = Scale::new(0.0, 47.0);
    let file = png(&array, &values, scale, 344).unwrap();
    let mut reader = png::Decoder::new(std::io::Cursor::new(file)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    // 17.2 x 12.8 mm with its margins, at 20 pixels a mm.
    assert_eq!((info.width, info.height), (344, 256));
    let at = |x_mm: f64, y_mm: f64| {
        let [column, row] = [20.0 * (x_mm + 0.5), 20.0 * (11.8 + 0.5 - y_mm)].map(whole);
        let first = 3 * (row * info.width + column) as usize;
        [pixels[first], pixels[first + 1], pixels[first + 2]]
    };
    for element in [0, 7, 21, 47] {
        let [x, y] = array.centre_mm(element).unwrap();
        let level = scale.level(values[element]).unwrap();
        assert_eq!(at(x, y), rgb(level), "element {element}");
    }
    assert_eq!(at(1.9, 0.9), GROUND, "between elements 0 and 1");
}
