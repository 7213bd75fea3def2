//! The paths of the site.

use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::extract::{Path, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use axum::middleware::{from_fn_with_state, map_response};
use axum::response::sse::{Event, KeepAlive, Sse};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use futures_util::{Stream, stream};
use tactus_schema::key::Command;
use tokio::sync::Semaphore;
use tokio::time::{Instant, sleep_until};

use crate::guard::{Hosts, guard};
use crate::live::{Live, NotDone};
use crate::token::Token;

/// Shortest time between two views sent to one page.
const PERIOD: Duration = Duration::from_millis(50);
/// Open pages at most.
const PAGES_MAX: usize = 64;

/// Carries the reason to take over the lease.
const TAKE_OVER: HeaderName = HeaderName::from_static("x-take-over");

const HTML: &str = include_str!("../page/index.html");
const STYLE: &str = include_str!("../page/style.css");
const SCRIPT: &str = include_str!("../page/script.js");
/// The page loads nothing from other sites and cannot be embedded in other pages.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' data:; \
                      base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// Carries the token of commands.
const TOKEN: HeaderName = HeaderName::from_static("x-tactus-token");

#[derive(Clone)]
struct Shared {
    live: Live,
    token: Arc<Token>,
    pages: Arc<Semaphore>,
}

/// The whole site.
pub(crate) fn site(live: Live, hosts: Arc<Hosts>, token: Arc<Token>) -> Router {
    let file = |kind: &'static str, text: &'static str| {
        get(move || async move { ([(header::CONTENT_TYPE, kind)], text) })
    };
    Router::new()
        .route("/", file("text/html; charset=utf-8", HTML))
        .route("/style.css", file("text/css; charset=utf-8", STYLE))
        .route("/script.js", file("text/javascript; charset=utf-8", SCRIPT))
        .route("/live", get(live_views))
        .route("/stop", post(stop))
        .route("/{command}", post(command))
        .with_state(Shared { live, token, pages: Arc::new(Semaphore::new(PAGES_MAX)) })
        .layer(from_fn_with_state(hosts, guard))
        .layer(map_response(with_policy))
}

async fn with_policy(mut response: Response) -> Response {
    let headers = response.headers_mut();
    headers.insert(header::CONTENT_SECURITY_POLICY, HeaderValue::from_static(POLICY));
    headers.insert(header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    headers.insert(header::REFERRER_POLICY, HeaderValue::from_static("no-referrer"));
    headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
    response
}

async fn live_views(State(Shared { live, pages, .. }): State<Shared>) -> Response {
    let Ok(page) = pages.try_acquire_owned() else {
        return (StatusCode::SERVICE_UNAVAILABLE, format!("{PAGES_MAX} pages are open already"))
            .into_response();
    };
    Sse::new(views(&live, page)).keep_alive(KeepAlive::default()).into_response()
}

/// The latest view after each change, at most once per [`PERIOD`]; `held` is released when the page is closed.
fn views<H>(live: &Live, held: H) -> impl Stream<Item = Result<Event, Infallible>> + use<H> {
    let mut view = live.view();
    view.mark_changed();
    stream::unfold((view, Instant::now(), held), |(mut view, next, held)| async move {
        sleep_until(next).await;
        view.changed().await.ok()?;
        let event = Event::default().data(view.borrow_and_update().json().to_string());
        Some((Ok(event), (view, Instant::now() + PERIOD, held)))
    })
}

/// A stop, which needs neither the token nor the lease.
async fn stop(State(Shared { live, .. }): State<Shared>) -> Response {
    match live.stop().await {
        Ok(()) => StatusCode::NO_CONTENT.into_response(),
        Err(error) => (StatusCode::CONFLICT, error).into_response(),
    }
}

/// A command that needs the lease: 401 without the token, 423 if another client holds the lease.
async fn command(
    State(Shared { live, token, .. }): State<Shared>,
    Path(name): Path<String>,
    headers: HeaderMap,
) -> Response {
    let command = match name.as_str() {
        "pause" => Command::Pause,
        "resume" => Command::Resume,
        "reset" => Command::Reset,
        _ => return StatusCode::NOT_FOUND.into_response(),
    };
    if !headers.get(TOKEN).is_some_and(|given| token.is(given.as_bytes())) {
        let error =
            "this page has no token: open the address with the token that tactus-web names at its start";
        return (StatusCode::UNAUTHORIZED, error).into_response();
    }
    let take_over = headers.get(TAKE_OVER).and_then(|reason| reason.to_str().ok());
    match live.command(command, take_over).await {
        Ok(()) => StatusCode::NO_CONTENT.into_response(),
        Err(NotDone::Held(error)) => (StatusCode::LOCKED, error).into_response(),
        Err(NotDone::Failed(error)) => (StatusCode::CONFLICT, error).into_response(),
    }
}
