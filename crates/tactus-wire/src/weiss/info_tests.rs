//! Golden replies: fields laid out by hand in the published order, checksums by a separate program.

use super::{ControllerInfo, ErrorCode, InfoError, MatrixInfo, SensorInfo};
use crate::weiss::{Decoder, Packet};

const CONTROLLER: [u8; 26] = [
    0xAA, 0xAA, 0xAA, 0x01, 0x12, 0x00, 0x00, 0x00, 0x04, 0x03, 0x02, 0x01, 0x11, 0x20, 0x01, 0x05, 0x06,
    0x01, 0x02, 0x03, 0x04, 0x05, 0x06, 0x07, 0x21, 0x12,
];

const SENSOR: [u8; 20] = [
    0xAA, 0xAA, 0xAA, 0x02, 0x0C, 0x00, 0x00, 0x00, 0x01, 0x00, 0x07, 0x00, 0x02, 0xEF, 0xBE, 0xAD, 0xDE,
    0x03, 0x66, 0xF5,
];

const MATRIX: [u8; 60] = [
    0xAA, 0xAA, 0xAA, 0x0B, 0x34, 0x00, // header
    0x00, 0x00, // error
    0x00, 0x00, 0xC0, 0x3F, 0x00, 0x00, 0x00, 0x40, // element 1.5 mm x 2 mm
    0x08, 0x00, 0x06, 0x00, // 8 x 6 cells
    0x01, 0x02, 0x03, 0x04, 0x05, 0x06, // uid
    0x00, 0x00, 0x09, // reserved, revision
    0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, // centre
    0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, // theta
    0x00, 0xF0, 0x7F, 0x45, // full scale 4095
    0x01, // feature flags
    0x99, 0x06, // checksum
];

fn controller() -> ControllerInfo {
    ControllerInfo {
        error: ErrorCode::SUCCESS,
        serial_number: 0x0102_0304,
        hardware_version: 0x11,
        software_version: 0x0120,
        status_flags: 5,
        feature_flags: 6,
        rest: [1, 2, 3, 4, 5, 6, 7],
    }
}

fn sensor() -> SensorInfo {
    SensorInfo {
        error: ErrorCode::SUCCESS,
        matrices: 1,
        generated_by: 7,
        hardware_revision: 2,
        serial_number: 0xDEAD_BEEF,
        feature_flags: 3,
    }
}

fn matrix() -> MatrixInfo {
    MatrixInfo {
        error: ErrorCode::SUCCESS,
        element_mm: [1.5, 2.0],
        cells_x: 8,
        cells_y: 6,
        uid: [1, 2, 3, 4, 5, 6],
        hardware_revision: 9,
        centre_mm: [0.0; 3],
        theta: [0.0; 3],
        full_scale: 4095.0,
        feature_flags: 1,
    }
}

#[test]
fn golden_bytes() {
    assert_eq!(controller().encode(), CONTROLLER);
    assert_eq!(sensor().encode(), SENSOR);
    assert_eq!(matrix().encode(), MATRIX);
}

#[test]
fn replies_are_read() {
    let mut decoder = Decoder::new();
    decoder.push(&[&CONTROLLER[..], &SENSOR, &MATRIX].concat());
    assert_eq!(ControllerInfo::parse(&decoder.next_packet().unwrap().unwrap()), Ok(controller()));
    assert_eq!(SensorInfo::parse(&decoder.next_packet().unwrap().unwrap()), Ok(sensor()));
    assert_eq!(MatrixInfo::parse(&decoder.next_packet().unwrap().unwrap()), Ok(matrix()));
}

#[test]
fn another_length_is_named() {
    let packet = Packet { id: 0x0B, payload: &[0; 51] };
    assert_eq!(MatrixInfo::parse(&packet), Err(InfoError { id: 0x0B, expected: 52, found: 51 }));
    assert_eq!(SensorInfo::parse(&packet), Err(InfoError { id: 0x02, expected: 12, found: 0 }));
}

#[test]
fn error_numbers_in_words() {
    assert_eq!(ErrorCode::SUCCESS.meaning(), "success");
    assert_eq!(ErrorCode::UNKNOWN_COMMAND.meaning(), "unknown command");
    assert_eq!(ErrorCode::INDEX_OUT_OF_BOUNDS.meaning(), "index out of bounds");
    assert_eq!(ErrorCode(27).meaning(), "range error");
    assert_eq!(ErrorCode(28).meaning(), "unknown error");
}
