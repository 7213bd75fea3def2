use std::thread;

use super::*;

const PATIENCE: Duration = Duration::from_mins(1);

fn ends(message_max_bytes: usize) -> (FrameWriter, FrameReader) {
    let (reader, writer) = io::pipe().unwrap();
    (FrameWriter::new(writer.into()), FrameReader::new(reader.into(), message_max_bytes))
}

#[test]
fn a_message_comes_through_whole_in_pieces() {
    let (mut writer, mut reader) = ends(1 << 20);
    let text = "x".repeat(300_000);
    let frame = of(&text).unwrap();
    let writing = thread::spawn(move || {
        let mut left = frame.as_slice();
        while !left.is_empty() {
            left = writer.write_some(left, PATIENCE).unwrap();
        }
    });
    let message = loop {
        if let Some(message) = reader.read_some(PATIENCE).unwrap() {
            break message;
        }
    };
    writing.join().unwrap();
    assert_eq!(postcard::from_bytes::<String>(&message).unwrap(), text);
}

#[test]
fn a_reader_that_does_not_read_does_not_hold_the_writer() {
    let (mut writer, _reader) = ends(1 << 20);
    let frame = of(&"x".repeat(300_000)).unwrap();
    let mut left = frame.as_slice();
    loop {
        let rest = writer.write_some(left, Duration::ZERO).unwrap();
        if rest.len() == left.len() {
            break;
        }
        left = rest;
    }
    assert!(!left.is_empty() && left.len() < frame.len());
}

#[test]
fn a_closed_pipe_and_a_frame_that_is_too_long_are_errors() {
    let (mut writer, mut reader) = ends(100);
    assert!(!reader.is_closed());
    writer.write_all(&of(&"x".repeat(200)).unwrap()).unwrap();
    assert_eq!(reader.read_some(PATIENCE).unwrap_err().kind(), ErrorKind::InvalidData);

    let (writer, mut reader) = ends(100);
    drop(writer);
    assert!(reader.is_closed());
    assert_eq!(reader.read_some(PATIENCE).unwrap_err().kind(), ErrorKind::UnexpectedEof);

    let (mut writer, reader) = ends(100);
    drop(reader);
    assert_eq!(writer.write_some(b"x", PATIENCE).unwrap_err().kind(), ErrorKind::BrokenPipe);
}
