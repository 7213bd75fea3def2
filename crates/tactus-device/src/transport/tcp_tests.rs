use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpListener;

use super::TcpConnector;
use crate::ErrorKind;
use crate::transport::Connect;

#[tokio::test]
async fn bytes_go_both_ways_until_nobody_listens() {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let connector = TcpConnector::new(listener.local_addr().unwrap().to_string());
    let (mut host, mut device) = {
        let (host, device) = tokio::join!(connector.connect(), listener.accept());
        (host.unwrap(), device.unwrap().0)
    };
    let mut read = [0; 2];
    host.write_all(b"?!").await.unwrap();
    device.read_exact(&mut read).await.unwrap();
    assert_eq!(&read, b"?!");
    device.write_all(b"ok").await.unwrap();
    host.read_exact(&mut read).await.unwrap();
    assert_eq!(&read, b"ok");
    drop(listener);
    let error = connector.connect().await.err().expect("nobody listens");
    assert_eq!(error.kind, ErrorKind::Absent);
}

#[tokio::test]
async fn an_address_that_is_none_is_absent() {
    let error = TcpConnector::new("no port").connect().await.err().expect("it connected");
    assert_eq!(error.kind, ErrorKind::Absent);
    assert!(error.to_string().starts_with("tcp:no port: there is no such server"), "{error}");
}
