use tactus_schema::Rig;
use tactus_wire::weiss::{DecodedFrame, Decoder, Packet, acquire, query_controller, query_matrix};

use super::*;
use crate::faults::LinkFault;
use crate::test_bench::{DeviceBench, SIM_RIG, sim_rig};

fn switched_on(seed: u64) -> DeviceBench<VirtualSensor> {
    speaking(&SensorCodec::default(), seed)
}

fn speaking(codec: &SensorCodec, seed: u64) -> DeviceBench<VirtualSensor> {
    DeviceBench::new(&sim_rig(), seed, |world, now| VirtualSensor::new(world, codec, now))
}

/// Booted and pushing plain frames, with nothing unread.
fn pushing(seed: u64) -> DeviceBench<VirtualSensor> {
    let mut bench = switched_on(seed);
    bench.bytes(100);
    bench.send(&acquire(true, false, 30));
    bench.bytes(0);
    bench
}

/// What a host makes of bytes: frames, and how many checksums did not hold.
fn frames(bytes: &[u8]) -> (Vec<DecodedFrame>, u64) {
    let mut decoder = Decoder::new();
    decoder.push(bytes);
    let mut found = Vec::new();
    while let Some(packet) = decoder.next_packet() {
        if let Ok(packet) = packet
            && packet.id == id::FRAME
        {
            found.push(frame(&packet));
        }
    }
    (found, decoder.stats().bad_checksums)
}

fn frame(packet: &Packet<'_>) -> DecodedFrame {
    let elements = (packet.payload.len() - 5) / 2;
    DecodedFrame::parse(packet, elements).or_else(|_| DecodedFrame::parse(packet, 48)).unwrap()
}

fn timestamps_ms(bytes: &[u8]) -> Vec<u32> {
    frames(bytes).0.iter().map(|frame| frame.timestamp_ms).collect()
}

#[test]
fn it_boots_and_answers_only_then() {
    let mut bench = switched_on(1);
    bench.send(&query_controller());
    assert_eq!(bench.bytes(99), b"");
    assert_eq!(bench.bytes(1), b"\x1b[5n\x1b[5n\x1b[5n");
    assert_eq!(bench.bytes(1000), b"", "what was asked before is forgotten");
}

#[test]
fn it_says_what_it_is_to_the_byte() {
    let mut bench = switched_on(1);
    bench.bytes(100);
    bench.send(&query_controller());
    // Success, serial number "SIM", zeros.
    let payload = [&[0, 0, b'S', b'I', b'M', 0][..], &[0; 12]].concat();
    let reply = bench.bytes(0);
    assert_eq!(reply[..6], [0xAA, 0xAA, 0xAA, 1, 18, 0]);
    assert_eq!(reply[6..24], payload);
    bench.send(&query_matrix(0));
    let reply = bench.bytes(0);
    assert_eq!(reply[..6], [0xAA, 0xAA, 0xAA, 0x0B, 52, 0]);
    assert_eq!(reply[8..12], 1.8_f32.to_le_bytes());
    assert_eq!(reply[16..20], [8, 0, 6, 0], "columns and rows");
    assert_eq!(&reply[20..26], b"SIMULA");
    for (asked, error) in [(query_matrix(1), 24), (vec![0xAA, 0xAA, 0xAA, 0x77, 0, 0], 13)] {
        bench.send(&asked);
        assert_eq!(bench.bytes(0)[6..8], [error, 0]);
    }
}

#[test]
fn frames_are_sampled_on_an_exact_grid() {
    let mut bench = pushing(1);
    let start = bench.now;
    let chunks = bench.chunks(Duration::from_secs(10));
    assert_eq!(chunks.len(), 300);
    // Acquisition began at 100 ms, which is sampling 3 of the grid since power-up: the next is number 4.
    for (k, (at, bytes)) in (4_u32..).zip(&chunks) {
        let [sampled_ms] = timestamps_ms(bytes)[..] else { panic!("one frame at a time") };
        assert_eq!(sampled_ms, k * 1000 / 30);
        let since_start = *at - start + Duration::from_millis(100);
        assert!(since_start.abs_diff(Duration::from_secs(1) * k / 30) < Duration::from_micros(1));
    }
}

