use std::{
    collections::BTreeMap,
    io::{self, Write},
    sync::{Arc, Mutex},
};

use mcap::McapError;
use tactus_schema::{Frame, MonoTime, Rig, TimeStamp, WallTime, pb};

use super::{CHUNK_SPAN, ChannelWriter};
use crate::{Entry, Header, Message, Reader, Script};

const RIG_TOML: &str = include_str!("../../../config/rigs/sim.toml");

/// Accepts bytes up to a limit, as a disk does, and shows them.
#[derive(Clone)]
struct Disk {
    bytes: Arc<Mutex<Vec<u8>>>,
    limit: usize,
}

impl Disk {
    fn new(limit: usize) -> Self {
        Self { bytes: Arc::default(), limit }
    }

    fn bytes(&self) -> Vec<u8> {
        self.bytes.lock().unwrap().clone()
    }
}

impl Write for Disk {
    fn write(&mut self, piece: &[u8]) -> io::Result<usize> {
        let mut bytes = self.bytes.lock().unwrap();
        if bytes.len() + piece.len() > self.limit {
            return Err(io::Error::from(io::ErrorKind::StorageFull));
        }
        bytes.extend_from_slice(piece);
        Ok(piece.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fn begin(disk: Disk) -> Result<ChannelWriter<Disk>, McapError> {
    let rig = Rig::from_toml(RIG_TOML).unwrap();
    let header = Header {
        run_id: "r1",
        experiment: "corners",
        who: "ada",
        rig: &rig,
        rig_toml: Some(RIG_TOML),
        link_toml: Some("schema = \"tactus.link/1\""),
        script: Script { name: "corners.star", source: "" },
        versions: &BTreeMap::new(),
        parameters_json: "{}",
        started: WallTime::from_ns(1),
        simulated: true,
    };
    ChannelWriter::new(disk, &header)
}

fn frame(seq: u64) -> Frame {
    pb::Frame { seq, counts: vec![100.0; 48], ..pb::Frame::default() }.into()
}

fn at(seq: u64) -> TimeStamp {
    TimeStamp { mono: MonoTime::from_ns(seq.cast_signed() * 33_333_333), wall: WallTime::from_ns(1) }
}

fn durable_frames(disk: &Disk) -> u64 {
    let bytes = disk.bytes();
    let is_frame =
        |entry: &io::Result<Entry>| matches!(entry, Ok(Entry::Message { message: Message::Frame(_), .. }));
    Reader::new(bytes.as_slice()).filter(is_frame).count() as u64
}

#[test]
fn a_killed_process_loses_at_most_one_chunk_span() {
    let disk = Disk::new(usize::MAX);
    let mut writer = begin(disk.clone()).unwrap();
    let spanned = u64::try_from(CHUNK_SPAN.as_millis() * 30 / 1000).unwrap() + 1;
    for seq in 0..100 {
        writer.write(&frame(seq), seq, at(seq)).unwrap();
        // A kill would leave what is on the disk now.
        let lost = seq + 1 - durable_frames(&disk);
        assert!(lost <= spanned, "{lost} frames at risk after frame {seq}");
    }
    writer.flush().unwrap();
    assert_eq!(durable_frames(&disk), 100);
}

#[test]
fn the_header_is_durable_before_the_first_message() {
    let disk = Disk::new(usize::MAX);
    let _writer = begin(disk.clone()).unwrap();
    let bytes = disk.bytes();
    let entries: Vec<Entry> = Reader::new(bytes.as_slice()).map(Result::unwrap).collect();
    assert!(matches!(&entries[0], Entry::Run(run) if run.run_id == "r1" && run.script == "corners.star"));
    let names: Vec<&str> = entries[1..]
        .iter()
        .map(|entry| {
            let Entry::Attachment(file) = entry else { panic!("{entry:?}") };
            file.name.as_str()
        })
        .collect();
    assert_eq!(
        names,
        ["rig.json", "rig.toml", "link.toml", "corners.star", "versions.json", "parameters.json"]
    );
}

#[test]
fn a_clock_that_runs_backwards_does_not_hold_messages_back() {
    let disk = Disk::new(usize::MAX);
    let mut writer = begin(disk.clone()).unwrap();
    writer.write(&frame(0), 0, at(1000)).unwrap();
    writer.write(&frame(1), 1, at(10)).unwrap();
    assert_eq!(durable_frames(&disk), 1);
}

#[test]
fn a_full_disk_fails_loudly_and_for_good() {
    let header_bytes = {
        let disk = Disk::new(usize::MAX);
        let _writer = begin(disk.clone()).unwrap();
        disk.bytes().len()
    };
    assert!(begin(Disk::new(header_bytes - 1)).is_err(), "the header did not fit");

    let disk = Disk::new(header_bytes + 2000);
    let mut writer = begin(disk.clone()).unwrap();
    let failed = (0..1000).find(|seq| writer.write(&frame(*seq), *seq, at(*seq)).is_err()).unwrap();
    assert!(failed > durable_frames(&disk));
    assert!(
        writer.write(&frame(failed + 1), failed + 1, at(failed + 1)).is_err(),
        "a failed recording takes nothing more"
    );
    assert!(writer.finish().is_err());
}
