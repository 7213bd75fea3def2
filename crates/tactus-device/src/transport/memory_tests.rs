use tokio::io::{AsyncReadExt, AsyncWriteExt};

use super::pair;
use crate::transport::Connect;
use crate::{DeviceError, ErrorKind};

fn absent(result: Result<Box<dyn crate::transport::ByteStream>, DeviceError>) -> bool {
    matches!(result, Err(error) if error.kind == ErrorKind::Absent)
}

#[tokio::test(start_paused = true)]
async fn bytes_go_both_ways() {
    let (connector, mut port) = pair("toy");
    let mut host = connector.connect().await.unwrap();
    let mut device = port.accept().await;
    let mut read = [0; 2];
    host.write_all(b"?\n").await.unwrap();
    device.read_exact(&mut read).await.unwrap();
    assert_eq!(&read, b"?\n");
    device.write_all(b"ok").await.unwrap();
    host.read_exact(&mut read).await.unwrap();
    assert_eq!(&read, b"ok");
}

#[tokio::test(start_paused = true)]
async fn a_device_goes_away_and_comes_back() {
    let (connector, mut port) = pair("toy");
    let mut host = connector.connect().await.unwrap();
    let device = port.accept().await;
    assert!(absent(connector.connect().await), "one host at a time");
    drop(device);
    assert_eq!(host.read(&mut [0; 1]).await.unwrap(), 0);
    assert!(absent(connector.connect().await));
    let (device, host) = tokio::join!(port.accept(), async {
        tokio::task::yield_now().await;
        connector.connect().await
    });
    drop(device);
    assert_eq!(host.unwrap().read(&mut [0; 1]).await.unwrap(), 0);
}

#[tokio::test(start_paused = true)]
async fn unplugged_or_dropped_is_absent() {
    let (connector, mut port) = pair("toy");
    port.unplug();
    assert!(absent(connector.connect().await));
    let (connector, port) = pair("toy");
    drop(port);
    let error = connector.connect().await.err().unwrap();
    assert_eq!(error.to_string(), "memory:toy: the virtual device is not plugged in");
}
