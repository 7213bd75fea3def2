//! Commands reach the service, and replies reach the client; a stop never waits.

use std::time::Duration;

use crate::lab::{found, free_endpoint, open, raw_session, router};
use prost::Message as _;
use tactus_bus::{BusError, Client, CommandCall, Credentials, Request};
use tactus_schema::{
    key::{Command, Keys},
    pb,
};
use tokio::{net::TcpListener, sync::mpsc};

/// Longer than any test runs, so that a lost call hangs the test instead of passing it.
const PATIENCE: Duration = Duration::from_hours(1);

fn asked_by(who: &str) -> pb::CommandRequest {
    pb::CommandRequest { who: who.to_owned(), reason: "to see".to_owned(), abort: true, ..Default::default() }
}

/// A request as stock tools send it.
fn status() -> Vec<u8> {
    asked_by("test").encode_to_vec()
}

/// Answers every call with its own command and request.
async fn echo(mut calls: mpsc::Receiver<Box<CommandCall>>) {
    while let Some(call) = calls.recv().await {
        let CommandCall { command, request, reply, .. } = *call;
        let version = format!("{command:?} {request:?}");
        reply.reply(pb::CommandReply { ok: true, rig: "bench".to_owned(), version, ..Default::default() });
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn every_command_makes_the_round_trip() {
    let service = open("bench", &[]).await;
    tokio::spawn(echo(service.calls.commands));
    tokio::spawn(echo(service.calls.stops));
    let client = Client::connect(&service.endpoint, Some("bench")).await.unwrap();

    let run = pb::RunRequest {
        experiment: "corners".to_owned(),
        parameters_json: r#"{"depth_mm": 0.3}"#.to_owned(),
        seed: Some(7),
        who: "test".to_owned(),
        ..Default::default()
    };
    let reply = client.command(Command::Run, &run, PATIENCE).await.unwrap();
    assert_eq!(reply.version, format!("Run {:?}", Request::Run(run)));
    for command in [Command::Status, Command::Pause, Command::Resume, Command::Stop, Command::Reset] {
        let reply = client.command(command, &asked_by("test"), PATIENCE).await.unwrap();
        assert_eq!(reply.version, format!("{command:?} {:?}", Request::Control(asked_by("test"))));
        assert!(reply.ok);
    }
    service.bus.close().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_request_that_makes_no_sense_is_answered_and_goes_no_further() {
    let mut service = open("bench", &[]).await;
    let client = Client::connect(&service.endpoint, Some("bench")).await.unwrap();
    // The wrong message for the command.
    let reply = client.command(Command::Run, &asked_by("test"), PATIENCE).await.unwrap();
    assert_eq!((reply.ok, reply.exit_code, reply.rig.as_str()), (false, 2, "bench"));
    assert!(reply.error.contains("tactus.v1.RunRequest"), "{}", reply.error);
    // Bytes that are no message: field 1 announces 127 bytes, and one follows.
    let session = raw_session(&service.endpoint).await;
    let replies = session.get("tactus/bench/cmd/pause").payload([0x0a, 0x7f, 0x00]).await.unwrap();
    let reply = replies.recv_async().await.unwrap();
    let reply = reply.result().unwrap();
    assert_eq!(reply.encoding().to_string(), "application/protobuf;tactus.v1.CommandReply");
    let reply = pb::CommandReply::decode(&*reply.payload().to_bytes()).unwrap();
    assert_eq!((reply.ok, reply.exit_code), (false, 2));
    assert!(reply.error.contains("tactus.v1.CommandRequest"), "{}", reply.error);
    assert!(service.calls.commands.try_recv().is_err());
    service.bus.close().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_stop_is_a_stop_whatever_comes_with_it() {
    let mut service = open("bench", &[]).await;
    let session = raw_session(&service.endpoint).await;
    for payload in [vec![], vec![0x0a, 0x7f, 0x00]] {
        let replies = session.get("tactus/bench/cmd/stop").payload(payload).await.unwrap();
        let call = service.calls.stops.recv().await.unwrap();
        assert_eq!(call.command, Command::Stop);
        call.reply.reply(pb::CommandReply { ok: true, ..Default::default() });
        assert!(replies.recv_async().await.unwrap().result().is_ok());
    }
    service.bus.close().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_stop_passes_a_full_queue_and_the_queue_says_that_it_is_full() {
    let mut service = open("bench", &[]).await;
    let client = Client::connect(&service.endpoint, Some("bench")).await.unwrap();
    let session = raw_session(&service.endpoint).await;
    let mut waiting = Vec::new();
    for _ in 0..16 {
        waiting
            .push(session.get("tactus/bench/cmd/status").payload(status()).timeout(PATIENCE).await.unwrap());
    }
    // Same session, so behind them: all 16 are in when this one is refused.
    let refused = session.get("tactus/bench/cmd/status").payload(status()).timeout(PATIENCE).await.unwrap();
    let refused = refused.recv_async().await.unwrap();
    let refused = pb::CommandReply::decode(&*refused.result().unwrap().payload().to_bytes()).unwrap();
    assert_eq!((refused.ok, refused.exit_code), (false, 1));
    assert!(refused.error.contains("16"), "{}", refused.error);

    let request = asked_by("test");
    let stop = client.command(Command::Stop, &request, PATIENCE);
    let answer = async {
        let call = service.calls.stops.recv().await.unwrap();
        assert_eq!(call.request, Request::Control(asked_by("test")));
        call.reply.reply(pb::CommandReply { ok: true, ..Default::default() });
    };
    let (reply, ()) = tokio::join!(stop, answer);
    assert!(reply.unwrap().ok);

    for pending in waiting {
        let call = service.calls.commands.recv().await.unwrap();
        call.reply.reply(pb::CommandReply { ok: true, ..Default::default() });
        assert!(pending.recv_async().await.unwrap().result().is_ok());
    }
    service.bus.close().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_call_that_is_dropped_or_has_no_service_gets_no_answer() {
    let mut service = open("bench", &[]).await;
    let client = Client::connect(&service.endpoint, Some("bench")).await.unwrap();
    let request = asked_by("test");
    let (reply, ()) = tokio::join!(client.command(Command::Status, &request, PATIENCE), async {
        drop(service.calls.commands.recv().await.unwrap());
    });
    assert!(matches!(reply, Err(BusError::NoAnswer { .. })), "{reply:?}");

    // Of a rig that is not served nobody would answer: that is told at once, with those that are.
    let error = Client::connect(&service.endpoint, Some("elsewhere")).await.unwrap_err();
    assert!(matches!(&error, BusError::UnknownRig { rigs, .. } if rigs == &["bench"]), "{error:?}");
    service.bus.close().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn an_answer_given_just_before_closing_still_arrives() {
    let mut service = open("bench", &[]).await;
    let client = Client::connect(&service.endpoint, Some("bench")).await.unwrap();
    let request = asked_by("test");
    let (reply, ()) = tokio::join!(client.command(Command::Status, &request, PATIENCE), async {
        let call = service.calls.commands.recv().await.unwrap();
        call.reply.reply(pb::CommandReply { ok: true, ..Default::default() });
        service.bus.close().await.unwrap();
    });
    assert!(reply.unwrap().ok);
}

#[tokio::test(flavor = "multi_thread")]
async fn an_absent_service_and_a_stranger_are_told_apart() {
    let endpoint = free_endpoint();
    let error = Client::connect(&endpoint, Some("bench")).await.unwrap_err();
    assert!(error.to_string().contains(endpoint.address()), "{error}");
    let BusError::NoService { source, .. } = error else { panic!("{error:?}") };
    assert_eq!(source.kind(), std::io::ErrorKind::ConnectionRefused);

    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let endpoint = format!("tcp/{}", listener.local_addr().unwrap()).parse().unwrap();
    let hangs_up = tokio::spawn(async move {
        while let Ok((connection, _)) = listener.accept().await {
            drop(connection);
        }
    });
    let error = Client::connect(&endpoint, Some("bench")).await.unwrap_err();
    assert!(matches!(error, BusError::Session { .. }), "{error:?}");
    hangs_up.abort();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_rig_name_with_a_wildcard_commands_nobody() {
    let endpoint = free_endpoint();
    for rig in ["*", "**", "a/b", "", "a b"] {
        let error = Client::connect(&endpoint, Some(rig)).await.unwrap_err();
        assert!(matches!(error, BusError::RigName { .. }), "{rig:?}: {error:?}");
    }
}

/// What zenoh does with a query when its service ends is zenoh's; here it does nothing.
#[tokio::test(flavor = "multi_thread")]
async fn a_command_ends_with_its_service_although_nobody_ends_the_query() {
    let (_router, endpoint) = router().await;
    let service = raw_session(&endpoint).await;
    let keys = Keys::new("bench");
    let queries = service.declare_queryable(keys.command(Command::Experiments)).await.unwrap();
    let _alive = service.liveliness().declare_token(keys.alive()).await.unwrap();
    let instance = keys.instance(&service.zid().to_string());
    let instance = service.liveliness().declare_token(instance).await.unwrap();
    let client = found(&endpoint, "bench", &Credentials::default()).await;

    let request = asked_by("test");
    let asking = client.command(Command::Experiments, &request, PATIENCE);
    let ending = async {
        let query = queries.recv_async().await.unwrap();
        instance.undeclare().await.unwrap();
        query
    };
    let (reply, _query) = tokio::join!(asking, ending);
    assert!(matches!(reply, Err(BusError::NoAnswer { .. })), "{reply:?}");
    service.close().await.unwrap();
}
