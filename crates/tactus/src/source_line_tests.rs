use super::with_source_line;

const SOURCE: &str = "def run(rig):\n    tare()\n    pres(1.0)\n";

#[test]
fn the_line_stands_below_the_message_with_a_caret() {
    for (place, caret) in [("touch.star:3", 4), ("touch.star:3:9", 8)] {
        let message = format!("{place}: unknown name");
        let shown = with_source_line(&message, "touch", SOURCE);
        assert_eq!(shown, format!("{message}\n  3 |     pres(1.0)\n    | {}^", " ".repeat(caret)));
    }
}

#[test]
fn a_message_without_a_line_of_the_script_stays_as_it_is() {
    for message in [
        "no rig",
        "other.star:3: wrong",
        "touch.star:",
        "touch.star:0: x",
        "touch.star:99: x",
        "touch.star:9999999999999999999999: x",
    ] {
        assert_eq!(with_source_line(message, "touch", SOURCE), message);
    }
}
