use tokio::io::AsyncWriteExt;
use tokio::time::advance;

use super::*;
use crate::transport::Connect;
use crate::transport::memory;

const DEADLINE: Option<Duration> = Some(Duration::from_millis(100));

/// A link, and the device's end of it.
async fn link() -> (Link, impl AsyncWriteExt + Unpin) {
    let (connector, mut port) = memory::pair("device");
    let (stream, device) = tokio::join!(connector.connect(), port.accept());
    (Link::new(stream.unwrap(), Clock::paused(), "device".into()), device)
}

/// What comes next, in a word.
async fn next(link: &mut Link, deadline: Option<Duration>) -> String {
    match link.next(deadline).await.unwrap() {
        (_, LinkEvent::Received(bytes)) => String::from_utf8_lossy(bytes).into_owned(),
        (_, LinkEvent::Deadline) => "deadline".into(),
    }
}

#[tokio::test(start_paused = true)]
async fn what_arrived_in_time_comes_before_a_deadline_that_the_host_was_late_for() {
    let (mut link, mut device) = link().await;
    device.write_all(b"in time").await.unwrap();
    advance(Duration::from_secs(3)).await;
    assert_eq!(next(&mut link, DEADLINE).await, "in time");
    assert_eq!(next(&mut link, DEADLINE).await, "deadline");
    // A deadline that the bytes have put off is none.
    device.write_all(b"again").await.unwrap();
    assert_eq!(next(&mut link, DEADLINE).await, "again");
    let later = Some(Duration::from_secs(4));
    device.write_all(b"and again").await.unwrap();
    assert_eq!(next(&mut link, later).await, "and again");
    assert_eq!(next(&mut link, later).await, "deadline");
}

#[tokio::test(start_paused = true)]
async fn a_device_that_sends_without_pause_does_not_delay_the_deadline() {
    let (mut link, mut device) = link().await;
    advance(Duration::from_secs(3)).await;
    let mut deadlines = 0;
    for _ in 0..10 {
        device.write_all(b"noise").await.unwrap();
        deadlines += u32::from(next(&mut link, DEADLINE).await == "deadline");
    }
    assert_eq!(deadlines, 5, "every other event is it");
}
