use std::sync::Arc;
use std::time::Duration;

use tactus_schema::{DeviceTick, Frame, FrameFlags, pb};
use tactus_wire::declared::{Encoder, Format, RawFormat};
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream};
use tokio::time::{Instant, sleep};

use crate::transport::memory::{MemoryPort, pair};
use crate::{ArrayExpectation, Clock, ErrorKind, SensorCodec, SensorDriver, SensorEvent};

const COUNTED: &str = r#"
schema = "tactus.link/1"
name = "pair"
[frame]
bytes = 16
sync = [0xAA, 0x55]
[sequence]
offset = 2
width = 1
[timestamp]
offset = 4
width = 4
tick_ns = 1_000_000
[samples]
offset = 8
elements = 2
type = "u16"
bad = [65535]
[checksum]
kind = "crc32"
"#;

/// Neither a count nor a clock, and frames marked by two bytes only.
const BARE: &str = r#"
schema = "tactus.link/1"
name = "bare"
[frame]
bytes = 8
sync = [0xAA, 0x55]
[samples]
offset = 2
elements = 2
type = "u16"
[checksum]
kind = "crc16"
polynomial = 0x1021
init = 0
reflect = false
xorout = 0
"#;

fn format(toml: &str) -> Arc<Format> {
    Arc::new(toml::from_str::<RawFormat>(toml).unwrap().check().unwrap())
}

/// A device on its port, and the sensor that reads it.
struct TestBench {
    sensor: SensorDriver,
    port: MemoryPort,
    encoder: Encoder,
    format: Arc<Format>,
}

fn lab(toml: &str) -> TestBench {
    let (connector, port) = pair("sensor");
    let format = format(toml);
    let expect = ArrayExpectation {
        rig: "test".into(),
        array: "pair".into(),
        rows: 1,
        cols: 2,
        rate_hz: 30.0,
        least_counts: 0.0,
        full_scale_counts: 4095.0,
        simulated: false,
    };
    let codec = SensorCodec::Declared { format: Arc::clone(&format) };
    let sensor = SensorDriver::start(codec, Box::new(connector), expect, Clock::paused());
    TestBench { sensor, port, encoder: Encoder::new(Arc::clone(&format)), format }
}

impl TestBench {
    fn frame(&mut self, tick: u64, counts: [f32; 2]) -> Vec<u8> {
        self.encoder.encode(tick, &counts).unwrap().to_vec()
    }

    async fn send(&mut self, device: &mut DuplexStream, tick: u64) {
        let bytes = self.frame(tick, [7.0, 8.0]);
        device.write_all(&bytes).await.unwrap();
    }

    async fn connected(&mut self) -> pb::SensorInfo {
        let event = self.sensor.next().await;
        let SensorEvent::Connected(info) = event else { panic!("not connected: {event:?}") };
        *info
    }

    async fn read(&mut self) -> Frame {
        let event = self.sensor.next().await;
        let SensorEvent::Frame(frame) = event else { panic!("not a frame: {event:?}") };
        frame
    }

    async fn gap(&mut self) -> pb::Gap {
        let event = self.sensor.next().await;
        let SensorEvent::Gap(gap) = event else { panic!("not a gap: {event:?}") };
        gap
    }

    async fn lost(&mut self) -> (ErrorKind, String) {
        let event = self.sensor.next().await;
        let SensorEvent::Lost(error) = event else { panic!("not lost: {event:?}") };
        (error.kind, error.to_string())
    }
}

const PERIOD: Duration = Duration::from_micros(33_333);

#[tokio::test(start_paused = true)]
async fn connects_with_the_first_frame_and_counts_losses_by_the_devices_count() {
    let mut lab = lab(COUNTED);
    let mut device = lab.port.accept().await;
    lab.send(&mut device, 1000).await;
    let info = lab.connected().await;
    assert_eq!((info.link.as_str(), info.tick_ns), ("declared, pair", 1_000_000));
    let first = lab.read().await;
    assert_eq!((first.seq, first.epoch, first.flags), (0, 0, FrameFlags::NEW_EPOCH));
    assert_eq!(first.device_tick, Some(DeviceTick(1000)));
    assert_eq!(*first.counts, [7.0, 8.0]);
    assert!(!first.simulated);
    // Two frames never come, though the clock says three: the count is right.
    lab.frame(1033, [7.0, 8.0]);
    lab.frame(1067, [7.0, 8.0]);
    sleep(4 * PERIOD).await;
    lab.send(&mut device, 1134).await;
    let gap = lab.gap().await;
    assert_eq!((gap.frames_lost, gap.after_seq, gap.next_seq), (2, 0, 3));
    assert_eq!((lab.read().await.seq, first.epoch), (3, 0));
}

