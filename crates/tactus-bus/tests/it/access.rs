//! What a stranger on the bus cannot do: command by reading, and pass for the service.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::{os::unix::fs::PermissionsExt as _, time::Duration};

use crate::lab::{Service, connected, event, frame, open, raw_session, router, settled};
use prost::Message as _;
use tactus_bus::{Bus, BusConfig, BusError, Client, Endpoint, History, Hold, Request};
use tactus_schema::{
    key::{Command, Keys},
    pb,
};
use tokio::sync::mpsc;
use zenoh::{
    Wait,
    liveliness::LivelinessToken,
    qos::CongestionControl,
    query::{ConsolidationMode, QueryTarget},
    sample::Locality,
};

/// Longer than any test runs.
const PATIENCE: Duration = Duration::from_hours(1);
/// Time after which an unanswered read ends; what has to be seen comes later on the same link.
const READ: Duration = Duration::from_millis(50);

fn asked_by(who: &str) -> pb::CommandRequest {
    pb::CommandRequest { who: who.to_owned(), ..Default::default() }
}

/// The next command that arrives.
async fn next(service: &mut Service) -> (Command, Request) {
    let call = tokio::select! {
        call = service.calls.stops.recv() => call,
        call = service.calls.commands.recv() => call,
    }
    .unwrap();
    call.reply.reply(pb::CommandReply { ok: true, rig: "bench".to_owned(), ..Default::default() });
    (call.command, call.request)
}

#[tokio::test(flavor = "multi_thread")]
async fn a_read_commands_nothing_however_wide_it_is() {
    let mut service = open("bench", &[]).await;
    let session = raw_session(&service.endpoint).await;
    let request = asked_by("reader").encode_to_vec();
    for selector in ["tactus/**", "tactus/*/cmd/*", "**", "tactus/bench/**", "tactus/bench/cmd/*", "*/stop"] {
        for payload in [Vec::new(), request.clone()] {
            let read = session.get(selector).payload(payload).target(QueryTarget::All);
            let replies = read.consolidation(ConsolidationMode::None).timeout(READ).await.unwrap();
            while let Ok(reply) = replies.recv_async().await {
                let reply = reply.result().map(|sample| sample.key_expr().to_string());
                assert!(reply.is_err(), "{selector}: {reply:?}");
            }
        }
    }
    // Same session, so behind all of them: this is the first that arrives.
    let proper = session.get("tactus/bench/cmd/status").payload(request).timeout(PATIENCE).await.unwrap();
    assert_eq!(next(&mut service).await, (Command::Status, Request::Control(asked_by("reader"))));
    assert!(proper.recv_async().await.unwrap().result().is_ok());
    service.bus.close().await.unwrap();
}

/// A service behind a router that checks nothing, and the router's endpoint: what its own node refuses arrives there.
async fn behind_a_router() -> (zenoh::Session, Endpoint, Service) {
    let (router, endpoint) = router().await;
    let service = open("bench", std::slice::from_ref(&endpoint)).await;
    let client = connected(&endpoint, "bench").await;
    let _token = service.bus.declare_alive().await.unwrap();
    let mut alive = client.alive();
    assert!(alive.now() || alive.changed().await == Some(true));
    (router, endpoint, service)
}

