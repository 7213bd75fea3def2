use super::*;
use crate::descriptor::configuration;

#[test]
fn its_descriptors_to_the_byte() {
    let group = Bulk::new(Speed::High, 106).group(FirstNumbers { interface: 3, endpoint: 5 });
    let golden = [
        &[9, 2, 32, 0, 1, 1, 0, 0x80, 50][..],
        &[9, 4, 3, 0, 2, 0xFF, 0xFF, 0xFF, 0],
        &[7, 5, 0x85, 2, 0x00, 0x02, 0],
        &[7, 5, 0x05, 2, 0x00, 0x02, 0],
    ];
    assert_eq!(configuration(&[group]), golden.concat());
}

#[test]
fn each_frame_is_a_transfer_of_its_own() {
    let lengths = |frame_bytes: usize, frames: usize| {
        let packets = Bulk::new(Speed::High, frame_bytes).packets(&vec![0; frame_bytes * frames]);
        packets.iter().map(Vec::len).collect::<Vec<_>>()
    };
    assert_eq!(lengths(106, 2), [106, 106]);
    assert_eq!(lengths(512, 2), [512, 0, 512, 0]);
    assert_eq!(lengths(600, 1), [512, 88]);
}
