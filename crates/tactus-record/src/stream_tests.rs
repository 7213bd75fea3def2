use std::io::Cursor;

use mcap::records::MessageHeader;
use tactus_schema::{Frame, MonoTime, TimeStamp, WallTime, key::Keys, pb};

use super::{ChannelWriter, Packing};
use crate::{
    Recorded,
    channel::{declare, library, unsigned},
    fixtures::with_header,
};

fn at(number: u64) -> TimeStamp {
    let ns = i64::try_from(number).unwrap() * 33_333_333;
    TimeStamp { mono: MonoTime::from_ns(ns), wall: WallTime::from_ns(7 + ns) }
}

fn frame(seq: u64) -> Frame {
    pb::Frame { seq, counts: vec![100.0; 48], ..pb::Frame::default() }.into()
}

/// Frames with a report of the stage after every third, and what else a chunk may hold.
fn ours(frames: u64) -> Vec<u8> {
    let mut writer = with_header(|header| ChannelWriter::packed(header, Packing::Plain)).unwrap();
    let mut bytes = Vec::new();
    for seq in 0..frames {
        writer.write(&frame(seq), seq, at(seq)).unwrap();
        if seq % 3 == 2 {
            writer.write(&pb::StageState::default(), seq, at(seq)).unwrap();
        }
        bytes.append(&mut writer.take_closed());
    }
    writer.finish().unwrap();
    bytes.append(&mut writer.take_closed());
    bytes
}

/// The same by the `mcap` crate. A chunk of half a second holds 16 frames.
fn theirs(frames: u64) -> Vec<u8> {
    let options = mcap::WriteOptions::new().compression(None).chunk_size(None).library(library());
    let mut writer = options.create(Cursor::new(Vec::new())).unwrap();
    let ids = with_header(|header| {
        writer.write_metadata(&header.metadata().to_record()).unwrap();
        for attachment in header.attachments() {
            let written = unsigned(attachment.written.ns());
            let data = attachment.data.into();
            let (name, media_type) = (attachment.name, attachment.media_type);
            let attachment =
                mcap::Attachment { log_time: written, create_time: written, name, media_type, data };
            writer.attach(&attachment).unwrap();
        }
        declare(&mut writer, &Keys::new(header.rig.name.clone())).unwrap()
    });
    writer.flush().unwrap();
    let put = |writer: &mut mcap::Writer<_>, channel_id, seq: u64, bytes: &[u8]| {
        let time = unsigned(at(seq).wall.ns());
        let sequence = u32::try_from(seq).unwrap();
        let header = MessageHeader { channel_id, sequence, log_time: time, publish_time: time };
        writer.write_to_known_channel(&header, bytes).unwrap();
    };
    for seq in 0..frames {
        if seq.is_multiple_of(16) {
            writer.flush().unwrap();
        }
        let mut bytes = Vec::new();
        Recorded::encode(&frame(seq), &mut bytes);
        put(&mut writer, ids[<Frame as Recorded>::KIND as usize], seq, &bytes);
        if seq % 3 == 2 {
            put(&mut writer, ids[<pb::StageState as Recorded>::KIND as usize], seq, &[]);
        }
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

#[test]
fn without_compression_a_recording_is_byte_for_byte_that_of_the_mcap_crate() {
    for frames in [0, 1, 16, 17, 100] {
        let (ours, theirs) = (ours(frames), theirs(frames));
        let differs = ours.iter().zip(&theirs).position(|(our, their)| our != their);
        assert_eq!((differs, ours.len()), (None, theirs.len()), "with {frames} frames");
    }
}

#[test]
fn a_chunk_that_grows_large_is_closed_before_its_time() {
    let mut writer = with_header(ChannelWriter::new).unwrap();
    writer.take_closed();
    let verdict = |text: &str| pb::SafetyEvent { detail: text.to_owned(), ..pb::SafetyEvent::default() };
    let long = verdict(&"a".repeat(100_000));
    for seq in 0..3 {
        writer.write(&long, seq, at(0)).unwrap();
        assert!(writer.take_closed().is_empty(), "message {seq}");
    }
    writer.write(&verdict(""), 3, at(0)).unwrap();
    assert!(!writer.take_closed().is_empty());
}

#[test]
fn recordings_in_many_threads_share_compressors_and_nothing_else() {
    let recorded = |elements: usize| {
        let mut writer = with_header(ChannelWriter::new).unwrap();
        for seq in 0..200 {
            let counts = (0..elements).map(|element| (element * 7) as f32 + seq as f32).collect();
            let frame: Frame = pb::Frame { seq, counts, ..pb::Frame::default() }.into();
            writer.write(&frame, seq, at(seq)).unwrap();
        }
        writer.finish().unwrap();
        writer.take_closed()
    };
    let alone: Vec<_> = (1..9).map(recorded).collect();
    let together: Vec<_> = std::thread::scope(|scope| {
        let threads: Vec<_> = (1..9).map(|elements| scope.spawn(move || recorded(elements))).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    assert!(alone == together);
}