#[tokio::test(flavor = "multi_thread")]
async fn a_read_through_a_router_commands_nothing() {
    let (_router, endpoint, mut service) = behind_a_router().await;
    let session = raw_session(&endpoint).await;
    for selector in ["tactus/**", "tactus/*/cmd/*", "**"] {
        let read = session.get(selector).target(QueryTarget::All).timeout(READ).await.unwrap();
        while read.recv_async().await.is_ok() {}
    }
    let request = asked_by("reader").encode_to_vec();
    let _proper = session.get("tactus/bench/cmd/status").payload(request).timeout(PATIENCE).await.unwrap();
    assert_eq!(next(&mut service).await.0, Command::Status);
    service.bus.close().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_command_without_a_request_or_without_a_name_is_refused_and_a_long_one_too() {
    let mut service = open("bench", &[]).await;
    let session = raw_session(&service.endpoint).await;
    let long = pb::RunRequest { who: "test".to_owned(), script: "#".repeat(1 << 20), ..Default::default() };
    for (key, payload, why) in [
        ("cmd/reset", None, "tactus.v1.CommandRequest"),
        ("cmd/reset", Some(Vec::new()), "who asks"),
        ("cmd/resume", Some(asked_by("").encode_to_vec()), "who asks"),
        ("cmd/run", Some(Vec::new()), "who asks"),
        ("cmd/lease", Some(Vec::new()), "who asks"),
        ("cmd/run", Some(long.encode_to_vec()), "at most"),
    ] {
        let asked = session.get(format!("tactus/bench/{key}")).timeout(PATIENCE);
        let replies = match payload {
            Some(payload) => asked.payload(payload).await.unwrap(),
            None => asked.await.unwrap(),
        };
        let reply = replies.recv_async().await.unwrap();
        let reply = pb::CommandReply::decode(&*reply.result().unwrap().payload().to_bytes()).unwrap();
        assert_eq!((reply.ok, reply.exit_code), (false, 2), "{key}");
        assert!(reply.error.contains(why), "{key}: {}", reply.error);
    }
    let _proper =
        session.get("tactus/bench/cmd/status").payload(asked_by("test").encode_to_vec()).await.unwrap();
    assert_eq!(next(&mut service).await.0, Command::Status);
    service.bus.close().await.unwrap();
}

/// A program that answers and publishes in the service's name.
async fn rogue(endpoint: &Endpoint) -> (zenoh::Session, Vec<LivelinessToken>, mpsc::Receiver<String>) {
    let session = raw_session(endpoint).await;
    let (heard, asked) = mpsc::channel(64);
    for key in [
        "tactus/bench/cmd/status",
        "tactus/bench/cmd/stop",
        "tactus/bench/cmd/lease",
        "tactus/stop",
        "tactus/**",
        "**",
    ] {
        let heard = heard.clone();
        let queryable = session.declare_queryable(key).callback(move |query| {
            let reply = pb::CommandReply {
                ok: true,
                rig: "bench".to_owned(),
                error: "rogue".to_owned(),
                ..Default::default()
            };
            // The test has ended if nobody listens.
            let _told = heard.try_send(query.key_expr().to_string());
            let _sent = query.reply("tactus/bench/cmd/status", reply.encode_to_vec()).wait();
        });
        queryable.background().await.unwrap();
    }
    let tokens = session.liveliness();
    let mut held = Vec::new();
    for key in [
        "tactus/x/alive".to_owned(),
        "tactus/bench/alive".to_owned(),
        format!("tactus/bench/service/{}", session.zid()),
    ] {
        held.push(tokens.declare_token(key).await.unwrap());
    }
    // Behind the declarations on the same link.
    let roll_call = tokens.get("tactus/**").await.unwrap();
    while roll_call.recv_async().await.is_ok() {}
    (session, held, asked)
}

#[tokio::test(flavor = "multi_thread")]
async fn who_answers_in_the_services_name_is_asked_nothing() {
    let mut service = open("bench", &[]).await;
    let (session, _tokens, mut asked) = rogue(&service.endpoint).await;
    // On the same link, so the service has seen all that the rogue declared.
    let own = session.get("tactus/bench/cmd/status").payload(asked_by("rogue").encode_to_vec());
    let _replies = own.allowed_destination(Locality::Remote).timeout(PATIENCE).await.unwrap();
    next(&mut service).await;
    let client = Client::connect(&service.endpoint, Some("bench")).await.unwrap();
    assert!(!client.alive().now(), "the rogue's token is no sign of life");
    assert_eq!(client.rigs(), [""; 0]);
    let request = asked_by("test");
    let (reply, _) = tokio::join!(client.command(Command::Status, &request, PATIENCE), next(&mut service));
    assert_eq!(reply.unwrap().error, "");
    assert_eq!(asked.try_recv().ok(), None, "the rogue was asked");
    service.bus.close().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn behind_a_router_an_answer_of_another_session_is_ignored() {
    let (_router, endpoint, mut service) = behind_a_router().await;
    let client = connected(&endpoint, "bench").await;
    let (_session, _tokens, mut asked) = rogue(&endpoint).await;
    let late = loop {
        match Client::connect(&endpoint, Some("bench")).await {
            // The router may take its time on a busy machine.
            Err(BusError::Session { .. }) => {}
            other => break other.unwrap_err(),
        }
    };
    assert!(matches!(late, BusError::SeveralServices { .. }), "{late:?}");
    let request = asked_by("test");
    let (reply, ()) = tokio::join!(client.command(Command::Status, &request, PATIENCE), async {
        // The rogue answers first.
        asked.recv().await.unwrap();
        next(&mut service).await;
    });
    assert_eq!(reply.unwrap().error, "");
    service.bus.close().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn frames_of_another_publisher_are_not_the_rigs() {
    let service = open("bench", &[]).await;
    let client = Client::connect(&service.endpoint, Some("bench")).await.unwrap();
    let mut frames = client.subscribe::<pb::Frame>(History::None).await.unwrap();
    let session = raw_session(&service.endpoint).await;
    let fake = pb::Frame::from(&frame(666)).encode_to_vec();
    for _ in 0..100 {
        session.put("tactus/bench/sensor/frame", fake.clone()).await.unwrap();
    }
    // Behind them on the same link.
    let wide = session.get("tactus/bench/cmd/status").payload(Vec::new()).timeout(PATIENCE).await.unwrap();
    wide.recv_async().await.unwrap();
    service.bus.publisher().publish_frame(&frame(0));
    assert_eq!(frames.recv().await.unwrap().seq, 0);
    service.bus.close().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn behind_a_router_frames_of_another_publisher_are_dropped_and_counted() {
    let (_router, endpoint, mut service) = behind_a_router().await;
    let client = connected(&endpoint, "bench").await;
    let mut frames = client.subscribe::<pb::Frame>(History::None).await.unwrap();
    let (heard, mut listened) = mpsc::unbounded_channel();
    let hear = move |frame: pb::Frame| heard.send(frame.seq).unwrap();
    let listener = client.listen(hear).await.unwrap();
    settled(&client, &mut service.calls).await;
    let session = raw_session(&endpoint).await;
    let fake = pb::Frame::from(&frame(666)).encode_to_vec();
    // The rogue waits until it is heard: then the fakes go before the service's frame.
    let publisher = session.declare_publisher("tactus/bench/sensor/frame");
    // On a busy machine none may be dropped on the way.
    let publisher = publisher.congestion_control(CongestionControl::Block).await.unwrap();
    let matching = publisher.matching_listener().await.unwrap();
    while !publisher.matching_status().await.unwrap().matching() {
        matching.recv_async().await.unwrap();
    }
    for _ in 0..100 {
        publisher.put(fake.clone()).await.unwrap();
    }
    // The service's frames have priority, so they may overtake the fakes.
    let mut seq = 0;
    while frames.losses().foreign < 100 {
        service.bus.publisher().publish_frame(&frame(seq));
        assert_eq!(frames.recv().await.unwrap().seq, seq);
        seq += 1;
    }
    assert_eq!(frames.losses().foreign, 100);
    service.bus.publisher().publish_frame(&frame(seq));
    for heard in 0..=seq {
        assert_eq!(listened.recv().await, Some(heard));
    }
    assert_eq!((listener.foreign(), listener.unreadable()), (100, 0));
    service.bus.close().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn beyond_this_machine_the_bus_does_not_listen_without_certificates() {
    for endpoint in ["tcp/0.0.0.0:7447", "tcp/192.0.2.1:7447", "tls/0.0.0.0:7447"] {
        let config = BusConfig { listen: vec![endpoint.parse().unwrap()], ..BusConfig::default() };
        let error = Bus::open(&config, Keys::new("bench")).await.unwrap_err();
        assert!(matches!(error, BusError::Unprotected { .. }), "{endpoint}: {error:?}");
        assert!(error.to_string().contains(endpoint), "{error}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_unix_socket_serves_as_well() {
    let folder = tempfile::tempdir().unwrap();
    let endpoint: Endpoint = format!("unixsock-stream/{}/bus.sock", folder.path().display()).parse().unwrap();
    let config = BusConfig { listen: vec![endpoint.clone()], ..BusConfig::default() };
    let (bus, calls) = Bus::open(&config, Keys::new("bench")).await.unwrap();
    for socket in ["bus.sock", "bus.sock.stop"] {
        let mode = std::fs::metadata(folder.path().join(socket)).unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o660, "{socket}: the group's, in a folder that only the group enters");
    }
    let mut service = Service { bus, calls, endpoint };
    let _token = service.bus.declare_alive().await.unwrap();
    let client = Client::connect(&service.endpoint, None).await.unwrap();
    assert_eq!(client.rig(), "bench");
    let request = asked_by("test");
    let endpoint = service.endpoint.clone();
    let (reply, _) = tokio::join!(client.command(Command::Status, &request, PATIENCE), next(&mut service));
    assert!(reply.unwrap().ok);
    let mut events = client.subscribe::<pb::RunEvent>(History::All).await.unwrap();
    service.bus.publisher().publish(&event(3));
    assert_eq!(events.recv().await.unwrap().seq, 3);
    let error =
        Bus::open(&BusConfig { listen: vec![endpoint], ..BusConfig::default() }, Keys::new("other")).await;
    assert!(error.is_err(), "one service at a place");
    service.bus.close().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_lease_goes_with_its_secret_is_given_back_and_can_be_refused() {
    let mut service = open("bench", &[]).await;
    let client = Client::connect(&service.endpoint, Some("bench")).await.unwrap();
    let lease = pb::Lease { holder: "cli".to_owned(), expires_in_s: 5.0, lease: vec![7; 16] };
    let (held, request) = tokio::join!(client.hold("cli", Some("smoke")), async {
        let call = service.calls.commands.recv().await.unwrap();
        call.reply.reply(pb::CommandReply { ok: true, lease: Some(lease.clone()), ..Default::default() });
        call.request
    });
    let Request::Lease(request) = request else { panic!("{request:?}") };
    assert_eq!((request.action(), request.reason.as_str()), (pb::LeaseAction::TakeOver, "smoke"));
    let Ok(Hold::Held(held)) = held else { panic!("{held:?}") };
    assert_eq!(held.secret(), vec![7; 16]);
    let (released, request) = tokio::join!(held.release(), async {
        let call = service.calls.commands.recv().await.unwrap();
        call.reply.reply(pb::CommandReply { ok: true, ..Default::default() });
        call.request
    });
    released.unwrap();
    let Request::Lease(request) = request else { panic!("{request:?}") };
    assert_eq!((request.action(), request.lease), (pb::LeaseAction::Release, vec![7; 16]));

    let (held, ()) = tokio::join!(client.hold("cli", None), async {
        let call = service.calls.commands.recv().await.unwrap();
        let error = "held by the dashboard".to_owned();
        call.reply.reply(pb::CommandReply { error, ..Default::default() });
    });
    assert!(matches!(&held, Ok(Hold::Refused(reply)) if reply.error == "held by the dashboard"), "{held:?}");
    service.bus.close().await.unwrap();
}
