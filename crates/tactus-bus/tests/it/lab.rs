//! Test fixtures: a service on a free port, raw zenoh clients, and a link that can stall.
#![allow(dead_code, reason = "each test takes what it needs")]
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::{net::TcpListener as StdListener, time::Duration};

use tactus_bus::{Bus, BusConfig, BusError, Calls, Client, Credentials, Endpoint, Lab};
use tactus_schema::{
    Frame, FrameFlags, MonoTime, TimeStamp, WallTime,
    key::{Command, Keys},
    pb,
};
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    net::{TcpListener, TcpStream},
    sync::watch,
    task::JoinHandle,
};

/// A service for a rig named `bench`, and its endpoint.
pub(crate) struct Service {
    pub(crate) bus: Bus,
    pub(crate) calls: Calls,
    pub(crate) endpoint: Endpoint,
}

/// An endpoint on which nothing listens.
pub(crate) fn free_endpoint() -> Endpoint {
    let port = StdListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    format!("tcp/127.0.0.1:{port}").parse().unwrap()
}

/// Opens a service that connects to `connect`.
pub(crate) async fn open(rig: &str, connect: &[Endpoint]) -> Service {
    open_for(rig, &[], connect).await
}

/// As [`open`], for services of other rigs too.
pub(crate) async fn open_for(rig: &str, guests: &[&str], connect: &[Endpoint]) -> Service {
    let guests = guests.iter().map(|&guest| guest.to_owned()).collect();
    open_with(rig, BusConfig { guests, connect: connect.to_vec(), ..BusConfig::default() }).await
}

/// As [`open`], with another configuration, but for its place.
pub(crate) async fn open_with(rig: &str, config: BusConfig) -> Service {
    loop {
        let endpoint = free_endpoint();
        let config = BusConfig { listen: vec![endpoint.clone()], ..config.clone() };
        match Bus::open(&config, Keys::new(rig)).await {
            Ok((bus, calls)) => return Service { bus, calls, endpoint },
            // Somebody else took the port meanwhile.
            Err(BusError::Open { .. } | BusError::Stop { .. }) => {}
            Err(error) => panic!("{error}"),
        }
    }
}

/// A plain zenoh session.
pub(crate) async fn raw_session(endpoint: &Endpoint) -> zenoh::Session {
    let mut config = zenoh::Config::default();
    config.insert_json5("mode", "\"client\"").unwrap();
    config.insert_json5("scouting/multicast/enabled", "false").unwrap();
    config.insert_json5("connect/endpoints", &format!("[\"{endpoint}\"]")).unwrap();
    zenoh::open(config).await.unwrap()
}

/// A zenoh router without access control, and its endpoint.
pub(crate) async fn router() -> (zenoh::Session, Endpoint) {
    loop {
        let endpoint = free_endpoint();
        if let Ok(session) = router_at(&endpoint).await {
            return (session, endpoint);
        }
    }
}

/// As [`router`], at a place where nothing listens.
pub(crate) async fn router_at(endpoint: &Endpoint) -> Result<zenoh::Session, zenoh::Error> {
    let mut config = zenoh::Config::default();
    config.insert_json5("mode", "\"router\"").unwrap();
    config.insert_json5("scouting/multicast/enabled", "false").unwrap();
    config.insert_json5("listen/endpoints", &format!("[\"{endpoint}\"]")).unwrap();
    zenoh::open(config).await
}

/// A client of a router, which may take its time on a busy machine.
pub(crate) async fn connected(endpoint: &Endpoint, rig: &str) -> Client {
    loop {
        match Client::connect(endpoint, Some(rig)).await {
            Ok(client) => return client,
            Err(BusError::Session { .. }) => {}
            Err(error) => panic!("{error}"),
        }
    }
}

/// Waits until the rig is found at the router, and returns a client that is there.
pub(crate) async fn found(router: &Endpoint, rig: &str, credentials: &Credentials) -> Client {
    let mut lab = loop {
        match Lab::connect(router, credentials).await {
            Ok(lab) => break lab,
            // The router may take its time on a busy machine.
            Err(BusError::Session { .. } | BusError::NoService { .. }) => {}
            Err(error) => panic!("{error}"),
        }
    };
    while !lab.rigs().iter().any(|found| found == rig) {
        lab.changed().await.unwrap();
    }
    lab.client(rig).await.unwrap()
}

