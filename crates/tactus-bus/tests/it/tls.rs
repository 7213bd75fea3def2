//! Beyond this machine: clients with and without certificates.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::{path::PathBuf, time::Duration};

use crate::lab::{Service, found, frame, free_endpoint, open_with};
use tactus_bus::{Bus, BusConfig, BusError, Calls, Client, Credentials, Endpoint, History, Hold, TlsConfig};
use tactus_schema::{
    key::{Command, Keys},
    pb,
};

/// Longer than any test runs.
const PATIENCE: Duration = Duration::from_hours(1);

fn file(name: &str) -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/certificates")).join(name)
}

fn credentials(name: &str) -> Credentials {
    Credentials {
        authority: Some(file("lab-authority.pem")),
        certificate: Some(file(&format!("{name}.pem"))),
        key: Some(file(&format!("{name}.key"))),
    }
}

fn tls() -> TlsConfig {
    TlsConfig {
        authority: file("lab-authority.pem"),
        certificate: file("service.pem"),
        key: file("service.key"),
        commanders: vec!["commander".to_owned()],
        readers: vec!["reader".to_owned()],
        check: Some((file("reader.pem"), file("reader.key"))),
    }
}

fn endpoint() -> Endpoint {
    free_endpoint().to_string().replace("tcp/", "tls/").parse().unwrap()
}

/// A service on every network of this machine.
async fn open(tls: TlsConfig) -> (Result<(Bus, Calls), BusError>, Endpoint) {
    let near = endpoint();
    let listen = near.to_string().replace("127.0.0.1", "0.0.0.0").parse().unwrap();
    let config = BusConfig { listen: vec![listen], tls: Some(tls), ..BusConfig::default() };
    (Bus::open(&config, Keys::new("bench")).await, near)
}

/// Answers everything.
fn answer(mut calls: Calls) {
    tokio::spawn(async move {
        loop {
            let call = tokio::select! {
                Some(call) = calls.stops.recv() => call,
                Some(call) = calls.commands.recv() => call,
                else => return,
            };
            let version = format!("{:?}", call.command);
            call.reply.reply(pb::CommandReply {
                ok: true,
                rig: "bench".to_owned(),
                version,
                ..Default::default()
            });
        }
    });
}

fn request() -> pb::CommandRequest {
    pb::CommandRequest { who: "test".to_owned(), ..Default::default() }
}

/// Nobody gets in without a certificate that the lab has signed.
async fn only_the_lab_gets_in(endpoint: &Endpoint) {
    let nobody = Credentials { authority: Some(file("lab-authority.pem")), ..Credentials::default() };
    for (who, credentials) in
        [("without a certificate", nobody), ("signed by a stranger", credentials("stranger"))]
    {
        let denied = Client::connect_as(endpoint, Some("bench"), &credentials).await;
        assert!(matches!(denied, Err(BusError::Session { .. })), "{who}: {denied:?}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn who_is_listed_commands_or_reads_and_nobody_else_gets_in() {
    let (opened, endpoint) = open(tls()).await;
    let (bus, calls) = opened.unwrap();
    answer(calls);
    let commander = Client::connect_as(&endpoint, Some("bench"), &credentials("commander")).await.unwrap();
    let reply = commander.command(Command::Reset, &request(), PATIENCE).await.unwrap();
    assert_eq!(reply.version, "Reset");
    assert!(matches!(commander.hold("commander", None).await, Ok(Hold::Held(_))));

    let reader = Client::connect_as(&endpoint, Some("bench"), &credentials("reader")).await.unwrap();
    assert!(reader.command(Command::Status, &request(), PATIENCE).await.unwrap().ok);
    assert_eq!(
        reader.stop(&request(), PATIENCE).await.unwrap().version,
        "Stop",
        "everybody who gets in can stop"
    );
    for command in [Command::Reset, Command::Pause, Command::Resume, Command::Lease, Command::Run] {
        let denied = reader.command(command, &request(), Duration::from_millis(100)).await;
        assert!(matches!(denied, Err(BusError::NoAnswer { .. })), "{command:?}: {denied:?}");
    }

    // Signed by the lab, but not listed.
    let visitor = Client::connect_as(&endpoint, Some("bench"), &credentials("visitor")).await;
    if let Ok(visitor) = visitor {
        let denied = visitor.command(Command::Status, &request(), Duration::from_millis(100)).await;
        assert!(matches!(denied, Err(BusError::NoAnswer { .. })), "{denied:?}");
    }
    only_the_lab_gets_in(&endpoint).await;
    bus.close().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_service_whose_reader_could_command_does_not_listen() {
    // A slip of the pen: the reader's name is among those who command.
    let slip =
        TlsConfig { commanders: vec!["commander".to_owned(), "reader".to_owned()], readers: vec![], ..tls() };
    let (opened, endpoint) = open(slip).await;
    let error = opened.unwrap_err();
    assert!(matches!(error, BusError::NotDenied { .. }), "{error:?}");
    assert!(error.to_string().contains("could command"), "{error}");
    let gone = Client::connect_as(&endpoint, Some("bench"), &credentials("commander")).await;
    assert!(matches!(gone, Err(BusError::NoService { .. })), "{gone:?}");
}

/// The router of the how-to on several hosts, on this machine, with one of the certificates of these tests.
async fn router(name: &str) -> (zenoh::Session, Endpoint) {
    let page = include_str!("../../../../docs/book/how-to/hosts.md");
    let (_, after) = page.split_once("```json5\n").unwrap();
    let (settings, _) = after.split_once("```").unwrap();
    loop {
        let endpoint = endpoint();
        let mut settings = settings.replacen("tls/0.0.0.0:7447", &endpoint.to_string(), 1);
        for (shown, used) in [
            ("lab-authority.pem", "lab-authority.pem".to_owned()),
            ("router.pem", format!("{name}.pem")),
            ("router.key", format!("{name}.key")),
        ] {
            assert!(settings.contains(shown), "{settings}");
            settings =
                settings.replacen(&format!("\"{shown}\""), &format!("\"{}\"", file(&used).display()), 1);
        }
        if let Ok(session) = zenoh::open(zenoh::Config::from_json5(&settings).unwrap()).await {
            return (session, endpoint);
        }
    }
}

/// A service that has joined the router and has published a frame.
async fn joined(router: &Endpoint) -> Bus {
    let config = BusConfig { connect: vec![router.clone()], tls: Some(tls()), ..BusConfig::default() };
    let Service { bus, calls, .. } = open_with("bench", config).await;
    answer(calls);
    bus.publisher().publish_frame(&frame(7));
    bus
}

#[tokio::test(flavor = "multi_thread")]
async fn a_router_may_do_what_its_name_is_listed_for() {
    for (name, commands) in [("commander", true), ("reader", false)] {
        let (router, endpoint) = router(name).await;
        let bus = joined(&endpoint).await;
        let client = found(&endpoint, "bench", &credentials("visitor")).await;
        let mut frames = client.subscribe::<pb::Frame>(History::All).await.unwrap();
        assert_eq!(frames.recv().await.unwrap().seq, 7, "{name}");
        assert!(client.command(Command::Status, &request(), PATIENCE).await.unwrap().ok, "{name}");
        if commands {
            assert_eq!(client.command(Command::Reset, &request(), PATIENCE).await.unwrap().version, "Reset");
        } else {
            let denied = client.command(Command::Reset, &request(), Duration::from_millis(100)).await;
            assert!(matches!(denied, Err(BusError::NoAnswer { .. })), "{denied:?}");
        }
        only_the_lab_gets_in(&endpoint).await;
        bus.close().await.unwrap();
        router.close().await.unwrap();
    }
}
