use ratatui::Terminal;
use ratatui::backend::TestBackend;
use tactus_schema::pb::run_event::Event;

use super::*;

fn drawn_at(screen: &Screen, width: u16, height: u16) -> String {
    let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
    terminal.draw(|frame| screen.draw(frame)).unwrap();
    terminal.backend().to_string()
}

fn drawn(screen: &Screen) -> String {
    drawn_at(screen, 80, 24)
}

/// The image, without what stands below it.
fn image(screen: &Screen) -> String {
    drawn(screen).lines().take(9).collect::<Vec<_>>().join("\n")
}

fn frame(seq: u64, counts: Vec<f32>) -> pb::Frame {
    let t_ns = i64::try_from(seq).unwrap() * 33_000_000;
    pb::Frame { seq, t_mono_ns: t_ns, t_wall_ns: t_ns, counts, simulated: true, ..Default::default() }
}

fn description() -> pb::RigDescription {
    pb::RigDescription {
        baseline_counts: vec![100.0; 48],
        x_mm: vec![0.0, 20.0],
        y_mm: vec![0.0, 15.0],
        z_max_mm: 25.0,
        depth_max_mm: 1.524,
        covering_mm: 2.54,
        safe_height_mm: 2.0,
        indenter_shape: "cylinder".into(),
        indenter_width_mm: 1.0,
        ..Default::default()
    }
}

fn screen() -> Screen {
    let mut screen = Screen::new("sim");
    screen.on_info(&pb::SensorInfo { rows: 6, cols: 8, ..Default::default() });
    screen.on_description(description());
    screen.on_frame(frame(1, vec![100.0; 48]));
    screen
}

#[test]
fn the_view_says_that_it_is_simulated_and_what_was_lost() {
    let mut screen = screen();
    screen.on_frame(pb::Frame { lost_before: 3, ..frame(5, vec![100.0; 48]) });
    let text = drawn(&screen);
    assert!(text.contains("rig sim  SIMULATED"), "{text}");
    assert!(text.contains("3 lost at the device"), "{text}");
    assert!(text.contains("132 to 132 ms"), "{text}");
}

#[test]
fn the_view_says_what_was_not_read() {
    let mut screen = screen();
    assert!(!drawn(&screen).contains("not read"));
    screen.on_frame(pb::Frame { bad_elements: vec![3, 9], ..frame(2, vec![100.0; 48]) });
    assert!(drawn(&screen).contains("2 elements not read"));
}

#[test]
fn row_zero_stands_at_the_bottom_and_column_zero_at_the_left() {
    let mut screen = screen();
    let mut counts = vec![100.0; 48];
    counts[0] = 599.0;
    screen.on_frame(frame(2, counts));
    let text = drawn(&screen);
    let line = text.lines().position(|line| line.contains("499")).unwrap();
    // Headline, border, five rows of one line each.
    assert_eq!(line, 7, "{text}");
    assert!(text.lines().nth(line).unwrap().find("499").unwrap() < 10, "{text}");
}

#[test]
fn taring_makes_the_present_frame_the_zero_of_this_view_until_the_next_time() {
    let mut screen = screen();
    screen.on_frame(frame(2, vec![350.0; 48]));
    assert!(image(&screen).contains("250"));
    screen.on_key(Key::Zero);
    assert!(!image(&screen).contains("250"));
    screen.on_key(Key::Zero);
    assert!(image(&screen).contains("250"));
}

#[test]
fn a_view_that_is_opened_in_mid_press_shows_the_rise_above_the_runs_zero() {
    let mut screen = screen();
    let reference = pb::ReferenceDone { mean_counts: vec![110.0; 48], ..Default::default() };
    screen.on_event(&pb::RunEvent { event: Some(Event::ReferenceDone(reference)), ..Default::default() });
    screen.on_frame(frame(2, vec![733.0; 48]));
    assert!(drawn(&screen).contains("623"), "{}", drawn(&screen));
}

#[test]
fn counts_are_shown_as_such_while_no_zero_is_known() {
    let mut screen = Screen::new("sim");
    screen.on_info(&pb::SensorInfo { rows: 6, cols: 8, ..Default::default() });
    screen.on_frame(frame(1, vec![100.0; 48]));
    let text = drawn(&screen);
    assert!(text.contains("no zero is known") && text.contains("100"), "{text}");
}

