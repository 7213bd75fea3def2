use tactus_schema::pb;
use tokio::sync::broadcast::error::TryRecvError;

use super::*;

fn board() -> Board {
    let description = pb::RigDescription {
        col_centres_mm: vec![1.0, 3.0],
        row_centres_mm: vec![1.0],
        element_mm: vec![1.8, 1.8],
        origin_mm: vec![10.0, 20.0],
        baseline_counts: vec![100.0, 100.0],
        element_max_counts: 2000.0,
        ..Default::default()
    };
    let mut board = Board { rig: "bench".into(), ..Board::default() };
    board.on_health(pb::Health { simulated: true, t_wall_ns: 5, ..Default::default() });
    board.on_description(description);
    board.on_frame(pb::Frame { seq: 1, counts: vec![100.0, 350.0], ..Default::default() }, 0);
    board
}

fn channels(board: &Board) -> Channels {
    let mut channels = Channels::default();
    channels.tell(board);
    channels.on_frame(board);
    channels
}

fn subscribe(id: u32, channel: Channel) -> String {
    let wish = json!({ "id": id, "channelId": channel as u8 });
    json!({ "op": "subscribe", "subscriptions": [wish] }).to_string()
}

/// The subscription and the payload of each message.
fn data(messages: Vec<Message>) -> Vec<(u32, Vec<u8>)> {
    let one = |message: Message| {
        let bytes = message.into_data();
        assert_eq!(bytes[0], MESSAGE_DATA);
        (u32::from_le_bytes(bytes[1..5].try_into().unwrap()), bytes[13..].to_vec())
    };
    messages.into_iter().map(one).collect()
}

#[test]
fn who_subscribes_gets_the_present_and_then_what_follows_once() {
    let mut board = board();
    let mut channels = channels(&board);
    let mut viewer = Viewer::default();
    let (first, mut rest) = channels.join(&board);
    assert!(first[0].contains("Tactus bench (SIMULATED)"), "{first:?}");
    board.on_frame(pb::Frame { seq: 2, counts: vec![100.0, 350.0], ..Default::default() }, 0);
    channels.on_frame(&board);
    let present = data(viewer.on_request(&subscribe(7, Channel::Image), &channels, &board));
    // The last bytes of an image are its data but for the name of the frame.
    assert_eq!(present.len(), 1);
    assert_eq!(present[0].0, 7);
    assert!(present[0].1.windows(2).any(|pixels| pixels == [0, 255]), "white is the greatest rise");
    for _ in 0..2 {
        assert!(viewer.on_told(&rest.try_recv().unwrap()).is_empty(), "a frame that it has already");
    }
    board.on_frame(pb::Frame { seq: 3, counts: vec![100.0, 350.0], ..Default::default() }, 0);
    channels.on_frame(&board);
    let told: Vec<_> =
        (0..2).flat_map(|_| data(viewer.on_told(&rest.try_recv().unwrap()))).map(|(id, _)| id).collect();
    assert_eq!(told, [7], "the grid was not asked for");
    viewer.on_request(r#"{"op":"unsubscribe","subscriptionIds":[7]}"#, &channels, &board);
    board.on_frame(pb::Frame { seq: 4, counts: vec![100.0, 350.0], ..Default::default() }, 0);
    channels.on_frame(&board);
    assert!((0..2).all(|_| viewer.on_told(&rest.try_recv().unwrap()).is_empty()));
}

#[test]
fn a_slow_viewer_misses_the_oldest_and_is_told_how_many() {
    let board = board();
    let mut channels = channels(&board);
    let (_, mut rest) = channels.join(&board);
    for _ in 0..200 {
        channels.on_frame(&board);
    }
    let Err(TryRecvError::Lagged(missed)) = rest.try_recv() else { panic!("400 messages fit") };
    assert_eq!(missed, 400 - 256);
    let mut viewer = Viewer::default();
    let said = viewer.on_missed(missed).into_text().unwrap();
    assert!(said.contains("missed 144 messages"), "{said}");
    channels.on_missed(missed);
    let metrics = channels.metrics(&board);
    assert!(metrics.contains("tactus_viewer_messages_missed_total{rig=\"bench\"} 144"), "{metrics}");
    assert!(metrics.contains("tactus_viewers{rig=\"bench\"} 1"), "{metrics}");
}

#[test]
fn what_is_no_subscription_is_refused_in_words() {
    let board = board();
    let channels = channels(&board);
    let mut viewer = Viewer::default();
    for request in [
        "",
        "[]",
        r#"{"op":"setParameters","parameters":[]}"#,
        r#"{"op":"subscribe","subscriptions":[{"id":1,"channelId":9}]}"#,
        r#"{"op":"subscribe","subscriptions":[{"id":-1,"channelId":0}]}"#,
    ] {
        let [answer] = viewer.on_request(request, &channels, &board).try_into().unwrap();
        let text = answer.into_text().unwrap();
        assert!(text.contains(r#""op":"status""#) && text.contains(r#""level":2"#), "{text}");
    }
    let log = subscribe(1, Channel::Log);
    assert_eq!(viewer.on_request(&log, &channels, &board).len(), 1, "the line of the rig");
    let [again] = viewer.on_request(&log, &channels, &board).try_into().unwrap();
    assert!(again.into_text().unwrap().contains("there already"));
}
