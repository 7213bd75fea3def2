use super::*;

fn stop(who: &str) -> pb::CommandRequest {
    pb::CommandRequest { who: who.to_owned(), reason: "smoke".to_owned(), ..Default::default() }
}

#[test]
fn a_datagram_names_its_rig_and_who_asks() {
    let bytes = [b"tactus stop bench\n".as_slice(), &stop("cli").encode_to_vec()].concat();
    assert_eq!(parse(&bytes), Some((b"bench".as_slice(), stop("cli"))));
    let bytes = [b"tactus stop \n".as_slice(), &stop("").encode_to_vec()].concat();
    assert_eq!(parse(&bytes), Some((b"".as_slice(), stop("unknown"))));
}

#[test]
fn a_stop_with_nonsense_behind_it_is_a_stop_and_nonsense_alone_is_none() {
    for bytes in [b"tactus stop".as_slice(), b"tactus stop\n", b"tactus stop\n\x0a\x7f\x00"] {
        let (rig, request) = parse(bytes).unwrap();
        assert_eq!((rig, request.who.as_str()), (b"".as_slice(), "unknown"), "{bytes:?}");
    }
    // The last is how a browser asks for its own address (STUN).
    for bytes in [b"".as_slice(), b"stop", b"tactus sto", b"\x00\x01\x00\x00\x21\x12\xa4\x42"] {
        assert_eq!(parse(bytes), None, "{bytes:?}");
    }
}

#[test]
fn the_path_of_a_service_that_was_killed_is_taken_again_and_that_of_a_living_one_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bus.sock.stop");
    let living = bind_unix(&path).unwrap();
    assert_eq!(bind_unix(&path).unwrap_err().kind(), io::ErrorKind::AddrInUse);
    // The file stays.
    drop(living);
    assert!(path.exists());
    bind_unix(&path).unwrap();
}
