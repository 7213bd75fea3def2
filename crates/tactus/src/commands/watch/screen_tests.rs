use ratatui::Terminal;
use ratatui::backend::TestBackend;

use super::*;

fn drawn(screen: &Screen) -> String {
    let mut terminal = Terminal::new(TestBackend::new(80, 26)).unwrap();
    terminal.draw(|frame| screen.draw(frame)).unwrap();
    terminal.backend().to_string()
}

fn screen() -> Screen {
    let mut screen = Screen::new("sim");
    screen.on_info(&pb::SensorInfo { rows: 6, cols: 8, ..Default::default() });
    screen.on_frame(pb::Frame { counts: vec![100.0; 48], simulated: true, ..Default::default() });
    screen
}

#[test]
fn the_view_says_that_it_is_simulated_and_what_was_lost() {
    let mut screen = screen();
    screen.on_frame(pb::Frame {
        counts: vec![100.0; 48],
        simulated: true,
        lost_before: 3,
        ..Default::default()
    });
    let text = drawn(&screen);
    assert!(text.contains("rig sim  SIMULATED"), "{text}");
    assert!(text.contains("3 lost at the device"), "{text}");
}

#[test]
fn the_view_says_what_was_not_read() {
    let mut screen = screen();
    assert!(!drawn(&screen).contains("not read"));
    screen.on_frame(pb::Frame { counts: vec![100.0; 48], bad_elements: vec![3, 9], ..Default::default() });
    assert!(drawn(&screen).contains("2 elements not read"));
}

#[test]
fn row_zero_stands_at_the_bottom_and_column_zero_at_the_left() {
    let mut screen = screen();
    let mut counts = vec![100.0; 48];
    counts[0] = 599.0;
    screen.on_frame(pb::Frame { counts, ..Default::default() });
    let text = drawn(&screen);
    let line = text.lines().position(|line| line.contains("499")).unwrap();
    // Headline, border, five rows of two lines each.
    assert_eq!(line, 12, "{text}");
    assert!(text.lines().nth(line).unwrap().find("499").unwrap() < 10, "{text}");
}

#[test]
fn taring_makes_the_present_frame_the_zero() {
    let mut screen = screen();
    screen.on_frame(pb::Frame { counts: vec![350.0; 48], ..Default::default() });
    assert!(drawn(&screen).contains("250"));
    screen.tare();
    assert!(!drawn(&screen).contains("250"));
}

#[test]
fn a_terminal_that_is_too_small_is_no_error() {
    let mut terminal = Terminal::new(TestBackend::new(11, 4)).unwrap();
    terminal.draw(|frame| screen().draw(frame)).unwrap();
}
