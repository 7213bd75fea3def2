#[path = "driver_tests/anyskin.rs"]
mod anyskin;
#[path = "driver_tests/declared.rs"]
mod declared;
#[path = "driver_tests/singletact.rs"]
mod singletact;

use std::fmt;
use std::sync::Mutex;
use std::time::Duration;

use futures_util::FutureExt;
use futures_util::future::BoxFuture;
use tactus_schema::{DeviceTick, Frame, FrameFlags, pb};
use tactus_wire::weiss::{
    BOOT_MESSAGE, ControllerInfo, Decoder, ErrorCode, HostCommand, MatrixInfo, SensorInfo, acknowledge,
    encode_frame, id,
};
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt, DuplexStream};
use tokio::time::{Instant, sleep};
use tokio_serial::{SerialPort, SerialStream};

use super::{ArrayExpectation, EVENTS_MAX, SensorDriver};
use crate::transport::memory::{MemoryPort, pair};
use crate::transport::serial::SerialConnector;
use crate::transport::{ByteStream, Connect};
use crate::{Clock, DeviceError, ErrorKind, SensorCodec, SensorEvent};

fn expectation() -> ArrayExpectation {
    ArrayExpectation {
        rig: "test".into(),
        array: "pair".into(),
        rows: 1,
        cols: 2,
        rate_hz: 30.0,
        least_counts: 0.0,
        full_scale_counts: 4095.0,
        simulated: true,
    }
}

fn start() -> (SensorDriver, MemoryPort) {
    let (connector, port) = pair("sensor");
    (SensorDriver::start(SensorCodec::default(), Box::new(connector), expectation(), Clock::paused()), port)
}

/// Answers a host as the controller does, until it is told to push frames.
async fn greet(stream: &mut (impl AsyncRead + AsyncWrite + Unpin)) {
    let mut decoder = Decoder::new();
    let mut buffer = [0; 256];
    loop {
        while let Some(packet) = decoder.next_packet() {
            let command = HostCommand::parse(&packet.unwrap()).unwrap();
            let reply = match command {
                HostCommand::QueryController => ControllerInfo::default().encode(),
                HostCommand::QuerySensor => SensorInfo::default().encode(),
                HostCommand::QueryMatrix { matrix: _ } => MatrixInfo::default().encode(),
                HostCommand::Acquire { .. } => acknowledge(id::ACQUIRE, ErrorCode::SUCCESS),
            };
            stream.write_all(&reply).await.unwrap();
            if let HostCommand::Acquire { run: true, fps, .. } = command {
                assert_eq!(fps, 30);
                return;
            }
        }
        let count = stream.read(&mut buffer).await.unwrap();
        assert_ne!(count, 0, "the host has gone");
        decoder.push(&buffer[..count]);
    }
}

async fn plug_in(port: &mut MemoryPort) -> DuplexStream {
    let mut stream = port.accept().await;
    greet(&mut stream).await;
    stream
}

async fn send(stream: &mut DuplexStream, timestamp_ms: u32) {
    stream.write_all(&encode_frame(timestamp_ms, &[7, 8], false)).await.unwrap();
}

async fn frame(sensor: &mut SensorDriver) -> Frame {
    let event = sensor.next().await;
    let SensorEvent::Frame(frame) = event else { panic!("not a frame: {event:?}") };
    frame
}

async fn gap(sensor: &mut SensorDriver) -> pb::Gap {
    let event = sensor.next().await;
    let SensorEvent::Gap(gap) = event else { panic!("not a gap: {event:?}") };
    gap
}

async fn connected(sensor: &mut SensorDriver) -> pb::SensorInfo {
    let event = sensor.next().await;
    let SensorEvent::Connected(info) = event else { panic!("not connected: {event:?}") };
    *info
}

async fn lost(sensor: &mut SensorDriver) -> (ErrorKind, String) {
    let event = sensor.next().await;
    let SensorEvent::Lost(error) = event else { panic!("not lost: {event:?}") };
    (error.kind, error.to_string())
}

#[tokio::test(start_paused = true)]
async fn tells_what_is_there_and_gives_frames() {
    let (mut sensor, mut port) = start();
    let mut device = plug_in(&mut port).await;
    send(&mut device, 1000).await;
    let info = connected(&mut sensor).await;
    assert_eq!((info.rig.as_str(), info.array.as_str(), info.rows, info.cols), ("test", "pair", 1, 2));
    assert_eq!(
        (info.link.as_str(), info.transport.as_str(), info.tick_ns),
        ("weiss-dsa", "memory:sensor", 1_000_000)
    );
    let first = frame(&mut sensor).await;
    assert_eq!((first.seq, first.epoch, first.flags), (0, 0, FrameFlags::NEW_EPOCH));
    assert_eq!(first.device_tick, Some(DeviceTick(1000)));
    assert_eq!(*first.counts, [7.0, 8.0]);
    assert!(first.simulated);
    sleep(Duration::from_millis(33)).await;
    send(&mut device, 1033).await;
    let second = frame(&mut sensor).await;
    assert_eq!((second.seq, second.lost_before, second.flags), (1, 0, FrameFlags::default()));
    assert_eq!(second.received.mono.since(first.received.mono), Duration::from_millis(33));
}