/// Returns once the service has processed the client's earlier declarations: declarations and commands of one session keep
/// their order.
pub(crate) async fn settled(client: &Client, calls: &mut Calls) {
    tokio::join!(refused(client), async { drop(calls.commands.recv().await) });
}

/// As [`settled`], of a service whose commands somebody else drops.
pub(crate) async fn refused(client: &Client) {
    let request = pb::CommandRequest { who: "test".to_owned(), ..Default::default() };
    let answer = client.command(Command::Status, &request, Duration::from_hours(1)).await;
    assert!(matches!(answer, Err(BusError::NoAnswer { .. })), "{answer:?}");
}

/// A frame of 48 elements with that number.
pub(crate) fn frame(seq: u64) -> Frame {
    let ns = i64::try_from(seq).unwrap() * 33_333_333;
    Frame {
        seq,
        epoch: 1,
        device_tick: None,
        received: TimeStamp { mono: MonoTime::from_ns(ns), wall: WallTime::from_ns(ns) },
        counts: vec![seq as f32; 48].into(),
        flags: FrameFlags::default(),
        lost_before: 0,
        simulated: true,
        bad_elements: [].into(),
        temperature_c: None,
    }
}

/// A run event with that number.
pub(crate) fn event(seq: u64) -> pb::RunEvent {
    pb::RunEvent { seq, run_id: "run-1".to_owned(), ..Default::default() }
}

/// A link between client and service that can stall or break.
pub(crate) struct Link {
    pub(crate) endpoint: Endpoint,
    state: watch::Sender<LinkState>,
    task: JoinHandle<()>,
}

#[derive(Clone, Copy, PartialEq)]
enum LinkState {
    Flowing,
    Still,
    Broken,
}

impl Link {
    pub(crate) async fn to(service: &Endpoint) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let endpoint = format!("tcp/{}", listener.local_addr().unwrap()).parse().unwrap();
        let (state, watched) = watch::channel(LinkState::Flowing);
        let address = service.address().to_owned();
        let task = tokio::spawn(async move {
            while let Ok((client, _)) = listener.accept().await {
                let Ok(service) = TcpStream::connect(&address).await else { continue };
                tokio::spawn(carry(client, service, watched.clone()));
            }
        });
        Self { endpoint, state, task }
    }

    /// Stops passing on data from the service.
    pub(crate) fn stand_still(&self) {
        self.state.send_replace(LinkState::Still);
    }

    /// Breaks all connections, and each new one, until the link flows again.
    pub(crate) fn cut(&self) {
        self.state.send_replace(LinkState::Broken);
    }

    /// Passes on all data again.
    pub(crate) fn flow(&self) {
        self.state.send_replace(LinkState::Flowing);
    }

    /// Breaks all connections, as a crashing service does, and accepts no new ones.
    pub(crate) fn break_off(&self) {
        self.state.send_replace(LinkState::Broken);
        self.task.abort();
    }
}

async fn carry(client: TcpStream, service: TcpStream, mut state: watch::Receiver<LinkState>) {
    let (mut from_client, mut to_client) = client.into_split();
    let (mut from_service, mut to_service) = service.into_split();
    let mut broken = state.clone();
    tokio::select! {
        biased;
        _ = broken.wait_for(|state| *state == LinkState::Broken) => {}
        _ = tokio::io::copy(&mut from_client, &mut to_service) => {}
        () = async {
            let mut bytes = vec![0; 65_536];
            loop {
                if state.wait_for(|state| *state == LinkState::Flowing).await.is_err() {
                    return;
                }
                match from_service.read(&mut bytes).await {
                    // It may have been cut since the read began, and what came then is not passed on.
                    Ok(count) if count > 0 => {
                        if *state.borrow() == LinkState::Broken {
                            return;
                        }
                        if to_client.write_all(&bytes[..count]).await.is_err() {
                            return;
                        }
                    }
                    _ => return,
                }
            }
        } => {}
    }
}
