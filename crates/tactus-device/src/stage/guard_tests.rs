use std::sync::mpsc::{Receiver, Sender, channel};

use super::*;

/// A guard that has not written by then never does.
const LONGEST: Duration = Duration::from_mins(1);

/// A device that hands on what is written to it.
pub(in crate::stage) struct Device(pub(in crate::stage) Sender<Vec<u8>>);

impl Write for Device {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.send(bytes.to_vec()).map_err(io::Error::other)?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fn device() -> (Option<Box<dyn Write + Send>>, Receiver<Vec<u8>>) {
    let (sender, written) = channel();
    (Some(Box::new(Device(sender))), written)
}

#[test]
fn a_driver_that_gives_no_sign_of_life_in_a_command_is_stopped_for() {
    let (writer, written) = device();
    let mut guard = Guard::new(Clock::real());
    guard.open(writer);
    guard.ready(true).unwrap();
    guard.begin(b"!".to_vec());
    assert_eq!(written.recv_timeout(LONGEST).unwrap(), b"!");
    // The driver is told once the stop is written, and so before it is written again.
    assert_eq!(written.recv_timeout(LONGEST).unwrap(), b"!");
    assert!(guard.has_fired());
}

#[test]
fn a_device_without_a_second_way_to_it_is_not_guarded() {
    let mut guard = Guard::new(Clock::real());
    guard.open(None);
    assert!(guard.ready(true).unwrap_err().to_string().contains("serial"));
    guard.ready(false).unwrap();
}

#[test]
fn a_command_that_has_ended_is_not_stopped() {
    let (first, first_written) = device();
    let (second, second_written) = device();
    let mut guard = Guard::new(Clock::real());
    guard.open(first);
    guard.ready(true).unwrap();
    guard.begin(b"!".to_vec());
    guard.end();
    guard.open(second);
    guard.ready(true).unwrap();
    guard.begin(b"\x18".to_vec());
    assert_eq!(second_written.recv_timeout(LONGEST).unwrap(), b"\x18");
    assert!(first_written.recv().is_err(), "nothing, until the device was closed");
}

#[test]
fn a_guard_that_ended_at_rest_begins_again_with_the_next_command() {
    let (writer, written) = device();
    let mut guard = Guard::resting_after(Clock::real(), Duration::ZERO);
    guard.open(writer);
    assert!(!guard.is_guarding());
    guard.ready(true).unwrap();
    guard.begin(b"!".to_vec());
    assert!(guard.is_guarding());
    guard.end();
    while guard.is_guarding() {
        thread::yield_now();
    }
    guard.ready(true).unwrap();
    guard.begin(b"\x18".to_vec());
    // On a machine that stood still meanwhile the first command was stopped as well.
    while written.recv_timeout(LONGEST).unwrap() != b"\x18" {}
}