#[tokio::test(start_paused = true)]
async fn lost_frames_are_told_before_the_frame_that_follows() {
    let (mut sensor, mut port) = start();
    let mut device = plug_in(&mut port).await;
    send(&mut device, 0).await;
    send(&mut device, 133).await;
    connected(&mut sensor).await;
    frame(&mut sensor).await;
    let gap = gap(&mut sensor).await;
    assert_eq!((gap.frames_lost, gap.after_seq, gap.next_seq), (3, 0, 4));
    let next = frame(&mut sensor).await;
    assert_eq!((next.seq, next.lost_before, next.flags), (4, 3, FrameFlags::GAP_BEFORE));
}

#[tokio::test(start_paused = true)]
async fn two_seconds_unplugged_are_sixty_frames() {
    let (mut sensor, mut port) = start();
    let mut device = plug_in(&mut port).await;
    send(&mut device, 50_000).await;
    connected(&mut sensor).await;
    let before = frame(&mut sensor).await;
    let unplugged = Instant::now();
    drop(device);
    assert_eq!(lost(&mut sensor).await.0, ErrorKind::Disconnected);
    assert_eq!(lost(&mut sensor).await.0, ErrorKind::Absent);
    // Back in time for the host to find it, and then to send its first frame 61 periods after the last.
    sleep(Duration::from_millis(500)).await;
    let mut device = plug_in(&mut port).await;
    tokio::time::sleep_until(unplugged + Duration::from_micros(2_033_333)).await;
    send(&mut device, 17).await;
    connected(&mut sensor).await;
    let gap = gap(&mut sensor).await;
    assert_eq!((gap.frames_lost, gap.after_seq, gap.next_seq), (60, 0, 61));
    assert_eq!(gap.reason, "the device was connected anew");
    let after = frame(&mut sensor).await;
    assert_eq!((after.seq, after.epoch), (61, before.epoch + 1));
    assert_eq!(after.flags, FrameFlags::NEW_EPOCH.with(FrameFlags::GAP_BEFORE));
    send(&mut device, 50).await;
    assert_eq!(frame(&mut sensor).await.seq, 62);
}

#[tokio::test(start_paused = true)]
async fn a_device_that_is_not_there_is_told_once_and_found_within_a_second() {
    let (connector, mut port) = pair("sensor");
    port.unplug();
    let mut sensor =
        SensorDriver::start(SensorCodec::default(), Box::new(connector), expectation(), Clock::paused());
    assert_eq!(lost(&mut sensor).await.0, ErrorKind::Absent);
    sleep(Duration::from_mins(1)).await;
    let plugged_in = Instant::now();
    let mut device = plug_in(&mut port).await;
    assert!(plugged_in.elapsed() <= Duration::from_secs(1));
    send(&mut device, 0).await;
    connected(&mut sensor).await;
    frame(&mut sensor).await;
}

#[tokio::test(start_paused = true)]
async fn another_array_is_named_with_both_numbers() {
    let (mut sensor, mut port) = start();
    let mut device = plug_in(&mut port).await;
    device.write_all(&encode_frame(0, &[1; 486], false)).await.unwrap();
    let (kind, text) = lost(&mut sensor).await;
    assert_eq!(kind, ErrorKind::Protocol);
    assert_eq!(
        text,
        "sensor on memory:sensor: the frame has 486 elements, the rig's array has 2: \
         is it the sensor that the rig file describes?"
    );
}

#[tokio::test(start_paused = true)]
async fn the_end_of_the_range_is_marked() {
    let (mut sensor, mut port) = start();
    let mut device = plug_in(&mut port).await;
    device.write_all(&encode_frame(0, &[4094, 100], false)).await.unwrap();
    device.write_all(&encode_frame(33, &[4095, 100], false)).await.unwrap();
    connected(&mut sensor).await;
    assert!(!frame(&mut sensor).await.flags.contains(FrameFlags::SATURATED));
    assert_eq!(frame(&mut sensor).await.flags, FrameFlags::SATURATED);
}

#[tokio::test(start_paused = true)]
async fn so_is_the_other_end() {
    let (connector, mut port) = pair("sensor");
    let expect = ArrayExpectation { least_counts: 20.0, ..expectation() };
    let mut sensor =
        SensorDriver::start(SensorCodec::default(), Box::new(connector), expect, Clock::paused());
    let mut device = plug_in(&mut port).await;
    device.write_all(&encode_frame(0, &[21, 100], false)).await.unwrap();
    device.write_all(&encode_frame(33, &[20, 100], false)).await.unwrap();
    connected(&mut sensor).await;
    assert!(!frame(&mut sensor).await.flags.contains(FrameFlags::SATURATED));
    assert_eq!(frame(&mut sensor).await.flags, FrameFlags::SATURATED);
}

