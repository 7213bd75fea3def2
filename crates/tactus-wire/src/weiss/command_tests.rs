use super::{CommandError, HostCommand, acknowledge, acquire, query_controller, query_matrix, query_sensor};
use crate::weiss::{Decoder, ErrorCode, Packet};

fn read(bytes: &[u8]) -> HostCommand {
    let mut decoder = Decoder::new();
    decoder.push(bytes);
    HostCommand::parse(&decoder.next_packet().unwrap().unwrap()).unwrap()
}

/// As in `packet_tests`: laid out by hand, checksums by a separate program.
#[test]
fn golden() {
    assert_eq!(acquire(true, false, 30), [0xAA, 0xAA, 0xAA, 0x03, 0x03, 0x00, 0x80, 0x1E, 0x00, 0x8E, 0x1C]);
    assert_eq!(acquire(true, true, 30), [0xAA, 0xAA, 0xAA, 0x03, 0x03, 0x00, 0x81, 0x1E, 0x00, 0x2C, 0x76]);
    assert_eq!(acquire(false, false, 0), [0xAA, 0xAA, 0xAA, 0x03, 0x03, 0x00, 0x00, 0x00, 0x00, 0x8D, 0x00]);
    assert_eq!(
        acknowledge(3, ErrorCode::SUCCESS),
        [0xAA, 0xAA, 0xAA, 0x03, 0x02, 0x00, 0x00, 0x00, 0x4B, 0xB9]
    );
}

#[test]
fn the_device_reads_what_the_host_writes() {
    assert_eq!(read(&query_controller()), HostCommand::QueryController);
    assert_eq!(read(&query_sensor()), HostCommand::QuerySensor);
    assert_eq!(read(&query_matrix(3)), HostCommand::QueryMatrix { matrix: 3 });
    assert_eq!(
        read(&acquire(true, false, 260)),
        HostCommand::Acquire { run: true, run_length: false, fps: 260 }
    );
    assert_eq!(read(&acquire(false, true, 0)), HostCommand::Acquire { run: false, run_length: true, fps: 0 });
}

#[test]
fn other_packets_are_named() {
    let unknown = HostCommand::parse(&Packet { id: 0x0A, payload: &[] });
    assert_eq!(unknown, Err(CommandError::Unknown { id: 0x0A }));
    let long = HostCommand::parse(&Packet { id: 3, payload: &[0; 4] });
    assert_eq!(long, Err(CommandError::Length { id: 3, bytes: 4 }));
}
