use tactus_schema::{MonoTime, TimeStamp, WallTime};

use super::{Message, MessageKind};
use crate::{Entry, Reader, fixtures::with_header, stream::ChannelWriter};

#[test]
fn every_kind_of_the_list_is_written_to_its_channel_and_read_back() {
    let mut writer = with_header(ChannelWriter::new).unwrap();
    let at = TimeStamp { mono: MonoTime::from_ns(1), wall: WallTime::from_ns(2) };
    for message in Message::empty() {
        message.write(&mut writer, at).unwrap();
    }
    writer.finish().unwrap();
    let bytes = writer.take_closed();

    let read: Vec<(String, Message)> = Reader::new(bytes.as_slice())
        .filter_map(|entry| match entry.unwrap() {
            Entry::Message { topic, message, .. } => Some((topic.to_string(), message)),
            Entry::Run(_) | Entry::Attachment(_) => None,
        })
        .collect();
    let written = MessageKind::ALL.into_iter().zip(Message::empty());
    let expected: Vec<(String, Message)> =
        written.map(|(kind, message)| (format!("tactus/sim/{}", kind.topic().suffix()), message)).collect();
    assert_eq!(read, expected);

    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let mut channels: Vec<_> = summary.channels.values().map(|channel| (channel.id, channel)).collect();
    channels.sort_by_key(|(id, _)| *id);
    let schemas = channels.iter().map(|(_, channel)| channel.schema.as_ref().unwrap().name.clone());
    assert_eq!(schemas.collect::<Vec<_>>(), MessageKind::ALL.map(MessageKind::schema));
}

#[test]
fn a_schema_that_is_not_listed_is_unknown() {
    assert_eq!(Message::decode("tactus.v9.Odour", &[1]).unwrap(), Message::Unknown("tactus.v9.Odour".into()));
}
