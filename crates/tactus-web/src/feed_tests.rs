use tokio::sync::broadcast::error::TryRecvError;

use super::*;

fn frame(seq: u64) -> pb::Frame {
    pb::Frame { seq, t_wall_ns: i64::try_from(seq).unwrap(), counts: vec![100.0; 4], ..Default::default() }
}

fn kinds(messages: &mut broadcast::Receiver<Bytes>) -> Vec<String> {
    let mut kinds = Vec::new();
    while let Ok(message) = messages.try_recv() {
        let text = String::from_utf8(message.to_vec()).unwrap();
        assert!(text.ends_with("\n\n") && text.lines().count() == 3, "{text}");
        kinds.push(text.lines().next().unwrap().trim_start_matches("event: ").to_owned());
    }
    kinds
}

#[test]
fn a_page_gets_everything_first_and_then_what_changes() {
    let mut feed = Feed::new(Board::default());
    feed.on_frame(frame(1), 0);
    let (first, mut rest) = feed.join();
    let first = String::from_utf8(first.to_vec()).unwrap();
    for kind in ["rig", "view", "log", "frame"] {
        assert!(first.contains(&format!("event: {kind}\n")), "{first}");
    }
    feed.tell();
    kinds(&mut rest);
    feed.tell();
    assert_eq!(kinds(&mut rest), [""; 0], "nothing has changed");
    feed.on_frame(frame(2), 0);
    feed.on_frame(frame(2), 0);
    feed.board.run = Some(pb::RunState { run_id: "r1".into(), ..Default::default() });
    feed.tell();
    assert_eq!(kinds(&mut rest), ["frame", "view"]);
    for _ in 0..10 {
        feed.tell();
    }
    assert_eq!(kinds(&mut rest), ["view"], "a sign of life");
}

#[test]
fn a_page_that_does_not_read_misses_messages_and_holds_up_nothing() {
    let mut feed = Feed::new(Board::default());
    let (_, mut rest) = feed.join();
    for seq in 0..1_000 {
        feed.on_frame(frame(seq), 0);
    }
    assert!(matches!(rest.try_recv(), Err(TryRecvError::Lagged(missed)) if missed >= 1_000 - 64));
    assert!(kinds(&mut rest).len() <= BEHIND_MAX);
}
