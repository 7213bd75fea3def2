//! Whatever is described is refused, or works.

use std::sync::Arc;

use proptest::prelude::*;

use crate::declared::{
    ChecksumKind, Decoder, Encoder, Endian, Format, Framing, OrderName, RawChecksum, RawFormat, RawFrame,
    RawHid, RawLength, RawOrder, RawSamples, RawSequence, RawTimestamp, SCHEMA, SampleType, check_capture,
};

fn endian() -> impl Strategy<Value = Endian> {
    prop::sample::select(vec![Endian::Little, Endian::Big])
}

/// Mostly within a frame of this length, from either end.
fn offset(bytes: usize) -> impl Strategy<Value = i64> {
    let bytes = i64::try_from(bytes).unwrap();
    prop_oneof![9 => 0..bytes, 3 => -bytes..0, 1 => any::<i64>()]
}

fn samples(bytes: usize) -> impl Strategy<Value = RawSamples> {
    use SampleType::{F32, I16, U8, U12, U16, U32};
    let kind = prop::sample::select(vec![U8, U12, U16, I16, U32, F32]);
    let order = prop_oneof![
        2 => Just(RawOrder::Named(OrderName::RowMajor)),
        1 => Just(RawOrder::Named(OrderName::ColumnMajor)),
        1 => Just(RawOrder::Elements(vec![2, 0, 1, 3])),
    ];
    (offset(bytes), prop_oneof![4 => Just(4usize), 1 => 0..9usize], kind, endian(), order, any::<bool>())
        .prop_map(|(offset, elements, kind, endian, order, shape)| RawSamples {
            offset,
            elements,
            rows: shape.then_some(2),
            cols: shape.then_some(2),
            kind,
            endian,
            order,
            bad: vec![7.0],
        })
}

fn checksum(bytes: usize) -> impl Strategy<Value = RawChecksum> {
    use ChecksumKind::{Crc16, Crc32, None as Nothing, Sum8, Xor8};
    let kind = prop::sample::select(vec![Nothing, Sum8, Xor8, Crc16, Crc16, Crc32]);
    let ends = (prop::option::of(offset(bytes)), prop::option::of(offset(bytes)));
    (kind, prop_oneof![3 => Just(0), 1 => offset(bytes)], ends, endian(), any::<u16>(), any::<bool>())
        .prop_map(|(kind, from, (to, offset), endian, polynomial, reflect)| {
            let is_crc16 = kind == Crc16;
            RawChecksum {
                kind,
                from,
                to,
                offset,
                endian,
                polynomial: is_crc16.then_some(u32::from(polynomial) | 1),
                init: is_crc16.then_some(0xFFFF),
                reflect: is_crc16.then_some(reflect),
                xorout: is_crc16.then_some(0),
                check: None,
            }
        })
}

fn description() -> impl Strategy<Value = RawFormat> {
    (1..48usize).prop_flat_map(|bytes| {
        let marks = (prop::collection::vec(any::<u8>(), 0..4), prop::collection::vec(any::<u8>(), 0..2));
        let length = prop::option::of((offset(bytes), 0..9usize, endian(), -20..20i64));
        let sequence = prop::option::of((offset(bytes), 0..9usize, endian(), prop::option::of(any::<u64>())));
        let timestamp = prop::option::of((offset(bytes), 0..9usize, endian(), any::<f64>(), any::<bool>()));
        let rest =
            (samples(bytes), prop::option::of(checksum(bytes)), any::<bool>(), prop::option::of(any::<u8>()));
        (marks, length, sequence, timestamp, rest).prop_map(
            move |((sync, trailer), length, sequence, timestamp, (samples, checksum, packet, report_id))| {
                RawFormat {
                    schema: SCHEMA.into(),
                    name: "any".into(),
                    framing: if packet { Framing::Packet } else { Framing::Stream },
                    frame: RawFrame {
                        bytes,
                        sync,
                        trailer,
                        length: length.map(|(offset, width, endian, adds)| RawLength {
                            offset,
                            width,
                            endian,
                            adds,
                        }),
                    },
                    samples,
                    sequence: sequence.map(|(offset, width, endian, wrap)| RawSequence {
                        offset,
                        width,
                        endian,
                        wrap,
                    }),
                    timestamp: timestamp.map(|(offset, width, endian, tick_ns, unchanged_is_stale)| {
                        RawTimestamp {
                            offset,
                            width,
                            endian,
                            tick_ns: tick_ns.abs(),
                            wrap: None,
                            unchanged_is_stale,
                        }
                    }),
                    checksum,
                    hid: report_id.filter(|_| packet).map(|report_id| RawHid { report_id }),
                    usb: None,
                }
            },
        )
    })
}

fn decode(format: &Arc<Format>, pushes: &[&[u8]]) -> Vec<Vec<f32>> {
    let mut decoder = Decoder::new(Arc::clone(format));
    let mut counts = Vec::new();
    for push in pushes {
        decoder.push(push);
        while let Some(frame) = decoder.next_frame() {
            counts.push(frame.counts.to_vec());
        }
    }
    counts
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4000))]
    #[test]
    fn is_refused_or_works(raw in description(), noise: Vec<u8>, count in 0..200u8) {
        let Ok(format) = raw.check() else { return Ok(()) };
        let format = Arc::new(format);
        let reading = vec![f32::from(count); format.samples().elements()];
        let mut encoder = Encoder::new(Arc::clone(&format));
        let frame = encoder.encode(5, &reading).unwrap().to_vec();
        prop_assert_eq!(frame.len(), format.frame_bytes());
        // Twice, since sync bytes may have to decide.
        let again = encoder.encode(6, &reading).unwrap().to_vec();
        let found = decode(&format, &[&frame, &again, &frame]);
        prop_assert!(found.len() >= 2 && found.iter().all(|counts| *counts == reading), "{:?}", found);
        decode(&format, &[&noise, &frame]);
        check_capture(&format, &[&noise[..], &frame, &again].concat());
    }
}

#[test]
fn a_good_part_of_them_is_not_refused() {
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    let good = (0..2000).filter(|_| {
        let tree = description().new_tree(&mut runner).unwrap();
        proptest::strategy::ValueTree::current(&tree).check().is_ok()
    });
    let good = good.count();
    assert!(good > 100, "{good} of 2000");
}
