//! The paths of the site.

use std::convert::Infallible;
use std::sync::Arc;

use axum::Router;
use axum::body::{Body, Bytes};
use axum::extract::{DefaultBodyLimit, Path, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use axum::middleware::{from_fn_with_state, map_response};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use futures_util::{Stream, stream};
use serde_json::Value;
use tokio::sync::Semaphore;
use tokio::sync::broadcast::{self, error::RecvError};

use crate::guard::{Hosts, guard};
use crate::live::{Live, NotDone};
use crate::metrics;
use crate::order::{Order, Question};
use crate::page;
use crate::runs::{Download, NotRead, Runs};
use crate::token::Token;

/// Open pages at most.
const PAGES_MAX: usize = 64;
/// Longest body of a request: the parameters of an experiment.
const BODY_BYTES_MAX: usize = 64 << 10;

/// Carries the reason to take over the lease.
const TAKE_OVER: HeaderName = HeaderName::from_static("x-take-over");

/// The page loads nothing from other sites and cannot be embedded in other pages.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' data:; \
                      base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// A report has its style inline. It has no scripts, and may not have any.
const REPORT_POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'; \
                             frame-ancestors 'none'; sandbox";

/// Carries the token of commands.
const TOKEN: HeaderName = HeaderName::from_static("x-tactus-token");

#[derive(Clone)]
struct Shared {
    live: Live,
    runs: Runs,
    token: Arc<Token>,
    pages: Arc<Semaphore>,
}

/// The whole site.
pub(crate) fn site(live: Live, runs: Runs, hosts: Arc<Hosts>, token: Arc<Token>) -> Router {
    let mut site = Router::new();
    for file in page::FILES {
        site = site.route(file.path, get(async move || ([(header::CONTENT_TYPE, file.kind)], file.text)));
    }
    site.route("/live", get(live_views))
        .route("/history", get(history))
        .route("/metrics", get(metrics_text))
        .route("/runs", get(run_list))
        .route("/runs/compare/{ids}", get(compare))
        .route("/runs/{id}/notes", post(notes))
        .route("/runs/{id}/again", post(again))
        .route("/runs/{id}/{what}", get(of_run))
        .route("/stop", post(stop))
        .route("/zero", post(zero))
        .route("/experiments", post(experiments))
        .route("/plan", post(plan))
        .route("/{command}", post(command))
        .with_state(Shared { live, runs, token, pages: Arc::new(Semaphore::new(PAGES_MAX)) })
        .layer(DefaultBodyLimit::max(BODY_BYTES_MAX))
        .layer(from_fn_with_state(hosts, guard))
        .layer(map_response(with_policy))
}

async fn with_policy(mut response: Response) -> Response {
    let headers = response.headers_mut();
    // A report has a policy of its own.
    headers.entry(header::CONTENT_SECURITY_POLICY).or_insert(HeaderValue::from_static(POLICY));
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
    ([(header::CONTENT_TYPE, "text/event-stream")], Body::from_stream(views(live, page))).into_response()
}

/// Server-sent events: the whole board first, then what follows. `held` is released when the page is closed.
fn views<H>(live: Live, held: H) -> impl Stream<Item = Result<Bytes, Infallible>> + use<H> {
    let (first, rest) = live.join();
    stream::unfold((Some(first), rest, live, held), |(first, mut rest, live, held)| async move {
        let message = match first {
            Some(first) => first,
            None => next(&mut rest, &live).await?,
        };
        Some((Ok(message), (None, rest, live, held)))
    })
}

/// The next message. A page that was too slow gets the whole board.
async fn next(rest: &mut broadcast::Receiver<Bytes>, live: &Live) -> Option<Bytes> {
    match rest.recv().await {
        Ok(message) => Some(message),
        Err(RecvError::Lagged(_)) => Some(live.whole()),
        Err(RecvError::Closed) => None,
    }
}

async fn history(State(Shared { live, .. }): State<Shared>) -> Response {
    ([(header::CONTENT_TYPE, "application/octet-stream")], live.history()).into_response()
}

async fn metrics_text(State(Shared { live, .. }): State<Shared>) -> Response {
    ([(header::CONTENT_TYPE, metrics::KIND)], live.metrics()).into_response()
}

async fn run_list(State(Shared { runs, .. }): State<Shared>) -> Response {
    of_files(runs.list().await)
}

async fn compare(State(Shared { runs, .. }): State<Shared>, Path(ids): Path<String>) -> Response {
    of_files(runs.compare(ids.split(',').map(str::to_owned).collect()).await)
}

/// The report of a run, or its data as a file.
async fn of_run(
    State(Shared { runs, .. }): State<Shared>,
    Path((id, what)): Path<(String, String)>,
) -> Response {
    match what.as_str() {
        "report" => match runs.report(id).await {
            Ok(html) => {
                let head = [
                    (header::CONTENT_TYPE, "text/html; charset=utf-8"),
                    (header::CONTENT_SECURITY_POLICY, REPORT_POLICY),
                ];
                (head, html).into_response()
            }
            Err(failure) => not_read(failure),
        },
        format => match runs.download(id, format).await {
            Ok(Download { name, bytes }) => {
                let head = [
                    (header::CONTENT_TYPE, "application/octet-stream".to_owned()),
                    (header::CONTENT_DISPOSITION, format!("attachment; filename=\"{name}\"")),
                ];
                (head, Body::from_stream(bytes)).into_response()
            }
            Err(failure) => not_read(failure),
        },
    }
}

/// Tags and note of a run.
async fn notes(
    State(Shared { runs, token, .. }): State<Shared>,
    Path(id): Path<String>,
    headers: HeaderMap,
    body: Bytes,
) -> Response {
    if let Some(refusal) = without_token(&token, &headers) {
        return refusal;
    }
    of_files(runs.mark(id, &body).await)
}

/// An earlier run again, with its script, parameters and seed; as [`command`].
async fn again(
    State(Shared { live, runs, token, .. }): State<Shared>,
    Path(id): Path<String>,
    headers: HeaderMap,
    body: Bytes,
) -> Response {
    if let Some(refusal) = without_token(&token, &headers) {
        return refusal;
    }
    match runs.again(id, &body).await {
        Ok(request) => commanded(&live, Order::Run(request), &headers).await,
        Err(failure) => not_read(failure),
    }
}

fn of_files(answer: Result<Value, NotRead>) -> Response {
    match answer {
        Ok(value) => ([(header::CONTENT_TYPE, "application/json")], value.to_string()).into_response(),
        Err(failure) => not_read(failure),
    }
}

fn not_read(failure: NotRead) -> Response {
    match failure {
        NotRead::Unknown(error) => (StatusCode::NOT_FOUND, error).into_response(),
        NotRead::Wrong(error) => (StatusCode::BAD_REQUEST, error).into_response(),
        NotRead::Busy(error) => (StatusCode::SERVICE_UNAVAILABLE, error).into_response(),
        NotRead::Failed(error) => (StatusCode::CONFLICT, error).into_response(),
    }
}

/// A stop, which needs neither the token nor the lease.
async fn stop(State(Shared { live, .. }): State<Shared>) -> Response {
    match live.stop().await {
        Ok(()) => StatusCode::NO_CONTENT.into_response(),
        Err(error) => (StatusCode::CONFLICT, error).into_response(),
    }
}

/// A new zero for all viewers.
async fn zero(State(Shared { live, token, .. }): State<Shared>, headers: HeaderMap) -> Response {
    if let Some(refusal) = without_token(&token, &headers) {
        return refusal;
    }
    match live.take_zero() {
        Ok(()) => StatusCode::NO_CONTENT.into_response(),
        Err(error) => (StatusCode::CONFLICT, error).into_response(),
    }
}

/// The experiments with their parameters. It costs the service a process for each, and so wants the token.
async fn experiments(State(Shared { live, token, .. }): State<Shared>, headers: HeaderMap) -> Response {
    if let Some(refusal) = without_token(&token, &headers) {
        return refusal;
    }
    answer(live.ask(Question::Experiments).await)
}

/// A dry run.
async fn plan(State(Shared { live, token, .. }): State<Shared>, headers: HeaderMap, body: Bytes) -> Response {
    if let Some(refusal) = without_token(&token, &headers) {
        return refusal;
    }
    match Question::plan(&body) {
        Ok(question) => answer(live.ask(question).await),
        Err(error) => (StatusCode::BAD_REQUEST, error).into_response(),
    }
}

/// A command that needs the lease: 401 without the token, 423 if another client holds the lease.
async fn command(
    State(Shared { live, token, .. }): State<Shared>,
    Path(name): Path<String>,
    headers: HeaderMap,
    body: Bytes,
) -> Response {
    let Some(order) = Order::of(&name, &body) else { return StatusCode::NOT_FOUND.into_response() };
    if let Some(refusal) = without_token(&token, &headers) {
        return refusal;
    }
    let order = match order {
        Ok(order) => order,
        Err(error) => return (StatusCode::BAD_REQUEST, error).into_response(),
    };
    commanded(&live, order, &headers).await
}

async fn commanded(live: &Live, order: Order, headers: &HeaderMap) -> Response {
    let take_over = headers.get(TAKE_OVER).and_then(|reason| reason.to_str().ok());
    match live.command(order, take_over).await {
        Ok(note) if note.is_empty() => StatusCode::NO_CONTENT.into_response(),
        Ok(note) => note.into_response(),
        Err(refusal) => refused(refusal),
    }
}

/// The refusal of a request without the token.
fn without_token(token: &Token, headers: &HeaderMap) -> Option<Response> {
    let is_right = headers.get(TOKEN).is_some_and(|given| token.is(given.as_bytes()));
    let error = "this page has no token: open the address with the token that tactus-web names at its start";
    (!is_right).then(|| (StatusCode::UNAUTHORIZED, error).into_response())
}

fn answer(answer: Result<Value, NotDone>) -> Response {
    match answer {
        Ok(value) => ([(header::CONTENT_TYPE, "application/json")], value.to_string()).into_response(),
        Err(refusal) => refused(refusal),
    }
}

fn refused(refusal: NotDone) -> Response {
    match refusal {
        NotDone::Held(error) => (StatusCode::LOCKED, error).into_response(),
        NotDone::NotNow(error) => (StatusCode::SERVICE_UNAVAILABLE, error).into_response(),
        NotDone::Failed(error) => (StatusCode::CONFLICT, error).into_response(),
    }
}
