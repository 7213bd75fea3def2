//! Checks requests: they must use one of this site's names, and commands must come from its own page.
//!
//! A page of another site can make a visitor's browser send requests here and, with a name that resolves to this machine
//! (DNS rebinding), even read the answers. `Origin` and `Sec-Fetch-Site`, which no page can forge, reveal the first;
//! `Host` reveals the second.

use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;

use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderName, Method, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

const SEC_FETCH_SITE: HeaderName = HeaderName::from_static("sec-fetch-site");

/// The names of this site.
#[derive(Debug)]
pub(crate) struct Hosts {
    listens_on: IpAddr,
    names: Vec<String>,
}

impl Hosts {
    pub(crate) fn new(address: SocketAddr, names: Vec<String>) -> Arc<Self> {
        Arc::new(Self { listens_on: address.ip(), names })
    }

    /// `authority` is a name or an address, with or without a port.
    fn has(&self, authority: &str) -> bool {
        let name = name_of(authority);
        let address = name.trim_start_matches('[').trim_end_matches(']').parse::<IpAddr>();
        name == "localhost"
            // A foreign name can resolve to this machine; a literal address is safe.
            || address.is_ok_and(|address| {
                address.is_loopback() || address == self.listens_on || self.listens_on.is_unspecified()
            })
            || self.names.iter().any(|known| known.eq_ignore_ascii_case(name))
    }

    /// The page that sent a request, if it is neither of this site, of whatever port, nor of `friends`.
    #[cfg(feature = "foxglove")]
    pub(crate) fn foreign_page<'a>(&self, headers: &'a HeaderMap, friends: &[String]) -> Option<&'a str> {
        let origin = headers.get(header::ORIGIN)?.to_str().unwrap_or("one that is no text");
        let is_own = origin.split_once("://").is_some_and(|(_, from)| self.has(from));
        (!is_own && !friends.iter().any(|friend| friend == origin)).then_some(origin)
    }

    /// The reason for refusing a request, if any.
    fn refusal(&self, method: &Method, headers: &HeaderMap) -> Option<&'static str> {
        let text =
            |name: HeaderName| headers.get(name).and_then(|value: &header::HeaderValue| value.to_str().ok());
        let Some(host) = text(header::HOST) else { return Some("the request has no Host header") };
        if !self.has(host) {
            return Some("this dashboard is not known by that name: start it with --host NAME");
        }
        if method == Method::GET {
            return None;
        }
        // Browsers report the origin of a request truthfully; behind a proxy the two names may differ.
        let is_own = match (text(SEC_FETCH_SITE), headers.get(header::ORIGIN)) {
            (Some(site), _) => site == "same-origin",
            (None, Some(origin)) => {
                origin.to_str().ok().and_then(|origin| origin.split_once("://")).is_some_and(|(_, from)| {
                    from == host || self.names.iter().any(|known| known == name_of(from))
                })
            }
            (None, None) => true,
        };
        (!is_own).then_some("only the dashboard's own page may send commands")
    }
}

/// Middleware that refuses foreign requests.
pub(crate) async fn guard(State(hosts): State<Arc<Hosts>>, request: Request, next: Next) -> Response {
    match hosts.refusal(request.method(), request.headers()) {
        Some(refusal) => (StatusCode::FORBIDDEN, refusal).into_response(),
        None => next.run(request).await,
    }
}

fn name_of(authority: &str) -> &str {
    match authority.rsplit_once(':') {
        Some((name, port)) if !port.is_empty() && port.bytes().all(|byte| byte.is_ascii_digit()) => name,
        _ => authority,
    }
}

#[cfg(test)]
#[path = "guard_tests.rs"]
mod tests;
