use std::io::{Read as _, Write as _};
use std::net::TcpListener;
use std::thread;

use super::*;

fn answered_with(answer: &'static [u8]) -> (Result<Response<Bytes>, HttpError>, String) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("http://{}/v1/traces", listener.local_addr().unwrap());
    let collector = thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        let mut heard = [0; 4096];
        let length = stream.read(&mut heard).unwrap();
        stream.write_all(answer).unwrap();
        String::from_utf8_lossy(&heard[..length]).into_owned()
    });
    let request = Request::post(url).body(Bytes::from_static(b"spans")).unwrap();
    let runtime = Sender::new().unwrap();
    let answer = runtime.0.block_on(async { timeout(PATIENCE, send(request)).await.unwrap() });
    (answer, collector.join().unwrap())
}

#[test]
fn a_request_and_its_answer() {
    let (answer, heard) = answered_with(b"HTTP/1.1 400 Bad Request\r\ncontent-length: 3\r\n\r\nwhy");
    let answer = answer.unwrap();
    assert_eq!((answer.status().as_u16(), answer.body().as_ref()), (400, b"why".as_slice()));
    assert!(heard.starts_with("POST /v1/traces HTTP/1.1\r\n"), "{heard}");
    assert!(heard.contains("host: 127.0.0.1:") && heard.ends_with("spans"), "{heard}");
}

#[test]
fn a_collector_that_is_none_is_an_error() {
    let (answer, _) = answered_with(b"SSH-2.0-OpenSSH\r\n");
    answer.unwrap_err();
}
