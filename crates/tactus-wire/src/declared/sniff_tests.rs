use std::sync::Arc;

use proptest::prelude::*;

use super::propose;
use crate::declared::{Encoder, RawFormat};

/// Noise that is the same in every run.
pub(crate) fn noise(seed: u32) -> impl FnMut() -> u8 {
    let mut state = seed.wrapping_mul(2_654_435_761) | 1;
    move || {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        state.to_le_bytes()[1]
    }
}

/// Frames of a shipped description, at rest: counts with a little noise.
fn recording(name: &str, frames: u32) -> Vec<u8> {
    let path = format!("{}/../../config/links/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    let format =
        toml::from_str::<RawFormat>(&std::fs::read_to_string(path).unwrap()).unwrap().check().unwrap();
    let elements = format.samples().elements();
    let mut encoder = Encoder::new(Arc::new(format));
    let mut noise = noise(frames);
    let mut recording = Vec::new();
    for frame in 0..frames {
        let counts: Vec<f32> = (0..elements).map(|_| f32::from(100 + noise() % 8)).collect();
        recording.extend_from_slice(encoder.encode(u64::from(frame) * 33 + 5000, &counts).unwrap());
    }
    recording
}

#[test]
fn the_kit_s_description_is_found_again() {
    for begin in [0, 50] {
        let recording = recording("digitacts", 40);
        let proposals = propose(&recording[begin..]);
        let best = &proposals[0];
        assert_eq!((best.stride, &best.sync[..2]), (106, &[0xAA, 0x55][..]), "{proposals:?}");
        assert_eq!(best.first_at, (106 - begin) % 106);
        assert!(best.counters.contains(&3), "{best:?}");
        assert!(best.constant.starts_with(&[0, 1, 2]), "{best:?}");
    }
}

#[test]
fn noise_has_no_stride() {
    let mut noise = noise(7);
    let bytes: Vec<u8> = core::iter::repeat_with(&mut noise).take(2000).collect();
    assert_eq!(propose(&bytes), []);
    assert_eq!(propose(&[]), []);
    assert_eq!(propose(&[7; 1000]), []);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]
    #[test]
    fn any_bytes_are_looked_at(bytes in prop::collection::vec(0..4u8, 0..300)) {
        for proposal in propose(&bytes) {
            prop_assert!(proposal.stride <= bytes.len() / 3);
            prop_assert!(bytes[proposal.first_at..].starts_with(&proposal.sync));
        }
    }
}
