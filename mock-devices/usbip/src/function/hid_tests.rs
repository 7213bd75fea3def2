use super::*;
use crate::descriptor::configuration;

fn setup(request_type: u8, request: u8, value: u16) -> Setup {
    let [low, high] = value.to_le_bytes();
    Setup::parse([request_type, request, low, high, 0, 0, 0, 1])
}

#[test]
fn its_descriptors_to_the_byte() {
    let mut hid = Hid::new(105, Some(1));
    let golden = [
        &[9, 2, 34, 0, 1, 1, 0, 0x80, 50][..],
        &[9, 4, 0, 0, 1, 3, 0, 0, 0],
        // Section 6.2.1: length, type, release 1.11, country, descriptors, type and length of the only one.
        &[9, 0x21, 0x11, 0x01, 0, 1, 0x22, 24, 0],
        &[7, 5, 0x81, 3, 105, 0, 4],
    ];
    assert_eq!(configuration(&[hid.group(FirstNumbers { interface: 0, endpoint: 1 })]), golden.concat());
    let report = ControlReply::Data(vec![
        0x06, 0x00, 0xFF, 0x09, 0x01, 0xA1, 0x01, 0x85, 1, 0x09, 0x01, 0x15, 0x00, 0x26, 0xFF, 0x00, 0x75, 8,
        0x96, 104, 0, 0x81, 0x02, 0xC0,
    ]);
    let ControlReply::Data(found) = &report else { unreachable!() };
    assert_eq!(found.len(), 24);
    assert_eq!(hid.control(setup(0x81, 6, 0x2200), &[]), Ok(report));
}

#[test]
fn reports_without_a_number_have_all_their_bytes_for_the_frame() {
    let mut hid = Hid::new(1024, None);
    let Ok(ControlReply::Data(report)) = hid.control(setup(0x81, 6, 0x2200), &[]) else {
        panic!("a descriptor")
    };
    assert!(!report.contains(&0x85), "no report id");
    assert_eq!(report[16..19], [0x96, 0x00, 0x04], "1024 of them");
}

#[test]
fn each_frame_is_a_report() {
    let mut hid = Hid::new(3, Some(1));
    assert_eq!(hid.packets(&[1, 2, 3, 1, 5, 6]), [[1, 2, 3], [1, 5, 6]]);
    let get_report = setup(0xA1, GET_REPORT, 0x0101);
    assert_eq!(hid.control(get_report, &[]), Ok(ControlReply::Data(vec![1, 5, 6])), "the last one");
    let set_report = setup(0x21, SET_REPORT, 0x0201);
    assert_eq!(hid.control(set_report, &[1, 9]), Ok(ControlReply::Heard(vec![1, 9])));
    assert_eq!(hid.control(setup(0x21, SET_IDLE, 0), &[]), Ok(ControlReply::DONE));
    assert_eq!(hid.control(setup(0xA1, GET_IDLE, 0), &[]), Ok(ControlReply::Data(vec![0])));
    assert_eq!(hid.control(setup(0x81, 6, 0x2300), &[]), Err(Refused), "a physical descriptor");
    assert_eq!(hid.control(setup(0x21, 0x0B, 0), &[]), Err(Refused), "a boot protocol");
}
