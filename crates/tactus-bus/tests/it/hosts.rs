//! Services on several hosts, joined by a router, and links between them that are cut.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::time::Duration;

use crate::lab::{Link, Service, connected, found, frame, open, open_with, router, router_at};
use tactus_bus::{
    Bus, BusConfig, BusError, Client, Credentials, Endpoint, History, Lab, Losses, Subscription, ask_all,
};
use tactus_schema::{
    key::{Command, Keys},
    pb,
};

/// Longer than any test runs.
const PATIENCE: Duration = Duration::from_hours(1);

/// Frames that are kept in these tests.
const KEPT: u64 = 100;

async fn open_at(router: &Endpoint) -> Service {
    let connect = vec![router.clone()];
    open_with("bench", BusConfig { connect, frames_kept: Some(100), ..BusConfig::default() }).await
}

/// Publishes these frames, none of them faster than a client of the service itself gets them: so the service drops none.
async fn publish(service: &Service, near: &mut Subscription<pb::Frame>, seqs: std::ops::Range<u64>) {
    for seq in seqs {
        service.bus.publisher().publish_frame(&frame(seq));
        assert_eq!(near.recv().await.unwrap().seq, seq);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_service_works_without_its_router_and_joins_it_whenever_it_is_there() {
    let (first, endpoint) = router().await;
    first.close().await.unwrap();
    let service = open_at(&endpoint).await;
    let client = Client::connect(&service.endpoint, Some("bench")).await.unwrap();
    let mut near = client.subscribe::<pb::Frame>(History::All).await.unwrap();
    publish(&service, &mut near, 0..3).await;

    let mut due = 3;
    for _ in 0..2 {
        let router = router_at(&endpoint).await.unwrap();
        let client = found(&endpoint, "bench", &Credentials::default()).await;
        let mut far = client.subscribe::<pb::Frame>(History::All).await.unwrap();
        publish(&service, &mut near, due..due + 3).await;
        due += 3;
        for seq in 0..due {
            assert_eq!(far.recv().await.unwrap().seq, seq);
        }
        client.close().await.unwrap();
        router.close().await.unwrap();
        publish(&service, &mut near, due..due + 3).await;
        due += 3;
    }
    service.bus.close().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_client_that_was_cut_off_gets_what_is_kept_and_is_told_what_is_not() {
    let (_router, router) = router().await;
    let service = open_at(&router).await;
    let client = connected(&service.endpoint, "bench").await;
    let mut near = client.subscribe::<pb::Frame>(History::All).await.unwrap();
    let link = Link::to(&router).await;
    let client = found(&link.endpoint, "bench", &Credentials::default()).await;
    let mut far = client.subscribe::<pb::Frame>(History::All).await.unwrap();
    publish(&service, &mut near, 0..1).await;
    assert_eq!(far.recv().await.unwrap().seq, 0);

    // As many as are kept: none is missing, and none comes twice.
    link.cut();
    publish(&service, &mut near, 1..KEPT).await;
    link.flow();
    for seq in 1..KEPT {
        assert_eq!(far.recv().await.unwrap().seq, seq);
        assert_eq!(far.gap(), None);
    }
    assert_eq!(far.losses(), Losses::default());

    // More: the oldest are gone, and their number is known.
    link.cut();
    publish(&service, &mut near, KEPT..3 * KEPT).await;
    link.flow();
    assert_eq!(far.recv().await.unwrap().seq, 2 * KEPT);
    let gap = far.gap().unwrap().clone();
    assert_eq!(gap.messages(), KEPT);
    assert_eq!(client.ask_again::<pb::Frame>(&gap, PATIENCE).await.unwrap(), Some(vec![]));
    for seq in 2 * KEPT + 1..3 * KEPT {
        assert_eq!(far.recv().await.unwrap().seq, seq);
        assert_eq!(far.gap(), None);
    }

    // A service that is gone does not answer.
    service.bus.close().await.unwrap();
    assert_eq!(client.ask_again::<pb::Frame>(&gap, PATIENCE).await.unwrap(), None);
}

#[tokio::test(flavor = "multi_thread")]
async fn two_hosts_with_a_rig_of_one_name_are_refused_by_name() {
    let (_router, router) = router().await;
    let routers = std::slice::from_ref(&router);
    let first = open("twin", routers).await;
    found(&router, "twin", &Credentials::default()).await.close().await.unwrap();
    let second = open("twin", routers).await;
    let mut lab = Lab::connect(&router, &Credentials::default()).await.unwrap();
    let error = loop {
        match lab.client("twin").await {
            Ok(_) => lab.changed().await.unwrap(),
            Err(error) => break error,
        }
    };
    assert!(matches!(&error, BusError::SeveralServices { rig, .. } if rig == "twin"), "{error}");
    let request = pb::CommandRequest { who: "test".into(), ..Default::default() };
    let answers =
        ask_all(&router, &Credentials::default(), Command::Status, &request, PATIENCE).await.unwrap();
    assert!(
        matches!(&answers[..], [(rig, Err(BusError::SeveralServices { .. }))] if rig == "twin"),
        "{answers:?}"
    );
    let error = Client::connect(&router, Some("twin")).await.unwrap_err();
    assert!(error.to_string().contains("name of its own"), "{error}");
    // At its own service each is still reached.
    Client::connect(&second.endpoint, Some("twin")).await.unwrap();
    first.bus.close().await.unwrap();
    while lab.client("twin").await.is_err() {
        lab.changed().await.unwrap();
    }
    second.bus.close().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_number_of_frames_that_cannot_be_kept_is_refused() {
    for frames in [0, 16_001] {
        let config = BusConfig { listen: vec![], frames_kept: Some(frames), ..BusConfig::default() };
        let error = Bus::open(&config, Keys::new("bench")).await.unwrap_err();
        assert!(error.to_string().contains(&format!("frames_kept = {frames}: 1 to 16000")), "{error}");
    }
}
