//! A client that joins late gets the history, once and in order.

use std::time::Duration;

use crate::lab::{event, frame, open, open_with, settled};
use tactus_bus::{BusConfig, Client, History, Losses, Publisher};
use tactus_schema::pb;
use tokio::time::timeout;

const PATIENCE: Duration = Duration::from_mins(1);

#[tokio::test(flavor = "multi_thread")]
async fn a_late_joiner_gets_the_frames_that_are_kept_and_then_the_present() {
    let service = open_with("bench", BusConfig { frames_kept: Some(300), ..BusConfig::default() }).await;
    let publisher = service.bus.publisher();
    let client = Client::connect(&service.endpoint, Some("bench")).await.unwrap();
    let mut early = client.subscribe::<pb::Frame>(History::All).await.unwrap();
    let mut sent = 0;
    // In bursts that fit the publisher's queue, so that nothing is dropped.
    while sent < 400 {
        for _ in 0..100 {
            publisher.publish_frame(&frame(sent));
            sent += 1;
        }
        while early.recv().await.unwrap().seq != sent - 1 {}
    }

    let mut late = client.subscribe::<pb::Frame>(History::All).await.unwrap();
    assert_eq!(late.recv().await.unwrap(), pb::Frame::from(&frame(100)));
    for seq in 400..410 {
        publisher.publish_frame(&frame(seq));
    }
    for seq in 101..410 {
        assert_eq!(late.recv().await.unwrap(), pb::Frame::from(&frame(seq)));
    }
    assert_eq!(late.losses(), Losses::default());
    assert_eq!(publisher.dropped_frames(), 0);
    service.bus.close().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn between_history_and_present_nothing_is_lost_doubled_or_out_of_order() {
    const FRAMES: u64 = 2_000;
    let service = open("bench", &[]).await;
    let publisher = service.bus.publisher();
    let client = Client::connect(&service.endpoint, Some("bench")).await.unwrap();
    let mut pace = client.subscribe::<pb::Frame>(History::All).await.unwrap();
    let mut joiners = Vec::new();
    for seq in 0..FRAMES {
        publisher.publish_frame(&frame(seq));
        pace.recv().await.unwrap();
        // They join while frames flow.
        if seq % 100 == 50 {
            let endpoint = service.endpoint.clone();
            joiners.push(tokio::spawn(async move {
                let client = Client::connect(&endpoint, Some("bench")).await.unwrap();
                let mut frames = client.subscribe::<pb::Frame>(History::All).await.unwrap();
                let mut last = frames.recv().await.unwrap().seq;
                while last != FRAMES - 1 {
                    let seq = frames.recv().await.unwrap().seq;
                    assert_eq!(seq, last + 1);
                    last = seq;
                }
                assert_eq!(frames.losses(), Losses::default());
            }));
        }
    }
    assert_eq!(joiners.len(), 20);
    for joiner in joiners {
        joiner.await.unwrap();
    }
    service.bus.close().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_late_joiner_gets_the_whole_run_and_the_last_state() {
    let service = open("bench", &[]).await;
    let publisher = service.bus.publisher();
    for seq in 0..2_000 {
        publisher.publish(&event(seq));
        publisher.publish(&pb::RunState { frames: seq, ..Default::default() });
    }
    let client = Client::connect(&service.endpoint, Some("bench")).await.unwrap();
    let mut events = client.subscribe::<pb::RunEvent>(History::All).await.unwrap();
    for seq in 0..2_000 {
        assert_eq!(events.recv().await.unwrap().seq, seq);
    }
    let mut state = client.subscribe::<pb::RunState>(History::Last).await.unwrap();
    while state.recv().await.unwrap().frames != 1_999 {}
    let mut again = client.subscribe::<pb::RunState>(History::Last).await.unwrap();
    assert_eq!(again.recv().await.unwrap().frames, 1_999);
    assert_eq!(publisher.dropped_updates(), 0);
    service.bus.close().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn without_history_the_past_stays_the_past() {
    let mut service = open("bench", &[]).await;
    let publisher = service.bus.publisher();
    let client = Client::connect(&service.endpoint, Some("bench")).await.unwrap();
    let mut all = client.subscribe::<pb::Frame>(History::All).await.unwrap();
    publisher.publish_frame(&frame(0));
    assert_eq!(all.recv().await.unwrap().seq, 0);

    let mut live = client.subscribe::<pb::Frame>(History::None).await.unwrap();
    settled(&client, &mut service.calls).await;
    publisher.publish_frame(&frame(1));
    assert_eq!(live.recv().await.unwrap().seq, 1);
    service.bus.close().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_published_just_before_closing_still_arrives() {
    let service = open("bench", &[]).await;
    let client = Client::connect(&service.endpoint, Some("bench")).await.unwrap();
    let mut events = client.subscribe::<pb::RunEvent>(History::All).await.unwrap();
    service.bus.publisher().publish(&event(0));
    events.recv().await.unwrap();
    for seq in 1..=5_000 {
        service.bus.publisher().publish(&event(seq));
    }
    service.bus.close().await.unwrap();
    for seq in 1..=5_000 {
        // What is lost at the end never comes.
        let arrived = timeout(PATIENCE, events.recv()).await;
        assert_eq!(arrived.ok().flatten().map(|event| event.seq), Some(seq));
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn frames_that_several_tasks_send_at_a_time_all_arrive() {
    const EACH: u64 = 50;
    let service = open("bench", &[]).await;
    let client = Client::connect(&service.endpoint, Some("bench")).await.unwrap();
    let mut frames = client.subscribe::<pb::Frame>(History::All).await.unwrap();
    let senders = (0..4).map(|sender| {
        let publisher = service.bus.publisher();
        std::thread::spawn(move || {
            // Half of them call the thread.
            let publish =
                if sender % 2 == 0 { Publisher::publish_frame } else { Publisher::publish_frame_directly };
            (0..EACH).for_each(|number| publish(&publisher, &frame(sender * EACH + number)));
        })
    });
    let senders: Vec<_> = senders.collect();
    let mut seen = std::collections::BTreeSet::new();
    while (seen.len() as u64) < 4 * EACH {
        seen.insert(frames.recv().await.unwrap().seq);
    }
    for sender in senders {
        sender.join().unwrap();
    }
    assert_eq!(frames.losses().missed, 0);
    service.bus.close().await.unwrap();
}
