use super::*;
use crate::descriptor::configuration;

fn vendor(request_type: u8, request: u8, value: u16) -> Setup {
    let [low, high] = value.to_le_bytes();
    Setup::parse([request_type, request, low, high, 0, 0, 2, 0])
}

#[test]
fn its_descriptors_to_the_byte() {
    let group = Ftdi::new().group(FirstNumbers { interface: 0, endpoint: 1 });
    let golden = [
        &[9, 2, 32, 0, 1, 1, 0, 0x80, 50][..],
        &[9, 4, 0, 0, 2, 0xFF, 0xFF, 0xFF, 0],
        &[7, 5, 0x81, 2, 64, 0, 0],
        // The chip hears on another number than it sends on.
        &[7, 5, 0x02, 2, 64, 0, 0],
    ];
    assert_eq!(configuration(&[group]), golden.concat());
}

#[test]
fn every_packet_begins_with_two_bytes_of_status() {
    let mut ftdi = Ftdi::new();
    let bytes: Vec<u8> = (0..124).collect();
    let packets = ftdi.packets(&bytes);
    assert_eq!(packets.iter().map(Vec::len).collect::<Vec<_>>(), [64, 64]);
    assert!(packets.iter().all(|packet| packet[..2] == [0x31, 0x60]));
    assert_eq!(packets.concat()[2..64], bytes[..62]);
    assert_eq!(ftdi.packets(&[]), Vec::<Vec<u8>>::new());
}

#[test]
fn alone_the_status_comes_after_the_latency_timer() {
    let mut ftdi = Ftdi::new();
    assert_eq!(ftdi.idle_packet(), Some((Duration::from_millis(16), vec![0x31, 0x60])));
    assert_eq!(ftdi.control(vendor(0xC0, GET_LATENCY_TIMER, 0), &[]), Ok(ControlReply::Data(vec![16])));
    assert_eq!(ftdi.control(vendor(0x40, SET_LATENCY_TIMER, 1), &[]), Ok(ControlReply::DONE));
    assert_eq!(ftdi.idle_packet(), Some((Duration::from_millis(1), vec![0x31, 0x60])));
    for wrong in [0, 256] {
        assert_eq!(ftdi.control(vendor(0x40, SET_LATENCY_TIMER, wrong), &[]), Err(Refused));
    }
}

#[test]
fn it_is_open_while_the_host_is_ready_and_only_told_so_changes_that() {
    let mut ftdi = Ftdi::new();
    for (value, is_open) in [(0x0101, true), (0x0200, true), (0x0001, true), (0x0100, false)] {
        assert_eq!(ftdi.control(vendor(0x40, SET_MODEM_CTRL, value), &[]), Ok(ControlReply::DONE));
        assert_eq!(ftdi.is_open(), is_open, "{value:04X}");
    }
}

#[test]
fn it_answers_what_the_driver_asks_at_the_beginning() {
    let mut ftdi = Ftdi::new();
    for request in
        [RESET, SET_FLOW_CTRL, SET_BAUD_RATE, SET_DATA, SET_EVENT_CHAR, SET_ERROR_CHAR, SET_BITMODE]
    {
        assert_eq!(ftdi.control(vendor(0x40, request, 0x401A), &[]), Ok(ControlReply::DONE));
    }
    assert_eq!(
        ftdi.control(vendor(0xC0, GET_MODEM_STATUS, 0), &[]),
        Ok(ControlReply::Data(vec![0x31, 0x60]))
    );
    assert_eq!(ftdi.control(vendor(0xC0, READ_EEPROM, 0), &[]), Ok(ControlReply::Data(vec![0xFF, 0xFF])));
    assert_eq!(ftdi.control(vendor(0xC0, 0x77, 0), &[]), Err(Refused));
    assert_eq!(ftdi.control(vendor(0x21, RESET, 0), &[]), Err(Refused), "a request of a class");
}