#[test]
fn the_stage_is_shown_with_its_limits_and_its_depth() {
    let mut screen = screen();
    let stage = pb::StageState { x_mm: 7.25, y_mm: 16.0, z_mm: -0.4, ..Default::default() };
    screen.stage = Some(stage);
    let text = drawn(&screen);
    for shown in
        ["x   7.250 0..20", "y  16.000 0..15", "z  -0.400 to 25", "depth 0.400/1.524", "covering 2.54"]
    {
        assert!(text.contains(shown), "{shown} in\n{text}");
    }
    let large = drawn_at(&screen, 120, 40);
    for shown in ["surface", "limit", "sensor", "◉"] {
        assert!(large.contains(shown), "{shown} in\n{large}");
    }
}

#[test]
fn traces_are_of_the_most_pressed_elements_or_of_chosen_ones() {
    let mut screen = screen();
    let mut counts = vec![100.0; 48];
    (counts[9], counts[10]) = (400.0, 300.0);
    screen.on_frame(frame(2, counts));
    let text = drawn(&screen);
    assert!(text.contains("● 9: 300") && text.contains("● 10: 200"), "{text}");
    for key in [Key::Move([1, 0]), Key::Move([0, 1]), Key::Move([0, 1]), Key::Choose, Key::Longer] {
        screen.on_key(key);
    }
    let text = drawn(&screen);
    assert!(text.contains("● 17: 0") && !text.contains("● 9:") && text.contains("30 s"), "{text}");
    screen.on_key(Key::Choose);
    assert!(drawn(&screen).contains("● 9: 300"));
}

#[test]
fn the_cursor_stays_on_the_array() {
    let mut screen = screen();
    for key in [Key::Move([-1, -1]), Key::Choose, Key::Move([20, 20]), Key::Choose] {
        screen.on_key(key);
    }
    let text = drawn(&screen);
    assert!(text.contains("● 0:") && text.contains("● 47:"), "{text}");
}

#[test]
fn the_log_has_time_run_and_whole_texts() {
    let mut screen = screen();
    let event = |seq, text: &str| pb::RunEvent {
        seq,
        run_id: "20260101-000001-corners".into(),
        t_wall_ns: 3_723_000_000_000,
        event: Some(Event::Log(pb::Log { message: text.into() })),
        ..Default::default()
    };
    screen.on_event(&event(1, "the first"));
    let long = "a long line ".repeat(5) + "with its end";
    screen.on_event(&event(2, &long));
    let text = drawn(&screen);
    assert!(text.contains("01:02:03 20260101-000001-corners run: a long"), "{text}");
    assert!(text.contains("with its end"), "{text}");
    screen.on_key(Key::Earlier);
    assert!(!drawn(&screen).contains("with its end"));
    assert!(drawn(&screen).contains("run: the first"));
}

#[test]
fn what_has_no_room_is_named() {
    let screen = screen();
    for (width, height) in [(80, 24), (120, 40), (200, 60)] {
        let text = drawn_at(&screen, width, height);
        assert!(!text.contains("no room"), "{text}");
        assert!(
            text.contains("log, UTC") && text.contains("rise above zero") && text.contains("stage, mm"),
            "{text}"
        );
    }
    assert!(drawn_at(&screen, 80, 20).contains("no room for log: 80x24 has all"));
    assert!(drawn_at(&screen, 60, 12).contains("no room for traces, log"), "{}", drawn_at(&screen, 60, 12));
    let tiny = drawn_at(&screen, 70, 9);
    assert!(tiny.contains("no room for image (26x8), stage, traces: "), "{tiny}");
    for (width, height) in [(11, 4), (1, 1), (300, 2), (2, 300)] {
        drawn_at(&screen, width, height);
    }
}

#[test]
fn the_image_uses_the_room_that_there_is() {
    let mut screen = screen();
    screen.on_frame(frame(2, vec![342.0; 48]));
    assert_eq!(image(&screen).lines().filter(|line| line.contains("242")).count(), 6);
    // Numbers of elements have their own lines.
    assert!(drawn_at(&screen, 120, 40).contains("47"));
    assert!(drawn_at(&screen, 200, 60).contains("47"));
}