#[test]
fn no_sampling_is_passed_over_at_1_and_5_khz() {
    for rate_hz in [1_000_u16, 5_000] {
        let rig = SIM_RIG.replace("rate_hz = 30.0", &format!("rate_hz = {rate_hz}.0"));
        let rig = Rig::from_toml(&rig).unwrap();
        let sensor = |world, now| VirtualSensor::new(world, &SensorCodec::default(), now);
        let mut bench = DeviceBench::new(&rig, 1, sensor);
        bench.bytes(100);
        bench.send(&acquire(true, false, rate_hz));
        bench.bytes(0);
        let start = bench.now;
        let chunks = bench.chunks(Duration::from_secs(2));
        assert_eq!(chunks.len(), 2 * usize::from(rate_hz));
        for (k, (at, bytes)) in (1_u32..).zip(&chunks) {
            assert_eq!(timestamps_ms(bytes).len(), 1, "one frame at a time");
            let due = start + Duration::from_secs(1) * k / rate_hz.into();
            assert!(at.max(&due).duration_since(*at.min(&due)) < Duration::from_micros(1), "frame {k}");
        }
    }
}

#[test]
fn too_late_it_passes_over_what_it_has_not_sampled() {
    let mut bench = pushing(1);
    bench.now += Duration::from_secs(3);
    let stamps = timestamps_ms(&bench.bytes(0));
    assert_eq!((stamps.len(), stamps[0]), (31, 2100));
}

#[test]
fn one_seed_gives_the_same_bytes() {
    let ten_seconds = |seed| pushing(seed).bytes(10_000);
    assert_eq!(ten_seconds(1), ten_seconds(1));
    assert_ne!(ten_seconds(1), ten_seconds(2));
}

#[test]
fn frames_are_run_length_encoded_if_asked_and_slower_if_asked() {
    let mut bench = switched_on(1);
    bench.bytes(100);
    bench.send(&acquire(true, true, 10));
    let (found, _) = frames(&bench.bytes(1000));
    assert_eq!(found.len(), 10);
    assert!(found.iter().all(|frame| frame.run_length && frame.counts.len() == 48));
    bench.send(&acquire(false, false, 0));
    bench.bytes(0);
    assert_eq!(bench.bytes(1000), b"");
}

#[test]
fn faults_of_single_frames() {
    // Samplings 4 to 7 fall into the first 140 ms.
    let grid = [133, 166, 200, 233];
    let struck = |fault| {
        let mut bench = pushing(1);
        bench.fault(SensorFault::Link(fault));
        bench.bytes(140)
    };
    let [a, b, c, d] = grid;
    for (fault, left) in [
        (LinkFault::Drop(1), vec![b, c, d]),
        (LinkFault::DropFrames(2), vec![c, d]),
        (LinkFault::Duplicate, vec![a, a, b, c, d]),
        (LinkFault::Reorder, vec![b, a, c, d]),
        (LinkFault::Truncate, vec![b, c, d]),
        (LinkFault::WrongChecksum, vec![b, c, d]),
        (LinkFault::FlipBits(1), vec![b, c, d]),
        (LinkFault::Garbage(500), vec![a, b, c, d]),
        (LinkFault::Stall(Duration::from_millis(90)), vec![c, d]),
    ] {
        assert_eq!(timestamps_ms(&struck(fault)), left, "{fault:?}");
    }
    assert_eq!(frames(&struck(LinkFault::WrongChecksum)).1, 1);
    assert_eq!(struck(LinkFault::Garbage(500)).len(), 4 * 109 + 500);
    let lengths = |fault| frames(&struck(fault)).0.iter().map(|frame| frame.counts.len()).collect::<Vec<_>>();
    assert_eq!(lengths(LinkFault::WrongCount(47)), [47, 48, 48, 48]);
    assert_eq!(lengths(LinkFault::WrongCount(50)), [50, 48, 48, 48]);
}

#[test]
fn a_burst_comes_all_at_once() {
    let mut bench = pushing(1);
    bench.fault(SensorFault::Link(LinkFault::Burst(3)));
    let chunks = bench.chunks(Duration::from_millis(140));
    let sizes: Vec<_> = chunks.iter().map(|(_, bytes)| timestamps_ms(bytes).len()).collect();
    assert_eq!(sizes, [3, 1]);
}

#[test]
fn a_drip_is_the_same_bytes_one_at_a_time() {
    let mut bench = pushing(1);
    bench.fault(SensorFault::Link(LinkFault::Drip(Duration::from_secs(1))));
    let chunks = bench.chunks(Duration::from_secs(1));
    assert!(chunks.iter().filter(|(_, bytes)| bytes.len() == 1).count() >= 29 * 109);
    let bytes: Vec<u8> = chunks.into_iter().flat_map(|(_, bytes)| bytes).collect();
    assert_eq!(bytes[..109 * 28], pushing(1).bytes(1000)[..109 * 28]);
}

