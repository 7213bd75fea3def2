use tactus_wire::declared::{Decoder, RawFormat};

use super::*;
use crate::bench::{Bench, sim_rig};

fn format() -> Arc<Format> {
    let raw: RawFormat = toml::from_str(include_str!("../../../config/links/digitacts-hid.toml")).unwrap();
    Arc::new(raw.check().unwrap())
}

fn switched_on() -> Bench<DeclaredSensor> {
    Bench::new(&sim_rig(), 1, |world, now| DeclaredSensor::new(world, format(), now).unwrap())
}

/// Counts of each frame, and what of its numbers was missing before it.
fn frames(bytes: &[u8]) -> Vec<(u64, Vec<f32>)> {
    let mut decoder = Decoder::new(format());
    bytes
        .chunks(format().frame_bytes())
        .map(|report| {
            decoder.push(report);
            let frame = decoder.next_frame().expect("each report is a frame");
            (frame.tick.unwrap(), frame.counts.to_vec())
        })
        .collect()
}

#[test]
fn it_sends_frames_unasked_on_an_exact_grid() {
    let found = frames(&switched_on().bytes(1000));
    let ticks: Vec<_> = found.iter().map(|(tick, _)| *tick).collect();
    assert_eq!(ticks, (1..=30).map(|number| number * 1000 / 30).collect::<Vec<u64>>());
    assert!(found.iter().all(|(_, counts)| counts.len() == 48 && counts.iter().all(|count| *count > 0.0)));
}

#[test]
fn it_says_nothing_for_a_while_and_drops_frames() {
    let mut bench = switched_on();
    bench.fault(SensorFault::Link(LinkFault::DropFrames(3)));
    assert_eq!(frames(&bench.bytes(200))[0].0, 133);
    bench.fault(SensorFault::Link(LinkFault::Stall(Duration::from_secs(1))));
    assert_eq!(bench.bytes(999), b"");
    assert_eq!(frames(&bench.bytes(20)).len(), 1);
}

#[test]
fn too_late_it_passes_over_what_it_has_not_sampled() {
    let mut bench = switched_on();
    bench.now += Duration::from_secs(3);
    let ticks: Vec<_> = frames(&bench.bytes(0)).iter().map(|(tick, _)| *tick).collect();
    assert_eq!((ticks.len(), ticks[0]), (31, 2000));
}

#[test]
fn elements_stick_and_saturate_until_cleared() {
    let mut bench = switched_on();
    bench.bytes(100);
    bench.fault(SensorFault::Stuck(7));
    bench.fault(SensorFault::Saturate(8));
    let found = frames(&bench.bytes(1000));
    let of = |element: usize| found.iter().map(move |(_, counts)| counts[element].to_bits());
    let stuck = of(7).next();
    assert!(of(7).all(|count| Some(count) == stuck) && of(8).all(|count| count == 4095_f32.to_bits()));
    bench.fault(SensorFault::Clear);
    assert!(frames(&bench.bytes(1000)).iter().all(|(_, counts)| counts[8] < 200.0));
}

#[test]
fn plugged_in_again_its_clock_begins_at_zero() {
    let mut bench = switched_on();
    bench.bytes(500);
    bench.fault(SensorFault::ClockJump { ms: 5000 });
    assert_eq!(frames(&bench.bytes(34))[0].0, 5533);
    bench.device.plugged_in(bench.now);
    assert_eq!(frames(&bench.bytes(40))[0].0, 33);
}

#[test]
fn a_format_of_another_array_is_refused() {
    let text = include_str!("../../../config/links/pr2-fingertip.toml");
    let raw: RawFormat = toml::from_str(text).unwrap();
    let (bench, other) = (switched_on(), Arc::new(raw.check().unwrap()));
    let error = DeclaredSensor::new(bench.world.clone(), other, bench.now).unwrap_err();
    assert_eq!(
        error.to_string(),
        "the link file \"pr2-fingertip\" describes 22 elements, and the rig's array has 48; choose another of either"
    );
}

#[test]
fn faults_that_well_formed_frames_cannot_have_are_not_taken() {
    assert!(DeclaredSensor::takes(SensorFault::Link(LinkFault::DropFrames(1))));
    assert!(!DeclaredSensor::takes(SensorFault::Link(LinkFault::Truncate)));
    assert!(!DeclaredSensor::takes(SensorFault::ClockWrap));
}
