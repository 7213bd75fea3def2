//! Live channels for Foxglove and its relatives, over Foxglove's WebSocket protocol.
//!
//! A viewer is shown what `tactus export --format foxglove` writes, by the same code, and commands nothing. One that is too slow
//! misses the oldest messages, is told how many, and delays nobody. Pages of other sites than Foxglove's and this one are refused:
//! any page that a person opens could connect otherwise.

mod channels;
mod viewer;

use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::extract::State;
use axum::extract::ws::{Message, WebSocket, WebSocketUpgrade};
use axum::http::{HeaderMap, StatusCode};
use axum::middleware::from_fn_with_state;
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use tokio::sync::Semaphore;
use tokio::sync::broadcast::error::RecvError;
use tokio::time::timeout;
use tracing::warn;

use crate::guard::{Hosts, guard};
use crate::live::Live;
use viewer::Viewer;

pub(crate) use channels::Channels;

/// Names of the protocol, the present one first.
const PROTOCOLS: [&str; 2] = ["foxglove.sdk.v1", "foxglove.websocket.v1"];
/// Viewers at most.
const VIEWERS_MAX: usize = 16;
/// Longest request of a viewer.
const REQUEST_BYTES_MAX: usize = 64 << 10;
/// A viewer that takes nothing for this long is left.
const PATIENCE: Duration = Duration::from_secs(10);
/// The site of the viewer in a browser.
const FOXGLOVE: &str = "https://app.foxglove.dev";

#[derive(Clone)]
struct Shared {
    live: Live,
    hosts: Arc<Hosts>,
    /// Other sites whose pages may look.
    friends: Arc<[String]>,
    places: Arc<Semaphore>,
}

/// The viewer did not take a message.
struct Gone;

/// The path for viewers.
pub(crate) fn site(live: Live, hosts: Arc<Hosts>, mut friends: Vec<String>) -> Router {
    friends.push(FOXGLOVE.to_owned());
    let places = Arc::new(Semaphore::new(VIEWERS_MAX));
    Router::new()
        .route("/foxglove", get(connect))
        .with_state(Shared { live, hosts: Arc::clone(&hosts), friends: friends.into(), places })
        .layer(from_fn_with_state(hosts, guard))
}

async fn connect(State(shared): State<Shared>, headers: HeaderMap, request: WebSocketUpgrade) -> Response {
    let Shared { live, hosts, friends, places } = shared;
    if let Some(page) = hosts.foreign_page(&headers, &friends) {
        warn!(page, "a page of another site was refused; --viewer-origin would let it look");
        return (StatusCode::FORBIDDEN, "this site may not look: see tactus-web --viewer-origin")
            .into_response();
    }
    let request = request.protocols(PROTOCOLS).max_message_size(REQUEST_BYTES_MAX);
    if request.selected_protocol().is_none() {
        let error = format!("only {} is spoken here", PROTOCOLS.join(" and "));
        return (StatusCode::BAD_REQUEST, error).into_response();
    }
    let Ok(place) = places.try_acquire_owned() else {
        return (StatusCode::SERVICE_UNAVAILABLE, format!("{VIEWERS_MAX} viewers are connected already"))
            .into_response();
    };
    request.on_upgrade(async move |socket| {
        // Either way the viewer is not there any more.
        let _gone = show(socket, &live).await;
        drop(place);
    })
}

/// Shows a viewer what it wants until it goes.
async fn show(mut socket: WebSocket, live: &Live) -> Result<(), Gone> {
    let (first, mut rest) = live.channels(|channels, board| channels.join(board));
    let mut viewer = Viewer::default();
    for text in first {
        send(&mut socket, Message::text(text)).await?;
    }
    loop {
        tokio::select! {
            told = rest.recv() => match told {
                Ok(told) => for message in viewer.on_told(&told) {
                    send(&mut socket, message).await?;
                },
                Err(RecvError::Lagged(missed)) => {
                    live.channels(|channels, _| channels.on_missed(missed));
                    send(&mut socket, viewer.on_missed(missed)).await?;
                }
                Err(RecvError::Closed) => return Ok(()),
            },
            request = socket.recv() => match request {
                Some(Ok(Message::Text(text))) => {
                    let answers = live.channels(|channels, board| viewer.on_request(&text, channels, board));
                    for message in answers {
                        send(&mut socket, message).await?;
                    }
                }
                // The library answers pings, and this server expects no bytes.
                Some(Ok(Message::Binary(_) | Message::Ping(_) | Message::Pong(_))) => {}
                Some(Ok(Message::Close(_)) | Err(_)) | None => return Ok(()),
            },
        }
    }
}

async fn send(socket: &mut WebSocket, message: Message) -> Result<(), Gone> {
    match timeout(PATIENCE, socket.send(message)).await {
        Ok(Ok(())) => Ok(()),
        Ok(Err(_)) | Err(_) => Err(Gone),
    }
}