#[tokio::test(start_paused = true)]
async fn garbage_and_broken_frames_are_passed_over() {
    let mut lab = lab(COUNTED);
    let mut device = lab.port.accept().await;
    let mut bytes = vec![0xAA, 0x55, 1, 2, 0xAA];
    bytes.extend(lab.frame(0, [1.0, 2.0]));
    let mut broken = lab.frame(33, [3.0, 4.0]);
    broken[9] ^= 1;
    bytes.extend(broken);
    bytes.extend([0xAA; 40]);
    bytes.extend(lab.frame(67, [5.0, 6.0]));
    device.write_all(&bytes).await.unwrap();
    lab.connected().await;
    assert_eq!(*lab.read().await.counts, [1.0, 2.0]);
    assert_eq!(lab.gap().await.frames_lost, 1);
    assert_eq!(*lab.read().await.counts, [5.0, 6.0]);
}

#[tokio::test(start_paused = true)]
async fn a_frame_that_comes_twice_is_given_once() {
    let mut lab = lab(COUNTED);
    let mut device = lab.port.accept().await;
    let frame = lab.frame(0, [1.0, 2.0]);
    device.write_all(&[frame.clone(), frame].concat()).await.unwrap();
    lab.send(&mut device, 33).await;
    lab.connected().await;
    assert_eq!(lab.read().await.seq, 0);
    assert_eq!(lab.read().await.seq, 1);
}

#[tokio::test(start_paused = true)]
async fn an_element_that_is_not_read_is_named_and_stands_with_its_last_reading() {
    let mut lab = lab(COUNTED);
    let mut device = lab.port.accept().await;
    for (tick, counts) in [(0, [65_535.0, 8.0]), (33, [7.0, 65_535.0]), (67, [9.0, 10.0])] {
        let bytes = lab.frame(tick, counts);
        device.write_all(&bytes).await.unwrap();
    }
    lab.connected().await;
    let first = lab.read().await;
    assert_eq!((&*first.counts, &*first.bad_elements), (&[0.0, 8.0][..], &[0][..]));
    assert_eq!(first.flags, FrameFlags::NEW_EPOCH.with(FrameFlags::BAD_ELEMENTS), "and not saturated");
    let second = lab.read().await;
    assert_eq!((&*second.counts, &*second.bad_elements), (&[7.0, 8.0][..], &[1][..]));
    let third = lab.read().await;
    assert_eq!((&*third.counts, &*third.bad_elements), (&[9.0, 10.0][..], &[][..]));
    assert_eq!(third.flags, FrameFlags::default());
}

#[tokio::test(start_paused = true)]
async fn unplugged_and_back_is_a_new_epoch() {
    let mut lab = lab(COUNTED);
    let mut device = lab.port.accept().await;
    lab.send(&mut device, 70_000).await;
    lab.connected().await;
    lab.read().await;
    let unplugged = Instant::now();
    drop(device);
    assert_eq!(lab.lost().await.0, ErrorKind::Disconnected);
    assert_eq!(lab.lost().await.0, ErrorKind::Absent);
    sleep(Duration::from_millis(500)).await;
    let mut device = lab.port.accept().await;
    tokio::time::sleep_until(unplugged + Duration::from_micros(1_033_333)).await;
    lab.encoder = Encoder::new(Arc::clone(&lab.format));
    lab.send(&mut device, 3).await;
    lab.connected().await;
    assert_eq!(lab.gap().await.frames_lost, 30);
    let after = lab.read().await;
    assert_eq!((after.seq, after.epoch, after.device_tick), (31, 1, Some(DeviceTick(3))));
}

#[tokio::test(start_paused = true)]
async fn a_clock_that_is_set_is_a_new_epoch_and_no_loss() {
    for tick in [90_000, 5] {
        let mut lab = lab(COUNTED);
        let mut device = lab.port.accept().await;
        lab.send(&mut device, 1000).await;
        lab.connected().await;
        lab.read().await;
        sleep(PERIOD).await;
        lab.send(&mut device, tick).await;
        let frame = lab.read().await;
        assert_eq!((frame.seq, frame.epoch, frame.flags), (1, 1, FrameFlags::NEW_EPOCH), "{tick}");
    }
}

#[tokio::test(start_paused = true)]
async fn silence_is_told_after_a_second_and_the_count_goes_on_behind_it() {
    let mut lab = lab(COUNTED);
    let mut device = lab.port.accept().await;
    lab.send(&mut device, 0).await;
    lab.connected().await;
    lab.read().await;
    let stalled = Instant::now();
    let (kind, text) = lab.lost().await;
    assert_eq!((kind, stalled.elapsed()), (ErrorKind::Timeout, Duration::from_secs(1)));
    assert!(text.contains("nothing has come for 1 s"), "{text}");
    // 299 frames later the count of one byte has gone round once.
    for _ in 0..299 {
        lab.encoder.lose_frame();
    }
    tokio::time::sleep_until(stalled + Duration::from_secs(10)).await;
    lab.send(&mut device, 10_000).await;
    lab.connected().await;
    assert_eq!(lab.gap().await.frames_lost, 299);
    assert_eq!(lab.read().await.epoch, 0);
}

