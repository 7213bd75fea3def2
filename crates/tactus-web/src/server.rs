//! Accepts connections. However many are open, the next request is read: with no room left, the oldest connection that has asked
//! nothing yet is closed, so that a stop always finds a place.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use axum::Router;
use axum::body::Body;
use axum::extract::Request;
use axum::response::Response;
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper_util::rt::{TokioIo, TokioTimer};
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::TcpListener;
use tokio::task::AbortHandle;
use tokio::time::sleep;
use tower_service::Service as _;
use tracing::{debug, warn};

/// Open connections at most.
const CONNECTIONS_MAX: usize = 256;
/// Time for the headers of a request.
const HEADER_TIMEOUT: Duration = Duration::from_secs(5);
/// Pause after the system refused a connection, which it does if it has no room for more.
const REFUSED: Duration = Duration::from_millis(10);

/// Open connections, the oldest first.
#[derive(Debug, Default)]
struct Connections(VecDeque<Connection>);

#[derive(Debug)]
struct Connection {
    /// It has sent at least one whole request.
    has_asked: Arc<AtomicBool>,
    task: AbortHandle,
}

/// Serves for ever.
pub(crate) async fn serve(listener: TcpListener, site: Router) {
    let mut connections = Connections::default();
    loop {
        match listener.accept().await {
            Ok((stream, _)) => {
                connections.make_room();
                let has_asked = Arc::new(AtomicBool::new(false));
                let task = tokio::spawn(answer(stream, site.clone(), Arc::clone(&has_asked))).abort_handle();
                connections.0.push_back(Connection { has_asked, task });
            }
            Err(error) => {
                warn!(%error, "a connection was refused");
                sleep(REFUSED).await;
            }
        }
    }
}

impl Connections {
    fn make_room(&mut self) {
        if self.0.len() < CONNECTIONS_MAX {
            return;
        }
        self.0.retain(|connection| !connection.task.is_finished());
        if self.0.len() < CONNECTIONS_MAX {
            return;
        }
        let silent = self.0.iter().position(|connection| !connection.has_asked.load(Ordering::Relaxed));
        if let Some(connection) = self.0.remove(silent.unwrap_or_default()) {
            debug!("a connection is closed to make room");
            connection.task.abort();
        }
    }
}

/// Answers the requests of one connection.
pub(crate) async fn answer(
    stream: impl AsyncRead + AsyncWrite + Send + Unpin + 'static,
    site: Router,
    has_asked: Arc<AtomicBool>,
) {
    let service = service_fn(move |request: Request<Incoming>| {
        has_asked.store(true, Ordering::Relaxed);
        let mut site = site.clone();
        async move {
            let response: Result<Response<Body>, _> = site.call(request).await;
            response
        }
    });
    let served = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(HEADER_TIMEOUT)
        .serve_connection(TokioIo::new(stream), service)
        // For viewers, which go on with WebSocket.
        .with_upgrades()
        .await;
    if let Err(error) = served {
        debug!(%error, "a connection broke off");
    }
}

#[cfg(test)]
#[path = "server_tests.rs"]
mod tests;
