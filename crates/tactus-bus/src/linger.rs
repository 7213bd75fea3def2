//! The wait, before a session closes, for what its clients have not taken yet.
//!
//! A closing session (zenoh 1.10.2) breaks off the packet that it is writing, and with it goes all that follows. It writes where a
//! client's socket is full, so that the session may close once the sockets are empty. Linux shows how many bytes wait in a TCP
//! socket; of other sockets and systems nothing is known, and after 50 ms the wait is over.

use std::{
    fs,
    net::{IpAddr, SocketAddr},
    time::Duration,
};

use tokio::time::{sleep, timeout};
use zenoh::Session;

/// Tables of this process's network, of both kinds of addresses. A service that sees its own processes alone (`ProcSubset=pid`) has no `/proc/net`.
const TABLES: [&str; 2] = ["/proc/self/net/tcp", "/proc/self/net/tcp6"];
/// Time between two looks.
const LOOK_EVERY: Duration = Duration::from_millis(5);
/// Looks in a row that must find the sockets empty. Between two packets they are empty until zenoh's thread has its turn; on a busy
/// machine that takes several turns of this one.
const EMPTY_LOOKS: u32 = 10;
/// A client that has not taken everything by then is waited for no longer.
const WAIT_MAX: Duration = Duration::from_secs(5);

/// Both ends of a connection, this side's first.
type Ends = (SocketAddr, SocketAddr);

/// Returns once the clients have taken what was sent, or after [`WAIT_MAX`].
pub(crate) async fn until_taken(session: &Session) {
    let ends: Vec<Ends> = session.info().links().await.filter_map(|link| ends(&link)).collect();
    if !ends.is_empty() && timeout(WAIT_MAX, until_empty(&ends)).await.is_err() {
        tracing::warn!("the bus closes before all clients have taken the last messages");
    }
}

async fn until_empty(sockets: &[Ends]) {
    let mut empty_looks = 0;
    while empty_looks < EMPTY_LOOKS {
        empty_looks = if have_waiting_bytes(sockets) { 0 } else { empty_looks + 1 };
        if empty_looks < EMPTY_LOOKS {
            sleep(LOOK_EVERY).await;
        }
    }
}

fn ends(link: &zenoh::session::Link) -> Option<Ends> {
    let end = |locator: &zenoh::config::Locator| Some(canonical(locator.address().as_str().parse().ok()?));
    Some((end(link.src())?, end(link.dst())?))
}

fn have_waiting_bytes(sockets: &[Ends]) -> bool {
    let tables = TABLES.iter().filter_map(|table| fs::read_to_string(table).ok());
    tables
        .flat_map(|table| table.lines().filter_map(socket).collect::<Vec<_>>())
        .any(|(ends, waiting_bytes)| waiting_bytes > 0 && sockets.contains(&ends))
}

/// A line of the table: `sl local_address rem_address st tx_queue:rx_queue ...` (proc(5), /proc/net/tcp).
fn socket(line: &str) -> Option<(Ends, u32)> {
    let mut columns = line.split_whitespace().skip(1);
    let ends = (address(columns.next()?)?, address(columns.next()?)?);
    let (waiting, _) = columns.nth(1)?.split_once(':')?;
    Some((ends, u32::from_str_radix(waiting, 16).ok()?))
}

/// An address as the table has it: words of 32 bits as the processor reads them, and the port.
fn address(text: &str) -> Option<SocketAddr> {
    let (address, port) = text.split_once(':')?;
    let words = address.as_bytes().chunks(8).map(|word| {
        let word = u32::from_str_radix(str::from_utf8(word).ok()?, 16).ok()?;
        Some(word.to_ne_bytes())
    });
    let bytes = words.collect::<Option<Vec<_>>>()?.concat();
    let address = match address.len() {
        8 => IpAddr::from(<[u8; 4]>::try_from(bytes).ok()?),
        32 => IpAddr::from(<[u8; 16]>::try_from(bytes).ok()?),
        _ => return None,
    };
    Some(canonical(SocketAddr::new(address, u16::from_str_radix(port, 16).ok()?)))
}

/// The same address has two forms where a socket takes both kinds.
fn canonical(address: SocketAddr) -> SocketAddr {
    SocketAddr::new(address.ip().to_canonical(), address.port())
}

#[cfg(test)]
#[path = "linger_tests.rs"]
mod tests;
