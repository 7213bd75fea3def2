//! Clients see a rig appear, disappear and crash.

use crate::lab::{Link, connected, event, open, open_for, router};
use tactus_bus::{Bus, BusConfig, BusError, Client, History, Losses};
use tactus_schema::{key::Keys, pb};

#[tokio::test(flavor = "multi_thread")]
async fn a_rig_is_there_from_its_token_on_and_gone_with_it() {
    let service = open("bench", &[]).await;
    let error = Client::connect(&service.endpoint, None).await.unwrap_err();
    assert!(matches!(error, BusError::NoRig { .. }), "{error:?}");

    let client = Client::connect(&service.endpoint, Some("bench")).await.unwrap();
    let mut alive = client.alive();
    assert!(!alive.now());
    let token = service.bus.declare_alive().await.unwrap();
    assert_eq!(alive.changed().await, Some(true));
    assert_eq!(client.rigs(), ["bench"]);
    assert!(client.alive().now());
    assert_eq!(Client::connect(&service.endpoint, None).await.unwrap().rig(), "bench");

    drop(token);
    assert_eq!(alive.changed().await, Some(false));
    assert_eq!(client.rigs(), [""; 0]);
    client.close().await.unwrap();
    assert_eq!(alive.changed().await, None);
    service.bus.close().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_service_that_dies_is_seen_to_be_gone() {
    let service = open("bench", &[]).await;
    let _token = service.bus.declare_alive().await.unwrap();
    let link = Link::to(&service.endpoint).await;
    let client = Client::connect(&link.endpoint, Some("bench")).await.unwrap();
    let mut alive = client.alive();
    assert!(alive.now());
    link.break_off();
    assert_eq!(alive.changed().await, Some(false));
    service.bus.close().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_service_that_comes_back_is_heard_again_from_its_first_word() {
    let service = open("bench", &[]).await;
    let token = service.bus.declare_alive().await.unwrap();
    let client = Client::connect(&service.endpoint, Some("bench")).await.unwrap();
    let mut alive = client.alive();
    let mut events = client.subscribe::<pb::RunEvent>(History::All).await.unwrap();
    service.bus.publisher().publish(&event(7));
    assert_eq!(events.recv().await.unwrap().seq, 7);
    drop(token);
    service.bus.close().await.unwrap();
    assert_eq!(alive.changed().await, Some(false));

    let config = BusConfig { listen: vec![service.endpoint], ..BusConfig::default() };
    let (bus, _calls) = Bus::open(&config, Keys::new("bench")).await.unwrap();
    // Most likely before the client has found the service again.
    bus.publisher().publish(&event(0));
    let _token = bus.declare_alive().await.unwrap();
    assert_eq!(alive.changed().await, Some(true));
    assert_eq!(events.recv().await.unwrap().seq, 0);
    bus.publisher().publish(&event(1));
    assert_eq!(events.recv().await.unwrap().seq, 1);
    assert_eq!(events.losses(), Losses::default());
    bus.close().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn two_rigs_on_one_bus_are_told_apart() {
    let first = open_for("left", &["right"], &[]).await;
    let _left = first.bus.declare_alive().await.unwrap();
    let second = open("right", std::slice::from_ref(&first.endpoint)).await;
    let _right = second.bus.declare_alive().await.unwrap();

    let left = Client::connect(&first.endpoint, Some("left")).await.unwrap();
    let right = Client::connect(&first.endpoint, Some("right")).await.unwrap();
    let mut there = right.alive();
    assert!(there.now() || there.changed().await == Some(true));
    assert_eq!(right.rigs(), ["left", "right"]);
    let unnamed = Client::connect(&first.endpoint, None).await.unwrap();
    assert_eq!(unnamed.rig(), "left", "the rig of the service that listens there");

    second.bus.publisher().publish(&event(5));
    first.bus.publisher().publish(&event(3));
    let mut from_left = left.subscribe::<pb::RunEvent>(History::All).await.unwrap();
    let mut from_right = right.subscribe::<pb::RunEvent>(History::All).await.unwrap();
    assert_eq!(from_left.recv().await.unwrap().seq, 3);
    assert_eq!(from_right.recv().await.unwrap().seq, 5);
    second.bus.close().await.unwrap();
    first.bus.close().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn at_a_router_with_several_rigs_one_must_be_named() {
    let (_router, endpoint) = router().await;
    let left = open("left", std::slice::from_ref(&endpoint)).await;
    let _left = left.bus.declare_alive().await.unwrap();
    let right = open("right", std::slice::from_ref(&endpoint)).await;
    let _right = right.bus.declare_alive().await.unwrap();
    let client = connected(&endpoint, "left").await;
    let mut alive = client.alive();
    assert!(alive.now() || alive.changed().await == Some(true));
    let client = connected(&endpoint, "right").await;
    let mut alive = client.alive();
    assert!(alive.now() || alive.changed().await == Some(true));
    let error = loop {
        match Client::connect(&endpoint, None).await {
            // The router may take its time on a busy machine.
            Err(BusError::Session { .. }) => {}
            other => break other.unwrap_err(),
        }
    };
    assert!(matches!(&error, BusError::SeveralRigs { rigs, .. } if *rigs == ["left", "right"]), "{error:?}");
    left.bus.close().await.unwrap();
    right.bus.close().await.unwrap();
}
