use super::*;

#[test]
fn a_lock_is_read_as_the_system_writes_it() {
    let line = "1: FLOCK  ADVISORY  WRITE 1234 00:06:567 0 EOF";
    assert_eq!(lock(line), Some(("00:06:567".to_owned(), 1234)));
    for other in
        ["", "2: POSIX  ADVISORY  READ 7 08:01:12 0 EOF", "3: -> FLOCK  ADVISORY  WRITE 9 00:06:1 0 EOF"]
    {
        assert_eq!(lock(other), None, "{other}");
    }
}

#[test]
fn who_has_locked_or_opened_a_node_is_told() {
    let proc = tempfile::TempDir::new().unwrap();
    let node = tempfile::NamedTempFile::new().unwrap();
    let locks = format!("1: FLOCK  ADVISORY  WRITE 41 {} 0 EOF\n", key(node.path()).unwrap());
    fs::write(proc.path().join("locks"), locks).unwrap();
    for (pid, name) in [(41, "tactusd"), (42, "cat")] {
        fs::create_dir_all(proc.path().join(format!("{pid}/fd"))).unwrap();
        fs::write(proc.path().join(format!("{pid}/comm")), format!("{name}\n")).unwrap();
    }
    std::os::unix::fs::symlink("/dev/null", proc.path().join("42/fd/3")).unwrap();
    let holders = Holders::read(proc.path());
    let holder = |pid, name: &str| Some(Holder { pid, name: name.to_owned() });
    assert_eq!(holders.of(node.path()), holder(41, "tactusd"));
    assert_eq!(holders.of(Path::new("/dev/null")), holder(42, "cat"));
    assert_eq!(holders.of(Path::new("/dev/zero")), None);
    assert_eq!(holders.of(Path::new("/dev/none")), None);
}

#[test]
fn a_port_that_this_process_holds_is_held_by_it() {
    use tokio_serial::SerialPort;
    let (_near, far) = {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        let _inside = runtime.enter();
        tokio_serial::SerialStream::pair().unwrap()
    };
    let path = far.name().unwrap();
    let holder = Holders::read(Path::new("/proc")).of(Path::new(&path)).unwrap();
    assert_eq!(holder.pid, std::process::id());
}
