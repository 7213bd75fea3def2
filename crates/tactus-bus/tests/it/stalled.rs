//! A stalled client does not affect others, and its losses are counted.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::time::Duration;

use crate::lab::{Link, event, frame, open, raw_session};
use tactus_bus::{Client, History, Publisher};
use tactus_schema::{Frame, key::Command, pb};
use zenoh::query::{ConsolidationMode, ReplyKeyExpr};

const FRAMES: u64 = 100_000;
const EVENTS: u64 = 5_000;

#[tokio::test(flavor = "multi_thread")]
async fn frames_flow_past_a_client_that_stands_still_and_every_one_is_accounted_for() {
    flow_past_a_client_that_stands_still(Publisher::publish_frame).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn so_do_frames_that_are_sent_directly() {
    flow_past_a_client_that_stands_still(Publisher::publish_frame_directly).await;
}

async fn flow_past_a_client_that_stands_still(publish: fn(&Publisher, &Frame)) {
    let service = open("bench", &[]).await;
    let publisher = service.bus.publisher();
    let link = Link::to(&service.endpoint).await;
    let client = Client::connect(&link.endpoint, Some("bench")).await.unwrap();
    let mut frames = client.subscribe::<pb::Frame>(History::All).await.unwrap();
    publish(&publisher, &frame(0));
    assert_eq!(frames.recv().await.unwrap().seq, 0);

    link.stand_still();
    // The link flows again only after this loop: a call that waited for the client would wait for ever.
    for seq in 1..FRAMES {
        publish(&publisher, &frame(seq));
    }
    link.flow();

    let mut received = 1;
    let mut last = 0;
    while last != FRAMES - 1 {
        let seq = frames.recv().await.unwrap().seq;
        assert!(seq > last, "{seq} after {last}");
        last = seq;
        received += 1;
    }
    let losses = frames.losses();
    assert_eq!(received + losses.missed + losses.overrun + publisher.dropped_frames(), FRAMES);
    assert!(publisher.dropped_frames() + losses.missed > 0, "the link never filled up");
    service.bus.close().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_client_that_stands_still_delays_neither_stop_nor_events_and_catches_up_later() {
    let mut service = open("bench", &[]).await;
    let publisher = service.bus.publisher();
    let link = Link::to(&service.endpoint).await;
    let slow = Client::connect(&link.endpoint, Some("bench")).await.unwrap();
    let mut slow_frames = slow.subscribe::<pb::Frame>(History::All).await.unwrap();
    let mut slow_events = slow.subscribe::<pb::RunEvent>(History::All).await.unwrap();
    let client = Client::connect(&service.endpoint, Some("bench")).await.unwrap();
    let mut events = client.subscribe::<pb::RunEvent>(History::All).await.unwrap();
    publisher.publish_frame(&frame(0));
    publisher.publish(&event(0));
    slow_frames.recv().await.unwrap();
    assert_eq!(slow_events.recv().await.unwrap().seq, 0);
    assert_eq!(events.recv().await.unwrap().seq, 0);

    link.stand_still();
    for seq in 1..FRAMES {
        publisher.publish_frame(&frame(seq));
    }
    let request = pb::CommandRequest::default();
    let stop = client.command(Command::Stop, &request, Duration::from_hours(1));
    let (reply, ()) = tokio::join!(stop, async {
        let call = service.calls.stops.recv().await.unwrap();
        call.reply.reply(pb::CommandReply { ok: true, ..Default::default() });
    });
    assert!(reply.unwrap().ok);
    for seq in 1..EVENTS {
        publisher.publish(&event(seq));
        assert_eq!(events.recv().await.unwrap().seq, seq);
    }

    // The slow one has every event in the end.
    link.flow();
    for seq in 1..EVENTS {
        assert_eq!(slow_events.recv().await.unwrap().seq, seq);
    }
    assert_eq!(publisher.dropped_updates(), 0);
    service.bus.close().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn clients_that_ask_for_the_past_and_do_not_take_it_keep_nobody_waiting() {
    let mut service = open("bench", &[]).await;
    let publisher = service.bus.publisher();
    let client = Client::connect(&service.endpoint, Some("bench")).await.unwrap();
    let mut pace = client.subscribe::<pb::RunEvent>(History::All).await.unwrap();
    // 4 MB; four answers of it are more than fits into the buffers of a link.
    for seq in 0..1_000 {
        publisher.publish(&pb::RunEvent { run_id: "r".repeat(4_000), ..event(seq) });
        pace.recv().await.unwrap();
    }
    // Twice as many as zenoh has receiving threads.
    let mut askers = Vec::new();
    for _ in 0..4 {
        let link = Link::to(&service.endpoint).await;
        let session = raw_session(&link.endpoint).await;
        link.stand_still();
        let mut answers = Vec::new();
        for _ in 0..4 {
            let replies = session
                .get("tactus/bench/run/event/@adv/pub/**")
                .accept_replies(ReplyKeyExpr::Any)
                .consolidation(ConsolidationMode::None)
                .await
                .unwrap();
            answers.push(replies);
        }
        askers.push((link, session, answers));
    }
    let request = pb::CommandRequest::default();
    for _ in 0..20 {
        let stop = client.command(Command::Stop, &request, Duration::from_secs(5));
        let (reply, ()) = tokio::join!(stop, async {
            let call = service.calls.stops.recv().await.unwrap();
            call.reply.reply(pb::CommandReply { ok: true, ..Default::default() });
        });
        assert!(reply.unwrap().ok);
    }
    drop(askers);
    service.bus.close().await.unwrap();
}
