use proptest::prelude::*;

use super::{Endian, SampleType, Samples};

fn samples(kind: SampleType, endian: Endian, elements: usize) -> Samples {
    Samples { offset: 0, elements, kind, endian, places: None, bad: Vec::new() }
}

/// The bytes must read as these counts, and the counts be written as these bytes.
fn check(kind: SampleType, endian: Endian, bytes: &[u8], counts: &[f32]) {
    let samples = samples(kind, endian, counts.len());
    assert_eq!(samples.bytes(), bytes.len());
    let (mut wire, mut decoded) = (Vec::new(), Vec::new());
    samples.decode(bytes, &mut wire, &mut decoded);
    assert_eq!(decoded, counts);
    let mut encoded = vec![0; bytes.len()];
    samples.encode(counts, &mut encoded);
    assert_eq!(encoded, bytes);
}

#[test]
fn golden_bytes() {
    use Endian::{Big, Little};
    check(SampleType::U8, Little, &[0, 255], &[0., 255.]);
    check(SampleType::U16, Little, &[0x34, 0x12, 0xFF, 0xFF], &[4660., 65_535.]);
    check(SampleType::U16, Big, &[0x12, 0x34, 0xFF, 0xFF], &[4660., 65_535.]);
    check(SampleType::I16, Little, &[0xFE, 0xFF, 0x00, 0x80], &[-2., -32_768.]);
    check(SampleType::I16, Big, &[0xFF, 0xFE, 0x80, 0x00], &[-2., -32_768.]);
    check(SampleType::U32, Little, &[0x01, 0x00, 0x01, 0x00], &[65_537.]);
    check(SampleType::U32, Big, &[0x00, 0x01, 0x00, 0x01], &[65_537.]);
    check(SampleType::F32, Little, &[0, 0, 0x80, 0x3F], &[1.]);
    check(SampleType::F32, Big, &[0x3F, 0x80, 0, 0], &[1.]);
    check(
        SampleType::U12,
        Little,
        &[0xBC, 0x3A, 0x12, 0xFF, 0x0F],
        &[f32::from(0xABC_u16), f32::from(0x123_u16), 4095.],
    );
    check(
        SampleType::U12,
        Big,
        &[0xAB, 0xC1, 0x23, 0xFF, 0xF0],
        &[f32::from(0xABC_u16), f32::from(0x123_u16), 4095.],
    );
}

#[test]
fn counts_are_held_to_what_a_sample_can_be() {
    let mut bytes = [0; 3];
    samples(SampleType::U8, Endian::Little, 3).encode(&[-4.0, 17.6, 300.0], &mut bytes);
    assert_eq!(bytes, [0, 18, 255]);
    samples(SampleType::U12, Endian::Big, 2).encode(&[-1.0, 5000.0], &mut bytes);
    assert_eq!(bytes, [0, 0x0F, 0xFF]);
}

#[test]
fn places_are_looked_up() {
    let samples = Samples {
        places: Some(vec![2, 0, 1]),
        bad: vec![30.0],
        ..samples(SampleType::U8, Endian::Little, 3)
    };
    let (mut wire, mut counts, mut bad) = (Vec::new(), Vec::new(), Vec::new());
    samples.decode(&[10, 20, 30], &mut wire, &mut counts);
    assert_eq!(counts, [30., 10., 20.]);
    samples.find_bad(&counts, &mut bad);
    assert_eq!(bad, [0]);
    let mut bytes = [0; 3];
    samples.encode(&counts, &mut bytes);
    assert_eq!(bytes, [10, 20, 30]);
}

#[test]
fn what_is_no_number_is_bad() {
    let mut bad = Vec::new();
    samples(SampleType::F32, Endian::Little, 3).find_bad(&[1.0, f32::NAN, f32::INFINITY], &mut bad);
    assert_eq!(bad, [1, 2]);
}

proptest! {
    #[test]
    fn round_trip(
        kind in prop::sample::select(vec![
            SampleType::U8, SampleType::U12, SampleType::U16, SampleType::I16, SampleType::U32, SampleType::F32,
        ]),
        big: bool,
        counts in prop::collection::vec(0..4096u16, 1..40),
        shuffle in any::<prop::sample::Index>(),
    ) {
        let endian = if big { Endian::Big } else { Endian::Little };
        let greatest = if kind == SampleType::U8 { 255 } else { 4095 };
        let counts: Vec<f32> = counts.into_iter().map(|count| f32::from(count.min(greatest))).collect();
        let turn = shuffle.index(counts.len());
        let places = (0..counts.len()).map(|element| (element + turn) % counts.len()).collect();
        let samples = Samples { places: Some(places), offset: 3, ..samples(kind, endian, counts.len()) };
        let mut frame = vec![0xEE; samples.bytes() + 5];
        samples.encode(&counts, &mut frame);
        prop_assert_eq!(&frame[..3], [0xEE; 3]);
        prop_assert_eq!(&frame[samples.bytes() + 3..], [0xEE; 2]);
        let (mut wire, mut decoded) = (Vec::new(), Vec::new());
        samples.decode(&frame, &mut wire, &mut decoded);
        prop_assert_eq!(decoded, counts);
    }
}
