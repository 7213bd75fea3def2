//! A stop gets through whatever else happens on the bus.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::{
    io::Read,
    net::{TcpListener, TcpStream, UdpSocket},
    time::Duration,
};

use crate::lab::{Service, free_endpoint, open, open_for, raw_session};
use prost::Message as _;
use tactus_bus::{Bus, BusConfig, BusError, Client, CommandCall, Credentials, Endpoint, Request};
use tactus_schema::{key::Keys, pb};
use tokio::sync::mpsc;

/// Longer than any test runs.
const PATIENCE: Duration = Duration::from_hours(1);

fn request() -> pb::CommandRequest {
    pb::CommandRequest { who: "test".to_owned(), reason: "smoke".to_owned(), ..Default::default() }
}

/// Answers each stop for its rig, and tells who sent it.
fn answer(rig: &str, mut stops: mpsc::Receiver<Box<CommandCall>>) -> mpsc::Receiver<Request> {
    let (told, asked) = mpsc::channel(1_000);
    let rig = rig.to_owned();
    tokio::spawn(async move {
        while let Some(call) = stops.recv().await {
            call.reply.reply(pb::CommandReply { ok: true, rig: rig.clone(), ..Default::default() });
            told.send(call.request).await.unwrap();
        }
    });
    asked
}

async fn stop(endpoint: &Endpoint, rig: Option<&str>) -> Result<Vec<String>, BusError> {
    let answers = tactus_bus::stop(endpoint, rig, &request(), &Credentials::default(), PATIENCE).await?;
    Ok(answers.into_iter().map(|reply| reply.rig).collect())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_stop_needs_no_name_and_no_sign_of_life() {
    let Service { bus, calls, endpoint } = open("bench", &[]).await;
    let mut asked = answer("bench", calls.stops);
    assert_eq!(stop(&endpoint, None).await.unwrap(), ["bench"]);
    assert_eq!(asked.recv().await.unwrap(), Request::Control(request()));
    assert_eq!(stop(&endpoint, Some("bench")).await.unwrap(), ["bench"]);
    bus.close().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_stop_reaches_every_rig_on_the_bus_and_one_with_a_name_only_that_one() {
    let first = open_for("left", &["right"], &[]).await;
    let second = open("right", std::slice::from_ref(&first.endpoint)).await;
    let mut left = answer("left", first.calls.stops);
    let _right = answer("right", second.calls.stops);
    let client = Client::connect(&first.endpoint, Some("right")).await.unwrap();
    let _token = second.bus.declare_alive().await.unwrap();
    let mut alive = client.alive();
    assert!(alive.now() || alive.changed().await == Some(true));
    assert_eq!(stop(&first.endpoint, Some("right")).await.unwrap(), ["right"]);
    assert!(left.try_recv().is_err());
    assert_eq!(stop(&first.endpoint, None).await.unwrap(), ["left", "right"]);
    second.bus.close().await.unwrap();
    first.bus.close().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_thousand_idle_connections_a_foreign_token_and_a_rogue_do_not_keep_a_stop_waiting() {
    let Service { bus, calls, endpoint } = open("bench", &[]).await;
    let mut asked = answer("bench", calls.stops);
    let rogue = raw_session(&endpoint).await;
    let _token = rogue.liveliness().declare_token("tactus/x/alive").await.unwrap();
    for key in ["tactus/stop", "tactus/bench/cmd/stop", "**"] {
        rogue.declare_queryable(key).callback(drop).background().await.unwrap();
    }
    // Two descriptors each, as both ends are in this process: half of what a process usually has.
    let address = endpoint.address().to_owned();
    let idle = tokio::task::spawn_blocking(move || {
        (0..1_000).map_while(|_| TcpStream::connect(&address).ok()).collect::<Vec<_>>()
    });
    let idle = idle.await.unwrap();
    assert!(idle.len() > 400, "{} connections", idle.len());
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    for _ in 0..100 {
        // The service is not impressed by nonsense.
        socket.send_to(b"\x00\x01\x00\x00", endpoint.address()).unwrap();
    }
    assert_eq!(stop(&endpoint, None).await.unwrap(), ["bench"]);
    assert_eq!(asked.recv().await.unwrap(), Request::Control(request()));
    drop(idle);
    bus.close().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_stop_by_datagram_is_taken_while_the_bus_has_no_room() {
    let folder = tempfile::tempdir().unwrap();
    let endpoint: Endpoint = format!("unixsock-stream/{}/bus.sock", folder.path().display()).parse().unwrap();
    let config = BusConfig { listen: vec![endpoint.clone()], ..BusConfig::default() };
    let (bus, calls) = Bus::open(&config, Keys::new("bench")).await.unwrap();
    let _asked = answer("bench", calls.stops);
    assert_eq!(stop(&endpoint, None).await.unwrap(), ["bench"]);
    // Nobody can connect any more.
    std::fs::remove_file(endpoint.address()).unwrap();
    assert_eq!(stop(&endpoint, None).await.unwrap(), ["bench"]);
    bus.close().await.unwrap();
    assert!(!folder.path().join("bus.sock.stop").exists());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_connection_that_takes_long_does_not_keep_the_datagram_waiting() {
    // Which of both begins was left to chance.
    for _ in 0..8 {
        let endpoint = free_endpoint();
        let address = endpoint.to_string().trim_start_matches("tcp/").to_owned();
        let (datagrams, connections) =
            (UdpSocket::bind(&address).unwrap(), TcpListener::bind(&address).unwrap());
        let stopping = tokio::spawn(async move { stop(&endpoint, None).await });
        // The connection is taken, and never answered.
        let (connection, was_open) = tokio::task::spawn_blocking(move || {
            let (mut connection, _) = connections.accept().unwrap();
            let (_, client) = datagrams.recv_from(&mut [0; 4096]).unwrap();
            connection.set_nonblocking(true).unwrap();
            let ended = std::iter::repeat_with(|| connection.read(&mut [0; 4096]))
                .find(|read| !matches!(read, Ok(1..)));
            let reply = pb::CommandReply { ok: true, rig: "bench".into(), ..Default::default() };
            datagrams.send_to(&reply.encode_to_vec(), client).unwrap();
            (connection, ended.is_some_and(|ended| ended.is_err()))
        })
        .await
        .unwrap();
        assert!(was_open, "the datagram came after the client had given up its connection");
        assert_eq!(stopping.await.unwrap().unwrap(), ["bench"]);
        drop(connection);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_stop_that_nobody_answers_is_an_error_that_says_so() {
    let endpoint = free_endpoint();
    let error = stop(&endpoint, None).await.unwrap_err();
    assert!(matches!(error, BusError::NotStopped { .. }), "{error:?}");
    assert!(error.to_string().contains(endpoint.address()), "{error}");
}
