use super::*;

struct Toy(u16, u16, Option<&'static str>, &'static str);

impl Candidate for Toy {
    fn vid_pid(&self) -> (u16, u16) {
        (self.0, self.1)
    }

    fn serial(&self) -> Option<&str> {
        self.2
    }

    fn place(&self) -> String {
        self.3.to_owned()
    }
}

fn bench() -> Vec<Toy> {
    vec![
        Toy(0x1209, 0x20, Some("A1"), "/dev/toy0"),
        Toy(0x1209, 0x20, Some("B2"), "/dev/toy1"),
        Toy(0x1209, 0x21, None, "/dev/toy2"),
        Toy(0x0403, 0x6001, None, "/dev/toy3"),
        Toy(0x0403, 0x6001, None, "/dev/toy4"),
    ]
}

fn find(identity: &str) -> Result<&'static str, DeviceError> {
    the_one("toy", &identity.parse().unwrap(), bench(), "Unplug one").map(|toy| toy.3)
}

#[test]
fn the_one_with_the_identity_is_found() {
    assert_eq!(find("1209:0020/B2").unwrap(), "/dev/toy1");
    assert_eq!(find("1209:0021").unwrap(), "/dev/toy2");
}

#[test]
fn absent_other_and_several_are_told_apart() {
    let error = find("1209:0022").unwrap_err();
    assert_eq!(error.kind, ErrorKind::Absent);
    assert!(error.to_string().starts_with("toy: there is no such device"), "{error}");

    let error = find("1209:0020/C3").unwrap_err();
    assert_eq!(error.kind, ErrorKind::WrongDevice);
    let text = error.to_string();
    assert!(text.contains("\"A1\" at /dev/toy0; serial number \"B2\" at /dev/toy1"), "{text}");

    let error = find("1209:0021/A1").unwrap_err();
    assert_eq!(error.kind, ErrorKind::WrongDevice);
    assert!(error.to_string().contains("no serial number at /dev/toy2"), "{error}");

    let error = find("0403:6001").unwrap_err();
    assert_eq!(error.kind, ErrorKind::WrongDevice);
    let text = error.to_string();
    assert!(text.contains("/dev/toy3") && text.ends_with("/dev/toy4. Unplug one"), "{text}");
}

#[test]
fn permission_comes_with_the_rule_and_how_to_load_it() {
    let text = permission("/dev/toy0", "KERNEL==\"toy*\"");
    for part in [
        "/dev/toy0",
        "70-tactus.rules",
        "KERNEL==\"toy*\", MODE",
        "udevadm control --reload && udevadm trigger",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
}
