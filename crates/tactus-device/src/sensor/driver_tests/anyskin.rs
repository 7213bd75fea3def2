use std::time::Duration;

use tactus_schema::{Frame, FrameFlags};
use tactus_wire::anyskin::{self, FRAME_BYTES, Magnetometer};
use tokio::io::{AsyncWriteExt, DuplexStream};
use tokio::time::{Instant, sleep};

use crate::transport::memory::{MemoryPort, pair};
use crate::{ArrayExpectation, Clock, ErrorKind, SensorCodec, SensorDriver, SensorEvent};

const PERIOD: Duration = Duration::from_millis(10);

fn start() -> (SensorDriver, MemoryPort) {
    let (connector, port) = pair("sensor");
    let expect = ArrayExpectation {
        rig: "test".into(),
        array: "skin".into(),
        rows: 5,
        cols: 3,
        rate_hz: 100.0,
        least_counts: 0.0,
        full_scale_counts: 5000.0,
        simulated: false,
    };
    (SensorDriver::start(SensorCodec::AnySkin, Box::new(connector), expect, Clock::paused()), port)
}

fn bytes(field_ut: [f32; 3]) -> Vec<u8> {
    let magnetometers = [Magnetometer { temperature_c: 25.0, field_ut }; 5];
    anyskin::DecodedFrame { magnetometers }.encode()
}

/// Frames, one a period; the last falls on the present.
async fn stream(device: &mut DuplexStream, frames: usize) {
    for _ in 0..frames {
        sleep(PERIOD).await;
        device.write_all(&bytes([1.5, -2.5, 3.0])).await.unwrap();
    }
}

async fn frame(sensor: &mut SensorDriver) -> Frame {
    let event = sensor.next().await;
    let SensorEvent::Frame(frame) = event else { panic!("not a frame: {event:?}") };
    frame
}

async fn gap(sensor: &mut SensorDriver) -> u64 {
    let event = sensor.next().await;
    let SensorEvent::Gap(gap) = event else { panic!("not a gap: {event:?}") };
    gap.frames_lost
}

async fn lost(sensor: &mut SensorDriver) -> (ErrorKind, String) {
    let event = sensor.next().await;
    let SensorEvent::Lost(error) = event else { panic!("not lost: {event:?}") };
    (error.kind, error.to_string())
}

async fn connected(sensor: &mut SensorDriver) {
    let event = sensor.next().await;
    let SensorEvent::Connected(info) = event else { panic!("not connected: {event:?}") };
    assert_eq!((info.link.as_str(), info.tick_ns, info.rows, info.cols), ("anyskin", 0, 5, 3));
}

#[tokio::test(start_paused = true)]
async fn fields_come_by_magnetometer_and_axis_and_none_that_confirmed_the_stride_is_lost() {
    let (mut sensor, mut port) = start();
    let mut device = port.accept().await;
    device.write_all(&bytes([9.0; 3])[30..]).await.unwrap();
    stream(&mut device, 4).await;
    connected(&mut sensor).await;
    for seq in 0..4 {
        let frame = frame(&mut sensor).await;
        assert_eq!((frame.seq, frame.lost_before, frame.device_tick), (seq, 0, None));
        assert_eq!(frame.counts.chunks(3).collect::<Vec<_>>(), [[1.5, -2.5, 3.0]; 5]);
    }
}

#[tokio::test(start_paused = true)]
async fn a_damaged_frame_is_one_lost_and_garbage_is_none() {
    let (mut sensor, mut port) = start();
    let mut device = port.accept().await;
    stream(&mut device, 3).await;
    connected(&mut sensor).await;
    for _ in 0..3 {
        frame(&mut sensor).await;
    }
    sleep(PERIOD).await;
    device.write_all(&bytes([1.0; 3])[5..]).await.unwrap();
    stream(&mut device, 3).await;
    assert_eq!(gap(&mut sensor).await, 1);
    for seq in 4..7 {
        assert_eq!(frame(&mut sensor).await.seq, seq);
    }
    device.write_all(&[0xE5; 200]).await.unwrap();
    stream(&mut device, 3).await;
    for seq in 7..10 {
        assert_eq!(frame(&mut sensor).await.seq, seq, "there was no time for more");
    }
    sleep(5 * PERIOD).await;
    stream(&mut device, 2).await;
    assert_eq!(frame(&mut sensor).await.seq, 10);
    assert_eq!(gap(&mut sensor).await, 5, "the next is as late");
    assert_eq!(frame(&mut sensor).await.seq, 16);
}

#[tokio::test(start_paused = true)]
async fn a_magnetometer_that_says_no_number_is_not_read_and_one_at_its_end_is_saturated() {
    let (mut sensor, mut port) = start();
    let mut device = port.accept().await;
    stream(&mut device, 3).await;
    device.write_all(&bytes([f32::NAN, -5000.0, 1.0])).await.unwrap();
    connected(&mut sensor).await;
    for _ in 0..3 {
        assert!(frame(&mut sensor).await.bad_elements.is_empty());
    }
    let frame = frame(&mut sensor).await;
    assert_eq!(*frame.bad_elements, [0, 3, 6, 9, 12]);
    assert_eq!(frame.flags, FrameFlags::SATURATED.with(FrameFlags::BAD_ELEMENTS));
    assert_eq!(frame.counts[..3], [1.5, -5000.0, 1.0]);
}

#[tokio::test(start_paused = true)]
async fn unplugged_and_back_is_a_new_epoch_and_silence_a_timeout() {
    let (mut sensor, mut port) = start();
    let mut device = port.accept().await;
    stream(&mut device, 3).await;
    connected(&mut sensor).await;
    for _ in 0..3 {
        frame(&mut sensor).await;
    }
    let silent = Instant::now();
    let (kind, text) = lost(&mut sensor).await;
    assert_eq!((kind, silent.elapsed()), (ErrorKind::Timeout, Duration::from_secs(1)), "{text}");
    drop(device);
    assert_eq!(lost(&mut sensor).await.0, ErrorKind::Disconnected);
    assert_eq!(lost(&mut sensor).await.0, ErrorKind::Absent);
    let mut device = port.accept().await;
    let away = silent.elapsed();
    stream(&mut device, 3).await;
    connected(&mut sensor).await;
    // Three came at once when they were believed, so that only the time before them is a gap.
    let missed = (away.as_secs_f64() * 100.0).round();
    assert!((gap(&mut sensor).await as f64 - missed).abs() <= 1.0, "{away:?}");
    assert_eq!(frame(&mut sensor).await.epoch, 1);
}

#[tokio::test(start_paused = true)]
async fn another_device_is_named_after_two_seconds() {
    let (mut sensor, mut port) = start();
    let mut device = port.accept().await;
    let begun = Instant::now();
    let babble = tokio::spawn(async move {
        loop {
            device.write_all(&[b'x'; FRAME_BYTES]).await.unwrap();
            sleep(PERIOD).await;
        }
    });
    let (kind, text) = lost(&mut sensor).await;
    assert_eq!((kind, begun.elapsed()), (ErrorKind::Protocol, Duration::from_secs(2)));
    assert!(text.contains("no AnySkin frame for 2 s") && text.contains("bytes skipped"), "{text}");
    babble.abort();
}