#[tokio::test(start_paused = true)]
async fn frames_that_come_twice_or_late_are_dropped() {
    let (mut sensor, mut port) = start();
    let mut device = plug_in(&mut port).await;
    for timestamp_ms in [0, 0, 67, 33, 67, 100] {
        send(&mut device, timestamp_ms).await;
    }
    connected(&mut sensor).await;
    assert_eq!(frame(&mut sensor).await.seq, 0);
    assert_eq!(gap(&mut sensor).await.frames_lost, 1);
    assert_eq!(frame(&mut sensor).await.seq, 2);
    assert_eq!(frame(&mut sensor).await.seq, 3);
}

#[tokio::test(start_paused = true)]
async fn a_stall_is_told_after_a_second_and_counted_by_the_devices_clock() {
    let (mut sensor, mut port) = start();
    let mut device = plug_in(&mut port).await;
    send(&mut device, 0).await;
    connected(&mut sensor).await;
    let before = frame(&mut sensor).await;
    let stalled = Instant::now();
    assert_eq!(lost(&mut sensor).await.0, ErrorKind::Timeout);
    assert_eq!(stalled.elapsed(), Duration::from_secs(1));
    sleep(Duration::from_secs(4)).await;
    send(&mut device, 2033).await;
    connected(&mut sensor).await;
    assert_eq!(gap(&mut sensor).await.frames_lost, 60);
    let after = frame(&mut sensor).await;
    assert_eq!((after.seq, after.epoch), (61, before.epoch));
}

#[tokio::test(start_paused = true)]
async fn a_restart_is_a_new_epoch() {
    let (mut sensor, mut port) = start();
    let mut device = plug_in(&mut port).await;
    send(&mut device, 90_000).await;
    connected(&mut sensor).await;
    frame(&mut sensor).await;
    device.write_all(BOOT_MESSAGE).await.unwrap();
    let (kind, text) = lost(&mut sensor).await;
    assert_eq!(
        (kind, text.as_str()),
        (ErrorKind::Disconnected, "sensor on memory:sensor: the controller has restarted")
    );
    greet(&mut device).await;
    sleep(Duration::from_millis(100)).await;
    send(&mut device, 5).await;
    connected(&mut sensor).await;
    assert_eq!(gap(&mut sensor).await.frames_lost, 2);
    assert_eq!(frame(&mut sensor).await.epoch, 1);
}

#[tokio::test(start_paused = true)]
async fn a_reader_that_falls_behind_is_told_how_many_it_missed() {
    let (mut sensor, mut port) = start();
    let mut device = plug_in(&mut port).await;
    let sent = 2 * EVENTS_MAX as u64;
    for frame in 0..sent {
        send(&mut device, u32::try_from(frame * 1000 / 30).unwrap()).await;
        tokio::task::yield_now().await;
    }
    sleep(Duration::from_millis(10)).await;
    connected(&mut sensor).await;
    let mut taken = 0;
    // One event is the connection, and a frame needs room for a gap.
    for seq in 0..EVENTS_MAX as u64 - 2 {
        assert_eq!(frame(&mut sensor).await.seq, seq);
        taken += 1;
    }
    send(&mut device, u32::try_from(sent * 1000 / 30).unwrap()).await;
    let gap = gap(&mut sensor).await;
    assert_eq!((gap.frames_lost, gap.next_seq), (sent - taken, sent));
    assert_eq!(gap.reason, "the service was too slow to take them");
    assert_eq!(frame(&mut sensor).await.seq, sent);
}

#[tokio::test(start_paused = true)]
async fn the_link_is_closed_when_the_sensor_is_dropped() {
    let (sensor, mut port) = start();
    let mut device = plug_in(&mut port).await;
    drop(sensor);
    let mut rest = Vec::new();
    device.read_to_end(&mut rest).await.unwrap();
}

/// A port that has been opened already, the first time.
struct Opened(Mutex<Option<Box<dyn ByteStream>>>, SerialConnector);

impl Connect for Opened {
    fn connect(&self) -> BoxFuture<'_, Result<Box<dyn ByteStream>, DeviceError>> {
        match self.0.lock().unwrap().take() {
            Some(stream) => std::future::ready(Ok(stream)).boxed(),
            None => self.1.connect(),
        }
    }
}

impl fmt::Display for Opened {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.1.fmt(f)
    }
}

#[tokio::test]
async fn works_on_a_real_pseudo_terminal() {
    let (mut device, far) = SerialStream::pair().unwrap();
    let connector = SerialConnector::new(far.name().unwrap(), 115_200);
    drop(far);
    // Reading from this end fails until the other is open.
    let opened = Opened(Mutex::new(Some(connector.connect().await.unwrap())), connector);
    let mut sensor =
        SensorDriver::start(SensorCodec::default(), Box::new(opened), expectation(), Clock::real());
    greet(&mut device).await;
    for timestamp_ms in [0, 33, 67] {
        device.write_all(&encode_frame(timestamp_ms, &[0x0AAA, 27], false)).await.unwrap();
    }
    connected(&mut sensor).await;
    for seq in 0..3 {
        let frame = frame(&mut sensor).await;
        assert_eq!((frame.seq, frame.lost_before), (seq, 0));
        assert_eq!(*frame.counts, [2730.0, 27.0]);
    }
    drop(device);
    assert_eq!(lost(&mut sensor).await.0, ErrorKind::Disconnected);
}
