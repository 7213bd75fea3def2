use super::*;
use crate::descriptor::configuration;

fn setup(request_type: u8, request: u8, value: u16) -> Setup {
    let [low, high] = value.to_le_bytes();
    Setup::parse([request_type, request, low, high, 0, 0, 7, 0])
}

#[test]
fn its_descriptors_to_the_byte() {
    let group = Acm::new(Speed::High).group(FirstNumbers { interface: 0, endpoint: 1 });
    let golden = [
        &[9, 2, 75, 0, 2, 1, 0, 0x80, 50][..],
        // Both interfaces belong together; communication, abstract control.
        &[8, 11, 0, 2, 2, 2, 1, 0],
        &[9, 4, 0, 0, 1, 2, 2, 1, 0],
        // Header, call management, abstract control management, union (tables 15, 3, 4 and 16).
        &[5, 0x24, 0, 0x10, 0x01],
        &[5, 0x24, 1, 0, 1],
        &[4, 0x24, 2, 2],
        &[5, 0x24, 6, 0, 1],
        &[7, 5, 0x82, 3, 16, 0, 9],
        // The data.
        &[9, 4, 1, 0, 2, 10, 0, 0, 0],
        &[7, 5, 0x81, 2, 0x00, 0x02, 0],
        &[7, 5, 0x01, 2, 0x00, 0x02, 0],
    ];
    assert_eq!(configuration(&[group]), golden.concat());
}

#[test]
fn it_is_open_while_the_host_is_ready() {
    let mut acm = Acm::new(Speed::High);
    assert!(!acm.is_open());
    assert_eq!(acm.control(setup(0x21, SET_CONTROL_LINE_STATE, 3), &[]), Ok(ControlReply::DONE));
    assert!(acm.is_open());
    assert_eq!(acm.control(setup(0x21, SET_CONTROL_LINE_STATE, 0), &[]), Ok(ControlReply::DONE));
    assert!(!acm.is_open());
}

#[test]
fn it_keeps_its_line_coding_and_refuses_what_is_none() {
    let mut acm = Acm::new(Speed::High);
    // 115200 baud, 8N1.
    let get = setup(0xA1, GET_LINE_CODING, 0);
    assert_eq!(acm.control(get, &[]), Ok(ControlReply::Data(vec![0x00, 0xC2, 0x01, 0x00, 0, 0, 8])));
    let nine_thousand_six_hundred = [0x80, 0x25, 0, 0, 0, 0, 8];
    let set = setup(0x21, SET_LINE_CODING, 0);
    assert_eq!(acm.control(set, &nine_thousand_six_hundred), Ok(ControlReply::DONE));
    assert_eq!(acm.control(get, &[]), Ok(ControlReply::Data(nine_thousand_six_hundred.to_vec())));
    assert_eq!(acm.control(set, &[1, 2]), Err(Refused));
    assert_eq!(acm.control(setup(0x21, 0x55, 0), &[]), Err(Refused));
}

#[test]
fn a_transfer_ends_with_a_short_packet() {
    let mut acm = Acm::new(Speed::Full);
    let lengths =
        |bytes: usize, acm: &mut Acm| acm.packets(&vec![0; bytes]).iter().map(Vec::len).collect::<Vec<_>>();
    assert!(lengths(0, &mut acm).is_empty());
    assert_eq!(lengths(63, &mut acm), [63]);
    assert_eq!(lengths(64, &mut acm), [64, 0]);
    assert_eq!(lengths(130, &mut acm), [64, 64, 2]);
}
