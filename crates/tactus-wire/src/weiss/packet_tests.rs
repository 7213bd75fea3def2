//! Golden packets: laid out by hand from the published format, their checksums computed by the
//! bit-by-bit definition in a separate program.

use super::{encode_packet, id};

#[test]
fn query_without_payload_has_no_checksum() {
    assert_eq!(encode_packet(id::CONTROLLER, &[]), [0xAA, 0xAA, 0xAA, 0x01, 0x00, 0x00]);
}

#[test]
fn query_of_the_first_matrix() {
    assert_eq!(encode_packet(id::MATRIX, &[0]), [0xAA, 0xAA, 0xAA, 0x0B, 0x01, 0x00, 0x00, 0xCB, 0xFB]);
}

#[test]
#[should_panic(expected = "has no length field")]
fn too_long() {
    encode_packet(id::FRAME, &vec![0; 65_536]);
}
