use std::time::Duration;

use tactus_schema::{DeviceTick, Frame, FrameFlags};
use tactus_wire::singletact::{Decoder, ElementReading, Reply, Via};
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream};
use tokio::time::sleep;

use crate::transport::memory::{MemoryPort, pair};
use crate::{ArrayExpectation, Clock, ErrorKind, SensorCodec, SensorDriver, SensorEvent};

fn start(addresses: &[u8]) -> (SensorDriver, MemoryPort) {
    let (connector, port) = pair("sensor");
    let expect = ArrayExpectation {
        rig: "test".into(),
        array: "single".into(),
        rows: 1,
        cols: addresses.len(),
        rate_hz: 50.0,
        least_counts: 0.0,
        full_scale_counts: 1023.0,
        simulated: false,
    };
    let codec = SensorCodec::SingleTact { addresses: addresses.to_vec() };
    (SensorDriver::start(codec, Box::new(connector), expect, Clock::paused()), port)
}

/// An interface board: answers each poll, but for elements that it does not reach.
struct Board {
    device: DuplexStream,
    decoder: Decoder,
    via: Via,
    missing: Option<u8>,
    /// Of all elements.
    counter: u16,
    ticks: u32,
}

impl Board {
    fn new(device: DuplexStream, via: Via) -> Self {
        Self { device, decoder: Decoder::new(), via, missing: None, counter: 0, ticks: 0 }
    }

    /// Answers so many polls; an element reads 100 and its address.
    async fn answer(&mut self, polls: usize) {
        let mut buffer = [0; 64];
        for _ in 0..polls {
            let (address, id) = loop {
                if let Some(request) = self.decoder.next_request() {
                    break (request.address, request.id);
                }
                let count = self.device.read(&mut buffer).await.unwrap();
                assert_ne!(count, 0, "the host has gone");
                self.decoder.push(&buffer[..count]);
            };
            self.counter = self.counter.wrapping_add(3);
            self.ticks += 100;
            let counts = 100 + u16::from(address);
            let data = ElementReading { counter: self.counter, counts }.encode();
            let reply = Reply {
                via: self.via,
                address,
                timed_out: self.missing == Some(address),
                id,
                timestamp_ticks: self.ticks,
                data: &data,
            };
            self.device.write_all(&reply.encode()).await.unwrap();
        }
    }
}

async fn frame(sensor: &mut SensorDriver) -> Frame {
    let event = sensor.next().await;
    let SensorEvent::Frame(frame) = event else { panic!("not a frame: {event:?}") };
    frame
}

async fn lost(sensor: &mut SensorDriver) -> (ErrorKind, String) {
    let event = sensor.next().await;
    let SensorEvent::Lost(error) = event else { panic!("not lost: {event:?}") };
    (error.kind, error.to_string())
}

async fn connected(sensor: &mut SensorDriver) {
    let event = sensor.next().await;
    let SensorEvent::Connected(info) = event else { panic!("not connected: {event:?}") };
    assert_eq!((info.link.as_str(), info.tick_ns), ("singletact", 100_000));
}

#[tokio::test(start_paused = true)]
async fn polls_every_element_for_a_frame_by_either_board() {
    for via in [Via::Arduino, Via::Usb] {
        let (mut sensor, mut port) = start(&[4, 9]);
        let mut board = Board::new(port.accept().await, via);
        board.device.write_all(b"hello\xFF\xFF\xAA").await.unwrap();
        board.answer(6).await;
        connected(&mut sensor).await;
        for seq in 0..3 {
            let frame = frame(&mut sensor).await;
            assert_eq!((frame.seq, frame.lost_before, &*frame.counts), (seq, 0, &[104.0, 109.0][..]));
            assert_eq!(frame.device_tick, Some(DeviceTick(200 * (seq + 1))));
            assert_eq!(frame.epoch, 0);
        }
    }
}

