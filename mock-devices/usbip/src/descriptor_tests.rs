use super::*;

#[test]
fn a_device_field_by_field() {
    let device =
        DeviceDescriptor { class: Class::BY_ASSOCIATION, vendor: 0x1209, product: 0x0001, release: 0x0100 };
    // Table 9-8: length, type, release of USB, class, subclass, protocol, packets of endpoint 0, vendor, product,
    // release of the device, strings for manufacturer, product and serial number, configurations.
    let golden = [18, 1, 0x00, 0x02, 0xEF, 0x02, 0x01, 64, 0x09, 0x12, 0x01, 0x00, 0x00, 0x01, 1, 2, 3, 1];
    assert_eq!(device.encode(), golden);
}

#[test]
fn a_configuration_field_by_field() {
    let endpoints = vec![
        Endpoint { address: IN | 1, carrier: TransferType::Bulk, packet_bytes: 512 },
        Endpoint { address: 2, carrier: TransferType::Interrupt { interval: 4 }, packet_bytes: 16 },
    ];
    let interface =
        Interface { number: 0, class: Class::VENDOR, class_descriptors: vec![3, 0x24, 0], endpoints };
    let bytes = configuration(&[FunctionDescriptors { interfaces: vec![interface] }]);
    // Table 9-10: length, type, length of all, interfaces, number, string, attributes (bit 7 is always set), mA / 2.
    assert_eq!(bytes[..9], [9, 2, 35, 0, 1, 1, 0, 0x80, 50]);
    // Table 9-12: length, type, number, setting, endpoints, class, subclass, protocol, string.
    assert_eq!(bytes[9..18], [9, 4, 0, 0, 2, 0xFF, 0xFF, 0xFF, 0]);
    assert_eq!(bytes[18..21], [3, 0x24, 0], "the class's own stand before the endpoints");
    // Table 9-13: length, type, address, attributes (2 bulk, 3 interrupt), longest packet, interval.
    assert_eq!(bytes[21..28], [7, 5, 0x81, 2, 0x00, 0x02, 0]);
    assert_eq!(bytes[28..], [7, 5, 0x02, 3, 16, 0, 4]);
}

#[test]
fn interfaces_that_belong_together_are_associated() {
    let interface = |number| Interface {
        number,
        class: Class(2, 2, 1),
        class_descriptors: Vec::new(),
        endpoints: Vec::new(),
    };
    let alone = FunctionDescriptors { interfaces: vec![interface(0)] };
    let pair = FunctionDescriptors { interfaces: vec![interface(1), interface(2)] };
    let bytes = configuration(&[alone, pair]);
    assert_eq!(bytes.len(), 9 + 9 + 8 + 9 + 9);
    assert_eq!(bytes[4], 3, "interfaces");
    // Length, type, first interface, interfaces, class, subclass, protocol, string.
    assert_eq!(bytes[18..26], [8, 11, 1, 2, 2, 2, 1, 0]);
}

#[test]
fn strings_are_in_utf_16() {
    assert_eq!(languages(), [4, 3, 0x09, 0x04]);
    assert_eq!(string("SIM"), [8, 3, b'S', 0, b'I', 0, b'M', 0]);
    let longest = string(&"é".repeat(300));
    assert_eq!((longest.len(), longest[0]), (254, 254));
}
