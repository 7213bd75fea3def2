//! The service as seen by plain zenoh clients, and its reachability.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::{collections::BTreeMap, fs};

use crate::lab::{event, frame, open, raw_session};
use prost::Message as _;
use tactus_bus::{Bus, BusConfig, BusError, Client, History};
use tactus_schema::{DeviceTick, Frame, FrameFlags, MonoTime, TimeStamp, WallTime, key::Keys, pb};
use zenoh_ext::{AdvancedSubscriberBuilderExt, HistoryConfig, RecoveryConfig};

#[tokio::test(flavor = "multi_thread")]
async fn keys_and_encodings_are_those_of_the_contract() {
    let mut service = open("bench", &[]).await;
    let session = raw_session(&service.endpoint).await;
    let subscriber = session.declare_subscriber("tactus/bench/**").await.unwrap();
    // Once the service has the query, it has the subscription before it.
    let request = pb::CommandRequest { who: "test".to_owned(), ..Default::default() };
    let _replies = session.get("tactus/bench/cmd/status").payload(request.encode_to_vec()).await.unwrap();
    service.calls.commands.recv().await.unwrap();

    let publisher = service.bus.publisher();
    publisher.publish_frame(&frame(0));
    publisher.publish(&pb::SensorInfo::default());
    publisher.publish(&pb::StageState::default());
    publisher.publish(&event(0));
    publisher.publish(&pb::RunState::default());
    publisher.publish(&pb::Health::default());
    publisher.publish(&pb::SafetyEvent::default());
    let mut seen = BTreeMap::new();
    while seen.len() < 7 {
        let sample = subscriber.recv_async().await.unwrap();
        seen.insert(sample.key_expr().to_string(), sample.encoding().to_string());
    }
    let seen: Vec<_> = seen.iter().map(|(key, encoding)| (key.as_str(), encoding.as_str())).collect();
    assert_eq!(
        seen,
        [
            ("tactus/bench/health", "application/protobuf;tactus.v1.Health"),
            ("tactus/bench/run/event", "application/protobuf;tactus.v1.RunEvent"),
            ("tactus/bench/run/state", "application/protobuf;tactus.v1.RunState"),
            ("tactus/bench/safety/state", "application/protobuf;tactus.v1.SafetyEvent"),
            ("tactus/bench/sensor/frame", "application/protobuf;tactus.v1.Frame"),
            ("tactus/bench/sensor/info", "application/protobuf;tactus.v1.SensorInfo"),
            ("tactus/bench/stage/state", "application/protobuf;tactus.v1.StageState"),
        ]
    );
    service.bus.close().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_stock_advanced_subscriber_gets_the_past_and_the_present() {
    let service = open("bench", &[]).await;
    let client = Client::connect(&service.endpoint, Some("bench")).await.unwrap();
    let mut own = client.subscribe::<pb::RunEvent>(History::All).await.unwrap();
    let publisher = service.bus.publisher();
    for seq in 0..100 {
        publisher.publish(&event(seq));
        own.recv().await.unwrap();
    }
    let session = raw_session(&service.endpoint).await;
    let stock = session
        .declare_subscriber("tactus/bench/run/event")
        .history(HistoryConfig::default().detect_late_publishers())
        .recovery(RecoveryConfig::default().heartbeat())
        .await
        .unwrap();
    let next = async || {
        let sample = stock.recv_async().await.unwrap();
        pb::RunEvent::decode(&*sample.payload().to_bytes()).unwrap().seq
    };
    for seq in 0..100 {
        assert_eq!(next().await, seq);
    }
    publisher.publish(&event(100));
    assert_eq!(next().await, 100);
    service.bus.close().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_published_is_byte_for_byte_what_the_python_client_reads() {
    let service = open("bench", &[]).await;
    let client = Client::connect(&service.endpoint, Some("bench")).await.unwrap();
    let mut frames = client.subscribe::<pb::Frame>(History::All).await.unwrap();
    let mut events = client.subscribe::<pb::RunEvent>(History::All).await.unwrap();
    let publisher = service.bus.publisher();
    publisher.publish_frame(&Frame {
        seq: 300,
        epoch: 2,
        device_tick: Some(DeviceTick(7)),
        received: TimeStamp { mono: MonoTime::from_ns(1_000_000_000), wall: WallTime::from_ns(5) },
        counts: vec![100.0, -0.5].into(),
        flags: FrameFlags::GAP_BEFORE,
        lost_before: 3,
        simulated: true,
        bad_elements: [].into(),
        temperature_c: None,
    });
    let finished = pb::RunFinished {
        exit_status: pb::ExitStatus::Degraded.into(),
        message: "ok".to_owned(),
        ..Default::default()
    };
    publisher.publish(&pb::RunEvent {
        seq: 9,
        run_id: "r1".to_owned(),
        t_mono_ns: 1_000_000_000,
        t_wall_ns: 5,
        event: Some(pb::run_event::Event::Finished(finished)),
    });
    assert_eq!(frames.recv().await.unwrap().encode_to_vec(), golden("frame"));
    assert_eq!(events.recv().await.unwrap().encode_to_vec(), golden("run_event"));
    service.bus.close().await.unwrap();
}

/// Bytes written by hand, which the Python client's tests read.
fn golden(message: &str) -> Vec<u8> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../clients/python/tests/golden");
    let text = fs::read_to_string(format!("{folder}/{message}.hex")).unwrap();
    text.lines()
        .flat_map(|line| line.split('#').next().unwrap_or_default().split_whitespace())
        .map(|byte| u8::from_str_radix(byte, 16).unwrap())
        .collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_service_listens_where_it_was_told_and_nowhere_else() {
    let service = open("bench", &[]).await;
    let (silent, _calls) =
        Bus::open(&BusConfig { listen: vec![], ..BusConfig::default() }, Keys::new("silent")).await.unwrap();
    let listening = listening_sockets();
    assert!(listening.iter().any(|socket| socket == service.endpoint.address()), "{listening:?}");
    assert!(listening.iter().all(|socket| socket.starts_with("127.0.0.1:")), "{listening:?}");
    silent.close().await.unwrap();
    service.bus.close().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_port_in_use_is_an_error_that_names_it() {
    let service = open("bench", &[]).await;
    let config = BusConfig { listen: vec![service.endpoint.clone()], ..BusConfig::default() };
    let error = Bus::open(&config, Keys::new("other")).await.unwrap_err();
    assert!(matches!(error, BusError::Open { .. }), "{error:?}");
    assert!(error.to_string().contains(service.endpoint.address()), "{error}");
    service.bus.close().await.unwrap();
}

/// Addresses of this process's listening TCP sockets and of all its UDP sockets.
fn listening_sockets() -> Vec<String> {
    let inodes: Vec<String> = fs::read_dir("/proc/self/fd")
        .unwrap()
        .filter_map(|entry| fs::read_link(entry.unwrap().path()).ok())
        .filter_map(|link| Some(link.to_str()?.strip_prefix("socket:[")?.strip_suffix(']')?.to_owned()))
        .collect();
    let mut sockets = Vec::new();
    for (table, listening) in [("tcp", "0A"), ("tcp6", "0A"), ("udp", ""), ("udp6", "")] {
        for line in fs::read_to_string(format!("/proc/self/net/{table}")).unwrap().lines().skip(1) {
            let fields: Vec<_> = line.split_whitespace().collect();
            if fields[3].starts_with(listening) && inodes.iter().any(|inode| inode == fields[9]) {
                sockets.push(address(fields[1]));
            }
        }
    }
    sockets
}

/// `0100007F:1D17` to `127.0.0.1:7447`; IPv6 is unchanged.
fn address(hex: &str) -> String {
    let (host, port) = hex.split_once(':').unwrap();
    let port = u16::from_str_radix(port, 16).unwrap();
    match u32::from_str_radix(host, 16) {
        Ok(host) => format!("{}:{port}", std::net::Ipv4Addr::from(host.swap_bytes())),
        Err(_) => format!("[{host}]:{port}"),
    }
}
