use std::collections::VecDeque;

use super::*;

fn node(path: &str, serial: Option<&str>, interface: u8) -> HidNode {
    HidNode {
        path: path.into(),
        vid: 0x1209,
        pid: 0x20,
        serial: serial.map(str::to_owned),
        product: None,
        interface: Some(interface),
        usages: vec![(0xFF00, 1)],
    }
}

fn bench() -> Vec<HidNode> {
    vec![
        node("/dev/hidraw0", Some("A1"), 0),
        node("/dev/hidraw1", Some("A1"), 2),
        node("/dev/hidraw2", Some("B2"), 2),
    ]
}

fn find(identity: &str, interface: Option<u8>) -> Result<PathBuf, (ErrorKind, String)> {
    let link = HidLink { identity: identity.parse().unwrap(), interface, report_bytes: None };
    let found = choose("hid", &link, bench());
    found.map(|node| node.path).map_err(|error| (error.kind, error.what))
}

#[test]
fn the_node_that_the_rig_file_means_is_chosen() {
    assert_eq!(find("1209:0020/B2", None), Ok("/dev/hidraw2".into()));
    assert_eq!(find("1209:0020/A1", Some(2)), Ok("/dev/hidraw1".into()));
    assert_eq!(find("1209:0020", Some(0)), Ok("/dev/hidraw0".into()));
}

#[test]
fn absent_wrong_and_several_are_told_apart() {
    assert_eq!(find("1209:0021", Some(2)).unwrap_err().0, ErrorKind::Absent);

    let (kind, what) = find("1209:0020/C3", None).unwrap_err();
    assert_eq!(kind, ErrorKind::WrongDevice);
    assert!(what.contains("with another serial number") && what.contains("\"B2\" at /dev/hidraw2"), "{what}");

    let (kind, what) = find("1209:0020/A1", Some(1)).unwrap_err();
    assert_eq!(kind, ErrorKind::WrongDevice);
    assert!(what.contains("interface 1 is not a HID interface, but /dev/hidraw0 (interface 0), "), "{what}");

    let (kind, what) = find("1209:0020/A1", None).unwrap_err();
    assert_eq!(kind, ErrorKind::WrongDevice);
    assert!(what.starts_with("2 devices are 1209:0020/A1: ") && what.ends_with(APART), "{what}");
}

#[test]
fn permission_absence_and_others_programs_are_told_apart() {
    let explain = |error: Errno| {
        let DeviceError { kind, what, .. } = explain("hid", &node("/dev/hidraw1", None, 2), error.into());
        (kind, what)
    };
    for errno in [Errno::ACCESS, Errno::PERM] {
        let (kind, what) = explain(errno);
        assert_eq!(kind, ErrorKind::Permission);
        assert!(what.contains("/dev/hidraw1") && what.contains("70-tactus.rules"), "{what}");
        assert!(what.contains("ATTRS{idVendor}==\"1209\", ATTRS{idProduct}==\"0020\""), "{what}");
    }
    for errno in [Errno::WOULDBLOCK, Errno::BUSY] {
        assert_eq!(explain(errno).0, ErrorKind::Busy);
    }
    for errno in [Errno::NOENT, Errno::NODEV] {
        assert_eq!(explain(errno).0, ErrorKind::Absent);
    }
    assert_eq!(explain(Errno::IO).0, ErrorKind::DeviceFault);
}

#[test]
fn a_device_that_somebody_has_locked_is_busy() {
    let file = tempfile::NamedTempFile::new().unwrap();
    let held = open_alone(file.path()).unwrap();
    let error = open_alone(file.path()).unwrap_err();
    assert_eq!(explain("hid", &node("/dev/hidraw1", None, 2), error).kind, ErrorKind::Busy);
    drop(held);
    open_alone(file.path()).unwrap();
}

/// Reports that wait, and then `None` for a read in which none came; then the device is gone.
struct Scripted {
    reads: VecDeque<Option<Vec<u8>>>,
    timeouts_ms: Vec<i32>,
}

impl Reports for Scripted {
    fn read(&mut self, report: &mut [u8], timeout_ms: i32) -> io::Result<usize> {
        self.timeouts_ms.push(timeout_ms);
        let Some(read) = self.reads.pop_front() else { return Err(io::ErrorKind::BrokenPipe.into()) };
        let bytes = read.unwrap_or_default();
        // The system cuts what has no room.
        let length = bytes.len().min(report.len());
        report[..length].copy_from_slice(&bytes[..length]);
        Ok(length)
    }
}

fn source(reads: impl IntoIterator<Item = Option<Vec<u8>>>) -> HidSource<Scripted> {
    HidSource::new(Scripted { reads: reads.into_iter().collect(), timeouts_ms: Vec::new() }, 4)
}

#[test]
fn a_report_keeps_its_number_and_its_length() {
    let mut source = source([Some(vec![3, 1, 2]), None, Some(vec![4, 9, 9, 9])]);
    let all: Vec<_> = std::iter::from_fn(|| source.next().ok()).collect();
    assert_eq!(all, [Some(vec![3, 1, 2]), None, Some(vec![4, 9, 9, 9])]);
    assert_eq!(source.reports.timeouts_ms, [PATIENCE_MS; 4]);
}

#[test]
fn a_report_that_is_too_long_is_refused_instead_of_cut() {
    let error = source([Some(vec![0; 5])]).next().unwrap_err();
    assert_eq!(error.kind(), io::ErrorKind::InvalidData);
    assert!(error.to_string().contains("longer than the 4 bytes of report_bytes"), "{error}");
}

#[test]
fn reports_that_the_system_dropped_are_not_passed_over() {
    let report = || Some(vec![1]);
    let mut source = source(std::iter::repeat_with(report).take(KEPT_BY_THE_SYSTEM));
    source.was_held_up();
    for _ in 1..KEPT_BY_THE_SYSTEM {
        assert_eq!(source.next().unwrap(), report());
    }
    let error = source.next().unwrap_err();
    assert!(error.to_string().contains("too slowly"), "{error}");
}

#[test]
fn reports_that_only_waited_are_all_given() {
    let waiting = std::iter::repeat_n(Some(vec![1]), KEPT_BY_THE_SYSTEM - 1);
    let later = std::iter::repeat_n(Some(vec![2]), KEPT_BY_THE_SYSTEM);
    let mut source = source(waiting.chain([None]).chain(later));
    source.was_held_up();
    let all: Vec<_> = std::iter::from_fn(|| source.next().ok()).collect();
    assert_eq!(all.iter().flatten().count(), 2 * KEPT_BY_THE_SYSTEM - 1);
    assert_eq!(source.reports.timeouts_ms[0], 0);
    assert_eq!(source.reports.timeouts_ms.last(), Some(&PATIENCE_MS));
}

#[tokio::test]
async fn a_device_that_is_not_there_is_absent() {
    let link = HidLink { identity: "1209:ffff/none".parse().unwrap(), interface: None, report_bytes: None };
    let error = HidConnector::new(link).connect().await.err().expect("it opened");
    assert_eq!(error.kind, ErrorKind::Absent);
    assert!(error.to_string().starts_with("hid:1209:ffff/none: there is no such device"), "{error}");
}