#[tokio::test(start_paused = true)]
async fn bytes_without_a_frame_are_another_protocol_and_told_with_what_was_met() {
    let mut lab = lab(COUNTED);
    let mut device = lab.port.accept().await;
    let begun = Instant::now();
    let babble = tokio::spawn(async move {
        loop {
            // Frames of the right kind whose checksum never holds, and other bytes.
            device.write_all(&[0xAA, 0x55, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 9, 9]).await.unwrap();
            sleep(Duration::from_millis(100)).await;
        }
    });
    let (kind, text) = lab.lost().await;
    assert_eq!((kind, begun.elapsed()), (ErrorKind::Protocol, Duration::from_secs(2)));
    for told in ["no frame of \"pair\" for 2 s", "bad checksums", "0 bad lengths", "`tactus link check"] {
        assert!(text.contains(told), "{text}");
    }
    babble.abort();
    assert_eq!(lab.lost().await.0, ErrorKind::Disconnected);
}

#[tokio::test(start_paused = true)]
async fn stale_frames_are_not_given_and_told_as_such() {
    let mut lab =
        lab(&COUNTED.replace("tick_ns = 1_000_000", "tick_ns = 1_000_000\nunchanged_is_stale = true"));
    let mut device = lab.port.accept().await;
    lab.send(&mut device, 0).await;
    lab.send(&mut device, 0).await;
    lab.send(&mut device, 33).await;
    lab.connected().await;
    assert_eq!(lab.read().await.device_tick, Some(DeviceTick(0)));
    let second = lab.read().await;
    assert_eq!((second.device_tick, second.seq), (Some(DeviceTick(33)), 1));
    let mut encoder = lab.encoder.clone();
    let repeating = tokio::spawn(async move {
        loop {
            device.write_all(encoder.encode(33, &[1.0, 2.0]).unwrap()).await.unwrap();
            sleep(PERIOD).await;
        }
    });
    let (kind, text) = lab.lost().await;
    assert_eq!(kind, ErrorKind::Timeout);
    assert!(text.contains("stands still"), "{text}");
    repeating.abort();
}

#[tokio::test(start_paused = true)]
async fn without_count_and_clock_the_hosts_clock_tells() {
    let mut lab = lab(BARE);
    let mut device = lab.port.accept().await;
    lab.send(&mut device, 0).await;
    assert_eq!(lab.connected().await.tick_ns, 0);
    assert_eq!(lab.read().await.device_tick, None);
    // Late, and caught up with: nothing is lost.
    sleep(2 * PERIOD).await;
    lab.send(&mut device, 0).await;
    lab.send(&mut device, 0).await;
    assert_eq!([lab.read().await.seq, lab.read().await.seq], [1, 2]);
    sleep(6 * PERIOD).await;
    lab.send(&mut device, 0).await;
    assert_eq!(lab.read().await.seq, 3);
    sleep(PERIOD).await;
    lab.send(&mut device, 0).await;
    assert_eq!(lab.gap().await.frames_lost, 5, "the next is as late");
    assert_eq!(lab.read().await.seq, 9);
    // One frame that was damaged is one that is missing.
    sleep(PERIOD).await;
    let broken = lab.frame(0, [1.0, 2.0]);
    device.write_all(&broken[..7]).await.unwrap();
    sleep(PERIOD).await;
    lab.send(&mut device, 0).await;
    assert_eq!(lab.gap().await.frames_lost, 1);
    assert_eq!(lab.read().await.seq, 11);
}

#[tokio::test(start_paused = true)]
async fn packets_are_frames_read_by_read() {
    let packets = BARE.replace("name = \"bare\"", "name = \"bare\"\nframing = \"packet\"");
    let mut lab = lab(&packets);
    let mut device = lab.port.accept().await;
    for packet in [lab.frame(0, [1.0, 2.0]), vec![0xAA; 7], lab.frame(0, [3.0, 4.0])] {
        device.write_all(&packet).await.unwrap();
        // In memory two packets would be one read; a device's transport keeps them apart.
        sleep(PERIOD).await;
    }
    lab.connected().await;
    assert_eq!(*lab.read().await.counts, [1.0, 2.0]);
    assert_eq!(lab.gap().await.frames_lost, 1);
    assert_eq!(*lab.read().await.counts, [3.0, 4.0]);
}

#[tokio::test(start_paused = true)]
async fn ticks_of_any_length_are_told_in_whole_ns() {
    for (tick_ns, told_ns, told_tick) in
        [("62.5", 1, 62_500), ("1000", 1000, 1000), ("16666666.67", 16_666_667, 1000), ("0.5", 1, 500)]
    {
        let mut lab = lab(&COUNTED.replace("1_000_000", tick_ns));
        let mut device = lab.port.accept().await;
        lab.send(&mut device, 1000).await;
        assert_eq!(lab.connected().await.tick_ns, told_ns, "{tick_ns}");
        assert_eq!(lab.read().await.device_tick, Some(DeviceTick(told_tick)), "{tick_ns}");
    }
}

#[tokio::test(start_paused = true)]
async fn the_link_is_closed_when_the_sensor_is_dropped() {
    let TestBench { sensor, mut port, .. } = lab(COUNTED);
    let mut device = port.accept().await;
    drop(sensor);
    let mut rest = Vec::new();
    device.read_to_end(&mut rest).await.unwrap();
    assert_eq!(rest, b"", "it is only listened to");
}