#[tokio::test(start_paused = true)]
async fn a_round_without_an_answer_is_a_frame_less() {
    let (mut sensor, mut port) = start(&[4]);
    let mut board = Board::new(port.accept().await, Via::Usb);
    board.answer(1).await;
    connected(&mut sensor).await;
    frame(&mut sensor).await;
    // The poll of 20 ms is given up after 250 ms; the next follows at once, 11 beats late.
    let mut unanswered = [0; 16];
    board.device.read_exact(&mut unanswered).await.unwrap();
    board.answer(1).await;
    let event = sensor.next().await;
    let SensorEvent::Gap(gap) = event else { panic!("not a gap: {event:?}") };
    assert_eq!(gap.frames_lost, 12);
    assert_eq!(frame(&mut sensor).await.seq, 13);
}

#[tokio::test(start_paused = true)]
async fn an_element_that_the_board_does_not_reach_is_named_in_the_frames() {
    let (mut sensor, mut port) = start(&[4, 9]);
    let mut board = Board::new(port.accept().await, Via::Arduino);
    board.answer(2).await;
    board.missing = Some(9);
    board.answer(8).await;
    connected(&mut sensor).await;
    assert_eq!(frame(&mut sensor).await.flags, FrameFlags::NEW_EPOCH);
    for _ in 0..3 {
        let frame = frame(&mut sensor).await;
        assert_eq!((&*frame.counts, &*frame.bad_elements), (&[104.0, 109.0][..], &[1][..]));
        assert_eq!(frame.flags, FrameFlags::BAD_ELEMENTS);
    }
}

#[tokio::test(start_paused = true)]
async fn the_last_element_that_is_lost_is_the_arrays_loss() {
    let (mut sensor, mut port) = start(&[4]);
    let mut board = Board::new(port.accept().await, Via::Arduino);
    board.missing = Some(4);
    board.answer(3).await;
    let (kind, text) = lost(&mut sensor).await;
    assert_eq!(kind, ErrorKind::DeviceFault);
    assert!(text.contains("the element at address 4 did not answer on the I2C bus"), "{text}");
    board.missing = None;
    board.answer(1).await;
    connected(&mut sensor).await;
    frame(&mut sensor).await;
}

#[tokio::test(start_paused = true)]
async fn silence_is_a_timeout_and_another_device_a_protocol() {
    let (mut sensor, mut port) = start(&[4]);
    let device = port.accept().await;
    let (kind, text) = lost(&mut sensor).await;
    assert_eq!(kind, ErrorKind::Timeout, "{text}");
    drop(device);
    assert_eq!(lost(&mut sensor).await.0, ErrorKind::Disconnected);

    let (mut sensor, mut port) = start(&[4]);
    let mut device = port.accept().await;
    let babble = tokio::spawn(async move {
        loop {
            device.write_all(b"temperature 21.5\r\n").await.unwrap();
            sleep(Duration::from_millis(100)).await;
        }
    });
    let (kind, text) = lost(&mut sensor).await;
    assert_eq!(kind, ErrorKind::Protocol);
    assert!(text.contains("no answer to a poll") && text.contains("bytes skipped"), "{text}");
    babble.abort();
}

#[tokio::test(start_paused = true)]
async fn unplugged_and_back_is_a_new_epoch() {
    let (mut sensor, mut port) = start(&[4]);
    let mut board = Board::new(port.accept().await, Via::Usb);
    board.answer(1).await;
    connected(&mut sensor).await;
    frame(&mut sensor).await;
    drop(board);
    assert_eq!(lost(&mut sensor).await.0, ErrorKind::Disconnected);
    assert_eq!(lost(&mut sensor).await.0, ErrorKind::Absent);
    let mut board = Board::new(port.accept().await, Via::Usb);
    board.answer(1).await;
    connected(&mut sensor).await;
    let mut event = sensor.next().await;
    if let SensorEvent::Gap(_) = event {
        event = sensor.next().await;
    }
    let SensorEvent::Frame(frame) = event else { panic!("not a frame: {event:?}") };
    assert_eq!(frame.epoch, 1);
}
