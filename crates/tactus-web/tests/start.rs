//! Starting the program, with and without errors.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::net::TcpListener;
use std::process::Command;

#[test]
fn a_place_that_is_taken_is_named_with_what_to_do() {
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let place = taken.local_addr().unwrap().to_string();
    let output = Command::new(env!("CARGO_BIN_EXE_tactus-web")).args(["--listen", &place]).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        said.contains(&format!("cannot listen on {place}: choose another address with --listen")),
        "{said}"
    );
}

#[test]
fn an_endpoint_that_is_none_is_a_usage_error() {
    let output =
        Command::new(env!("CARGO_BIN_EXE_tactus-web")).args(["--endpoint", "udp/nowhere"]).output().unwrap();
    assert_eq!(output.status.code(), Some(2), "{}", String::from_utf8_lossy(&output.stderr));
}
