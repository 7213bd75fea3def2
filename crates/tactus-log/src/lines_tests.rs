use std::sync::mpsc::{Receiver, Sender, channel};

use super::*;

/// An output that takes a line only when it is given leave.
struct Gated {
    leave: Receiver<()>,
    taken: Sender<String>,
}

impl Write for Gated {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.leave.recv().map_err(|_| ErrorKind::BrokenPipe)?;
        self.taken.send(String::from_utf8(bytes.to_vec()).unwrap()).map_err(|_| ErrorKind::BrokenPipe)?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Lines, the leave for each to be taken, and those that were.
fn gated(format: LogFormat) -> (Lines, Sender<()>, Receiver<String>) {
    let ((open, leave), (taken, lines)) = (channel(), channel());
    let told = Arc::new(Mutex::new(None::<Lines>));
    let teller = Arc::clone(&told);
    let queue = Lines::start(Gated { leave, taken }, format, move |dropped| {
        let queue = teller.lock().unwrap().clone().unwrap();
        queue.make_writer().write_all(format!("{dropped} dropped\n").as_bytes()).unwrap();
    })
    .unwrap();
    *told.lock().unwrap() = Some(queue.clone());
    (queue, open, lines)
}

fn log(queue: &Lines, line: &str) {
    queue.make_writer().write_all(line.as_bytes()).unwrap();
}

#[test]
fn lines_that_nobody_reads_are_dropped_and_their_number_stands_in_their_place() {
    let (queue, open, lines) = gated(LogFormat::Text);
    let line = format!("{}\n", "x".repeat(999));
    // Nobody reads, and yet every line returns.
    let logged = 10_000;
    for _ in 0..logged {
        log(&queue, &line);
    }
    assert!(!queue.flush(Duration::ZERO), "the first line still waits");
    let kept = QUEUE_MAX_BYTES / (line.len() + ENTRY_BYTES);
    for _ in 0..kept {
        open.send(()).unwrap();
        assert_eq!(lines.recv().unwrap(), line);
    }
    log(&queue, "later\n");
    for _ in 0..2 {
        open.send(()).unwrap();
    }
    assert_eq!(lines.recv().unwrap(), format!("{} dropped\n", logged - kept));
    assert_eq!(lines.recv().unwrap(), "later\n");
    assert!(queue.flush(Duration::from_mins(1)));
}

#[test]
fn a_line_has_a_greatest_length() {
    for format in [LogFormat::Text, LogFormat::Json] {
        let (queue, open, lines) = gated(format);
        // A character of two bytes lies across the limit.
        log(&queue, &format!("x{}\n", "\u{e4}".repeat(30_000)));
        open.send(()).unwrap();
        let line = lines.recv().unwrap();
        assert!(line.len() < LINE_MAX_BYTES + 64 && line.ends_with('\n'), "{} bytes", line.len());
        let kept = match format {
            LogFormat::Text => line.strip_suffix(" ... (a line of 60002 bytes)\n").unwrap().to_owned(),
            LogFormat::Json => {
                let line: serde_json::Value = serde_json::from_str(&line).unwrap();
                assert_eq!(line["bytes"], 60_002);
                line["cut"].as_str().unwrap().to_owned()
            }
        };
        assert_eq!(kept, format!("x{}", "\u{e4}".repeat(LINE_MAX_BYTES / 2 - 1)));
    }
}

#[test]
fn an_output_that_is_gone_loses_lines_and_nothing_else() {
    let (queue, open, lines) = gated(LogFormat::Text);
    drop((open, lines));
    log(&queue, "nobody is there\n");
    assert!(queue.flush(Duration::from_mins(1)));
}

/// Takes one byte at a time, and every other time nothing.
struct Reluctant(Sender<u8>, bool);

impl Write for Reluctant {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.1 = !self.1;
        if self.1 {
            return Err(ErrorKind::WouldBlock.into());
        }
        self.0.send(bytes[0]).map_err(|_| ErrorKind::BrokenPipe)?;
        Ok(1)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn an_output_that_must_not_be_waited_for_gets_its_line_all_the_same() {
    let (bytes, taken) = channel();
    let queue = Lines::start(Reluctant(bytes, false), LogFormat::Text, drop).unwrap();
    log(&queue, "abc\n");
    assert!(queue.flush(Duration::from_mins(1)));
    assert_eq!(taken.try_iter().collect::<Vec<_>>(), b"abc\n");
}
