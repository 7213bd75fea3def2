//! Who may ask: browsers that were led here by this site's own name, and commands from its own page only.
//!
//! A page of another site can have a visitor's browser send requests here, and by a name that it points to this machine
//! (DNS rebinding) even read the answers. The first is told by `Origin` and `Sec-Fetch-Site`, which no page can forge, the
//! second by `Host`.

use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;

use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderName, Method, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

const SEC_FETCH_SITE: HeaderName = HeaderName::from_static("sec-fetch-site");

/// The names under which this site may be asked for.
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
            // A name can be made to point here; an address of this machine is one of this machine.
            || address.is_ok_and(|address| {
                address.is_loopback() || address == self.listens_on || self.listens_on.is_unspecified()
            })
            || self.names.iter().any(|known| known.eq_ignore_ascii_case(name))
    }

    /// Why a request is refused, if it is.
    fn refusal(&self, method: &Method, headers: &HeaderMap) -> Option<&'static str> {
        let text =
            |name: HeaderName| headers.get(name).and_then(|value: &header::HeaderValue| value.to_str().ok());
        let Some(host) = text(header::HOST) else { return Some("the request names no host") };
        if !self.has(host) {
            return Some("this dashboard is not known by that name: start it with --host NAME");
        }
        if method == Method::GET {
            return None;
        }
        // A browser that says where a request comes from is believed; behind a proxy the two names may differ.
        let is_own = match (text(SEC_FETCH_SITE), headers.get(header::ORIGIN)) {
            (Some(site), _) => site == "same-origin",
            (None, Some(origin)) => {
                origin.to_str().ok().and_then(|origin| origin.split_once("://")).is_some_and(|(_, from)| {
                    from == host || self.names.iter().any(|known| known == name_of(from))
                })
            }
            (None, None) => true,
        };
        (!is_own).then_some("commands come from the dashboard's own page only")
    }
}

/// Answers a request, or refuses it.
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