#[test]
fn the_clock_jumps_and_wraps() {
    let mut bench = pushing(1);
    bench.fault(SensorFault::ClockJump { ms: -50 });
    assert_eq!(timestamps_ms(&bench.bytes(70)), [83, 116]);
    bench.fault(SensorFault::ClockWrap);
    let stamps = timestamps_ms(&bench.bytes(2000));
    let wrap = stamps.iter().position(|stamp| *stamp < 1000).unwrap();
    assert!((29..=31).contains(&wrap), "{wrap}");
    assert!(stamps[wrap - 1] > u32::MAX - 34 && stamps[wrap] < 34);
}

#[test]
fn elements_stick_and_saturate_until_cleared() {
    let mut bench = pushing(1);
    bench.fault(SensorFault::Stuck(7));
    bench.fault(SensorFault::Saturate(8));
    let (found, _) = frames(&bench.bytes(2000));
    let stuck = found[0].counts[7];
    assert!(found.iter().all(|frame| frame.counts[7] == stuck && frame.counts[8] == 4095));
    bench.fault(SensorFault::Clear);
    let (found, _) = frames(&bench.bytes(2000));
    assert!(
        found.iter().any(|frame| frame.counts[7] != stuck) && found.iter().all(|frame| frame.counts[8] < 200)
    );
}

#[test]
fn unplugged_and_plugged_in_it_boots_again_with_a_new_clock() {
    let mut bench = pushing(1);
    bench.bytes(5000);
    bench.device.plugged_in(bench.now);
    assert_eq!(bench.bytes(200), b"\x1b[5n\x1b[5n\x1b[5n");
    bench.send(&acquire(true, false, 30));
    assert_eq!(timestamps_ms(&bench.bytes(60)), [233]);
}

#[test]
fn a_singletact_board_answers_by_address_and_says_that_it_is_simulated() {
    use tactus_wire::singletact::{Decoder, Operation, Request};
    fn ask(bench: &mut DeviceBench<VirtualSensor>, address: u8, operation: Operation<'_>) -> (bool, Vec<u8>) {
        bench.send(&Request { address, id: 7, operation }.encode().unwrap());
        let bytes = bench.bytes(0);
        let mut decoder = Decoder::new();
        decoder.push(&bytes);
        let reply = decoder.next_reply().unwrap();
        assert_eq!((reply.id, reply.address), (7, address));
        (reply.timed_out, reply.data.to_vec())
    }
    let codec = SensorCodec::SingleTact { addresses: vec![9, 10] };
    let mut bench = speaking(&codec, 1);
    let reading = Operation::Read { location: 128, bytes: 6 };
    assert_eq!(bench.bytes(100), b"", "it is asked");
    let (timed_out, data) = ask(&mut bench, 10, reading);
    assert!(!timed_out && (80..120).contains(&u16::from_be_bytes([data[4], data[5]])), "{data:?}");
    assert!(ask(&mut bench, 11, reading).0, "there is no such element");
    let (_, data) = ask(&mut bench, 9, Operation::Read { location: 0, bytes: 20 });
    assert_eq!(data, b"SIMULATED SIMULATED ");
    assert_eq!(ask(&mut bench, 9, Operation::Write { location: 5, data: &[1] }), (false, Vec::new()));
}

#[test]
fn an_older_controller_closes_its_packets_by_a_sum() {
    use tactus_wire::weiss::Checksum;
    let mut bench = speaking(&SensorCodec::WeissDsa { checksum: Checksum::Sum8 }, 1);
    bench.bytes(100);
    bench.send(&Checksum::Sum8.close(acquire(true, false, 30)));
    let mut decoder = Decoder::new().with_checksum(Checksum::Sum8);
    decoder.push(&bench.bytes(1000));
    let mut packets = 0;
    while let Some(packet) = decoder.next_packet() {
        packets += usize::from(packet.is_ok());
    }
    assert_eq!((packets, decoder.stats().skipped_bytes), (31, 0));
}

#[test]
fn a_drifting_clock_takes_its_samplings_along() {
    for (ppm, frames) in [(1000, 3003), (-1000, 2997)] {
        let mut bench = pushing(1);
        bench.fault(SensorFault::ClockDrift { ppm });
        let stamps = timestamps_ms(&bench.bytes(100_000));
        assert_eq!(stamps.len(), frames, "{ppm}");
        let steps_ms = stamps.windows(2).map(|pair| pair[1] - pair[0]);
        assert!(
            steps_ms.clone().all(|step_ms| step_ms == 33 || step_ms == 34),
            "{ppm}: its own rate is even"
        );
    }
}
