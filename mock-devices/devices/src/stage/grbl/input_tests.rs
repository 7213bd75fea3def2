use super::*;

fn pushed(bytes: &[u8]) -> (Input, Vec<RealTime>) {
    let mut input = Input::default();
    let commands = bytes.iter().filter_map(|byte| input.push(*byte)).collect();
    (input, commands)
}

fn text(line: &str) -> Line {
    Line::Text(line.to_owned())
}

#[test]
fn real_time_bytes_are_taken_out_of_the_middle_of_a_line() {
    use RealTime as R;
    let (mut input, commands) = pushed(b"g1 x?1! ~f6\x18\x85\x9000\n");
    assert_eq!(commands, [R::Report, R::Hold, R::Resume, R::Reset, R::CancelJog]);
    assert_eq!(input.take_line().unwrap(), text("G1X1F600"));
    assert_eq!(input.take_line(), None);
}

#[test]
fn comments_and_blanks_are_taken_out_and_both_ends_end_a_line() {
    let (mut input, _) = pushed(b"G0 (up) z 2 ; to safety\r\n$i\n");
    assert_eq!(input.take_line().unwrap(), text("G0Z2"));
    assert_eq!(input.take_line().unwrap(), text(""));
    assert_eq!(input.take_line().unwrap(), text("$I"));
}

#[test]
fn a_line_that_is_too_long_is_told_and_ends_alone() {
    let (mut input, _) = pushed(&[&[b'X'; 300][..], b"\nG0\n"].concat());
    assert_eq!(input.take_line(), Some(Line::Overflow));
    assert_eq!(input.take_line().unwrap(), text("G0"));
}

#[test]
fn what_is_sent_into_a_full_buffer_is_lost() {
    let (mut input, _) = pushed(&b"G0X1\n".repeat(40));
    assert!(input.free_bytes() < 5);
    let taken = std::iter::from_fn(|| input.take_line()).count();
    // 128 bytes hold 25 lines of 5; the rest of the 26th merges with what comes later.
    assert_eq!(taken, 25);
}
