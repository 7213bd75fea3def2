use super::*;
use crate::descriptor::IN;
use crate::function::acm::Acm;
use crate::function::bulk::Bulk;
use crate::function::hid::Hid;

fn setup(bytes: [u8; 8]) -> Setup {
    Setup::parse(bytes)
}

/// CDC-ACM, HID and vendor bulk in one device.
fn composite() -> Gadget {
    let functions: Vec<Box<dyn Function>> = vec![
        Box::new(Acm::new(Speed::High)),
        Box::new(Hid::new(105, Some(1))),
        Box::new(Bulk::new(Speed::High, 106)),
    ];
    Gadget::new(Identity::own(5, "virtual rig", "SIM-RIG"), Speed::High, functions)
}

#[test]
fn a_composite_gives_each_function_numbers_of_its_own() {
    let gadget = composite();
    let addresses: Vec<_> =
        gadget.endpoints().map(|(function, endpoint)| (function, endpoint.address)).collect();
    // Notifications and data of the serial port, the reports, the frames.
    assert_eq!(addresses, [(0, 0x82), (0, 0x81), (0, 0x01), (1, 0x83), (2, 0x84), (2, 0x04)]);
    let data: Vec<_> = (0..4).map(|function| gadget.data_address(function)).collect();
    assert_eq!(data, [Some(IN | 1), Some(IN | 3), Some(IN | 4), None]);
}

#[test]
fn it_describes_itself() {
    let mut gadget = composite();
    let mut ask = |value: u16| {
        let [low, high] = value.to_le_bytes();
        gadget.control(setup([0x80, 6, low, high, 0, 0, 0xFF, 0]), &[])
    };
    let Ok(Outcome::Data(device)) = ask(0x0100) else { panic!("a device") };
    assert_eq!(device[4..12], [0xEF, 2, 1, 64, 0x09, 0x12, 0x05, 0x00], "by association, 1209:0005");
    let Ok(Outcome::Data(all)) = ask(0x0200) else { panic!("a configuration") };
    assert_eq!((usize::from(all[2]) + 256 * usize::from(all[3]), all[4]), (all.len(), 4));
    for (number, text) in [(1, "Tactus SIM"), (2, "virtual rig"), (3, "SIM-RIG")] {
        assert_eq!(ask(0x0300 | number), Ok(Outcome::Data(string(text))));
    }
    assert_eq!(ask(0x0300), Ok(Outcome::Data(languages())));
    for absent in [0x0304, 0x0101, 0x0201, 0x0600] {
        assert_eq!(ask(absent), Err(Refused), "{absent:04X}");
    }
}

#[test]
fn a_single_function_needs_no_association() {
    let functions: Vec<Box<dyn Function>> = vec![Box::new(Hid::new(8, None))];
    let mut gadget = Gadget::new(Identity::own(3, "virtual sensor", "SIM"), Speed::High, functions);
    let asked = gadget.control(setup([0x80, 6, 0, 1, 0, 0, 18, 0]), &[]);
    let Ok(Outcome::Data(device)) = asked else { panic!("a device") };
    assert_eq!(device[4..7], [0, 0, 0]);
}

#[test]
fn it_is_configured() {
    let mut gadget = composite();
    let get = setup([0x80, 8, 0, 0, 0, 0, 1, 0]);
    assert_eq!(gadget.control(get, &[]), Ok(Outcome::Data(vec![0])));
    assert_eq!(gadget.control(setup([0x00, 9, 1, 0, 0, 0, 0, 0]), &[]), Ok(Outcome::Renewed));
    assert_eq!(gadget.control(get, &[]), Ok(Outcome::Data(vec![1])));
    assert_eq!(gadget.control(setup([0x00, 9, 2, 0, 0, 0, 0, 0]), &[]), Err(Refused), "there is one");
    // Interfaces have one setting.
    assert_eq!(gadget.control(setup([0x01, 11, 0, 0, 2, 0, 0, 0]), &[]), Ok(Outcome::Renewed));
    assert_eq!(gadget.control(setup([0x01, 11, 1, 0, 2, 0, 0, 0]), &[]), Err(Refused));
    for recipient in [0x80, 0x81] {
        let status = gadget.control(setup([recipient, 0, 0, 0, 0, 0, 2, 0]), &[]);
        assert_eq!(status, Ok(Outcome::Data(vec![0, 0])));
    }
}

#[test]
fn requests_reach_the_interface_that_they_name() {
    let mut gadget = composite();
    // The serial port's line coding, of its interface 0; the report descriptor of interface 2.
    let Ok(Outcome::Data(coding)) = gadget.control(setup([0xA1, 0x21, 0, 0, 0, 0, 7, 0]), &[]) else {
        panic!("a line coding")
    };
    assert_eq!(coding.len(), 7);
    assert!(gadget.control(setup([0x81, 6, 0, 0x22, 2, 0, 0xFF, 0]), &[]).is_ok());
    assert_eq!(gadget.control(setup([0x81, 6, 0, 0x22, 3, 0, 0xFF, 0]), &[]), Err(Refused));
    assert_eq!(gadget.control(setup([0xA1, 0x21, 0, 0, 9, 0, 7, 0]), &[]), Err(Refused), "no interface");
    let told = gadget.control(setup([0x21, 9, 1, 2, 2, 0, 2, 0]), &[1, 7]);
    assert_eq!(told, Ok(Outcome::Heard(1, vec![1, 7])));
    assert_eq!(gadget.control(setup([0x60, 0, 0, 0, 0, 0, 0, 0]), &[]), Err(Refused), "reserved");
}
