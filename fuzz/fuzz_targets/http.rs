//! Any bytes on a connection of the dashboard, through the server and the site themselves; only the bus behind them is replaced. Every
//! answer is whole and carries the site's policy, a command is done only with the token, and no request costs much memory.
//!
//! `@` in the input stands for the token, which no input can guess.
#![no_main]
#![allow(dead_code, reason = "the modules are the dashboard's, and a part of each is used")]

#[path = "../../crates/tactus-web/src/guard.rs"]
mod guard;
#[path = "../../crates/tactus-web/src/order.rs"]
mod order;
#[path = "../../crates/tactus-web/src/page.rs"]
mod page;
#[path = "../../crates/tactus-web/src/server.rs"]
mod server;
#[path = "../../crates/tactus-web/src/site.rs"]
mod site;
#[path = "../../crates/tactus-web/src/token.rs"]
mod token;

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, LazyLock, Mutex};
use std::time::Duration;

use axum::Router;
use libfuzzer_sys::fuzz_target;
use tactus_fuzz::memory;
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _, DuplexStream, duplex};
use tokio::runtime::Runtime;
use tokio::time::timeout;

use live::Live;
use token::Token;

/// Stands for the token in the input.
const TOKEN_MARK: u8 = b'@';

/// Most memory that a connection takes: hyper's buffer of 400 KiB for a head, and the page.
const MEMORY_MAX_BYTES: usize = 4 << 20;

/// Room in the connection, in each direction.
const ROOM_BYTES: usize = 4096;

/// Virtual time after which an open connection is left. A page of live views has no end.
const PATIENCE: Duration = Duration::from_secs(30);

/// The bus's place: it notes what was asked.
mod live {
    use std::sync::{Arc, Mutex, PoisonError};

    use axum::body::Bytes;
    use serde_json::Value;
    use tokio::sync::broadcast;

    use crate::order::{Order, Question};

    /// Why a command was not done.
    #[derive(Debug)]
    pub(crate) enum NotDone {
        Held(String),
        Failed(String),
    }

    /// What the site did with the rig.
    #[derive(Debug, Default, Clone, PartialEq, Eq)]
    pub(crate) struct Done {
        pub(crate) stops: usize,
        pub(crate) commands: usize,
    }

    #[derive(Debug, Clone)]
    pub(crate) struct Live {
        done: Arc<Mutex<Done>>,
        pages: broadcast::Sender<Bytes>,
    }

    impl Live {
        pub(crate) fn new() -> Self {
            Self { done: Arc::default(), pages: broadcast::Sender::new(1) }
        }

        /// What was done since the last call.
        pub(crate) fn take(&self) -> Done {
            std::mem::take(&mut self.done.lock().unwrap_or_else(PoisonError::into_inner))
        }

        pub(crate) fn join(&self) -> (Bytes, broadcast::Receiver<Bytes>) {
            (self.whole(), self.pages.subscribe())
        }

        pub(crate) fn whole(&self) -> Bytes {
            Bytes::from_static(b"event: view\ndata: {}\n\n")
        }

        pub(crate) fn history(&self) -> Vec<u8> {
            vec![0; 8]
        }

        pub(crate) fn take_zero(&self) -> Result<(), String> {
            self.count_command();
            Ok(())
        }

        pub(crate) async fn ask(&self, question: Question) -> Result<Value, NotDone> {
            self.count_command();
            match question {
                Question::Experiments => Ok(Value::Null),
                Question::Plan(request) => Err(NotDone::Failed(request.experiment)),
            }
        }

        fn count_command(&self) {
            self.done.lock().unwrap_or_else(PoisonError::into_inner).commands += 1;
        }

        pub(crate) async fn stop(&self) -> Result<(), String> {
            self.done.lock().unwrap_or_else(PoisonError::into_inner).stops += 1;
            Ok(())
        }

        pub(crate) async fn command(&self, order: Order, take_over: Option<&str>) -> Result<String, NotDone> {
            self.count_command();
            match (order, take_over) {
                (Order::Pause, _) => Ok(String::new()),
                (Order::Run(request), Some(_)) => Ok(request.parameters_json),
                (_, Some(reason)) => Err(NotDone::Failed(reason.to_owned())),
                (_, None) => Err(NotDone::Held("another client".into())),
            }
        }
    }
}

struct Dashboard {
    runtime: Runtime,
    live: Live,
    site: Router,
    token: String,
}

static DASHBOARD: LazyLock<Mutex<Dashboard>> = LazyLock::new(|| {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().start_paused(true).build();
    let token = Token::new().expect("random numbers");
    let text = token.fragment().trim_start_matches('#').to_owned();
    let live = Live::new();
    let hosts = guard::Hosts::new(([127, 0, 0, 1], 7480).into(), vec!["lab.example".to_owned()]);
    let site = site::site(live.clone(), hosts, Arc::new(token));
    Mutex::new(Dashboard { runtime: runtime.expect("a runtime"), live, site, token: text })
});

fuzz_target!(|input: &[u8]| {
    let dashboard = DASHBOARD.lock().expect("no input before has panicked");
    let request = with_token(input, &dashboard.token);
    let answers =
        memory::within(MEMORY_MAX_BYTES, || dashboard.runtime.block_on(answers(&dashboard.site, &request)));
    let done = dashboard.live.take();
    if !input.contains(&TOKEN_MARK) {
        assert_eq!(done.commands, 0, "a command without the token");
    }
    if done.stops + done.commands > 0 {
        // Both of a site's own names have a letter or a digit after their header's name.
        let head = String::from_utf8_lossy(&request).to_ascii_lowercase();
        assert!(head.contains("host:") && head.contains("post"), "only a request to this site does anything");
    }
    check(&answers);
});

fn with_token(input: &[u8], token: &str) -> Vec<u8> {
    let mut request = Vec::new();
    for byte in input {
        match *byte {
            TOKEN_MARK => request.extend(token.as_bytes()),
            byte => request.push(byte),
        }
    }
    request
}

/// Sends the bytes, and takes what comes back until the connection ends.
async fn answers(site: &Router, request: &[u8]) -> Vec<u8> {
    let (client, server) = duplex(ROOM_BYTES);
    let (mut reader, writer) = tokio::io::split(client);
    let mut answers = Vec::new();
    let everything = async {
        tokio::join!(
            server::answer(server, site.clone(), Arc::new(AtomicBool::new(false))),
            send(writer, request),
            reader.read_to_end(&mut answers),
        )
    };
    // The views of an open page are cut off.
    let ended = timeout(PATIENCE, everything).await;
    drop(ended);
    answers
}

async fn send(mut writer: tokio::io::WriteHalf<DuplexStream>, request: &[u8]) {
    // A server that has closed the connection reads no more.
    drop(writer.write_all(request).await);
    drop(writer.shutdown().await);
}

/// The answers are HTTP with the site's headers. A request that is none gets at most a short refusal from the server itself.
fn check(answers: &[u8]) {
    if answers.is_empty() {
        return;
    }
    let text = String::from_utf8_lossy(answers);
    assert!(text.starts_with("HTTP/1."), "{text}");
    let mut parts = text.split("\r\n");
    let status: u16 = parts
        .next()
        .and_then(|line| line.split(' ').nth(1))
        .and_then(|status| status.parse().ok())
        .expect("a status");
    assert_ne!(status, 500, "{text}");
    let is_servers_own = matches!(status, 400 | 414 | 431) && !text.contains("content-type");
    if !is_servers_own {
        assert!(text.contains("content-security-policy: default-src 'none'"), "{text}");
    }
}
