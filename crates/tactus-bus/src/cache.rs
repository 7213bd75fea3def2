//! The last messages of a topic, for clients that join late or missed some.
//!
//! It replies like the cache of zenoh-ext's advanced publisher, on the same keys and parameters, so that it serves any
//! advanced subscriber. That cache itself is not used, because it replies on zenoh's two receiving threads: two clients
//! that ask for a long history and do not read it would delay everybody's commands (measured: a stop for 15 s and more).

use std::{
    collections::VecDeque,
    ops::RangeInclusive,
    sync::{Arc, Mutex, PoisonError},
};

use zenoh::{
    Session, Wait,
    bytes::{Encoding, ZBytes},
    query::{Query, Queryable},
    sample::SourceInfo,
    session::EntityGlobalId,
};

use crate::{BusError, command::drop_on_blocking_thread, queue::Queue};

/// Queries that can wait for a reply.
const WAITING_HISTORY_QUERIES: usize = 64;

/// Messages that are copied for a client at a time: who publishes waits no longer than that takes.
const COPIED_AT_ONCE: usize = 64;

/// Messages that are kept of one topic, in bytes; the last one is kept in any case.
const KEPT_BYTES_MAX: usize = 4 << 20;

/// Keeps the last messages of one publisher.
#[derive(Debug)]
pub(crate) struct Cache {
    kept: Arc<Mutex<KeptMessages>>,
    _queryable: Queryable<()>,
}

/// Key, publisher and encoding of cached messages.
#[derive(Debug, Clone)]
pub(crate) struct Source {
    pub(crate) key: String,
    pub(crate) publisher: EntityGlobalId,
    pub(crate) encoding: Encoding,
}

/// A client's query for past messages.
#[derive(Debug)]
pub(crate) struct HistoryQuery {
    query: Query,
    kept: Arc<Mutex<KeptMessages>>,
    source: Source,
}

/// The last messages with their publisher's numbers: 0, 1, 2, ...
#[derive(Debug)]
struct KeptMessages {
    capacity: usize,
    next: u32,
    bytes: usize,
    messages: VecDeque<(u32, ZBytes)>,
}

impl Cache {
    /// Keeps the last `capacity` messages of a publisher that has published nothing yet.
    pub(crate) async fn declare(
        session: &Session,
        source: Source,
        capacity: usize,
        history_queries: Arc<Queue<HistoryQuery>>,
    ) -> Result<Self, BusError> {
        let key = format!("{}/@adv/pub/{}/{}/_", source.key, source.publisher.zid(), source.publisher.eid());
        let kept = Arc::new(Mutex::new(KeptMessages::new(capacity)));
        let queryable = session
            .declare_queryable(&key)
            .callback({
                let kept = kept.clone();
                let runtime = tokio::runtime::Handle::current();
                move |query| {
                    let question = HistoryQuery { query, kept: kept.clone(), source: source.clone() };
                    if let Some(displaced) = history_queries.push(question) {
                        tracing::warn!("too many clients ask for history; one gets nothing");
                        drop_on_blocking_thread(displaced.query, &runtime);
                    }
                }
            })
            .await
            .map_err(BusError::key(&key))?;
        Ok(Self { kept, _queryable: queryable })
    }

    /// Keeps a message that is about to be published. It must be kept before it is published: otherwise a client that joins
    /// in between would get it neither from here nor live.
    pub(crate) fn keep(&self, payload: ZBytes) {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner).push(payload);
    }
}

impl KeptMessages {
    fn new(capacity: usize) -> Self {
        Self { capacity, next: 0, bytes: 0, messages: VecDeque::new() }
    }

    fn push(&mut self, payload: ZBytes) {
        self.bytes = self.bytes.saturating_add(payload.len());
        while (self.messages.len() == self.capacity || self.bytes > KEPT_BYTES_MAX)
            && let Some((_, oldest)) = self.messages.pop_front()
        {
            self.bytes = self.bytes.saturating_sub(oldest.len());
        }
        self.messages.push_back((self.next, payload));
        self.next = self.next.wrapping_add(1);
    }

    /// The first of the messages numbered within the range, of at most the last `limit`, and how many they are.
    fn first(&self, numbers: &RangeInclusive<u32>, limit: usize) -> Option<(u32, usize)> {
        let wanted = || self.messages.iter().map(|(number, _)| *number).filter(|of| numbers.contains(of));
        let count = wanted().count();
        Some((wanted().nth(count.saturating_sub(limit))?, count.min(limit)))
    }

    /// From the message of this number on, or the oldest that is left: the next ones within the range, at most `count`.
    fn from(&self, number: u32, numbers: &RangeInclusive<u32>, count: usize) -> Vec<(u32, ZBytes)> {
        let oldest = self.messages.front().map_or(number, |(oldest, _)| *oldest);
        let at = usize::try_from(number.wrapping_sub(oldest)).unwrap_or(usize::MAX);
        let skipped = if at <= self.messages.len() { at } else { 0 };
        let next = self.messages.iter().skip(skipped).filter(|(number, _)| numbers.contains(number));
        next.take(count).cloned().collect()
    }
}

/// The queue of queries from the caches to the thread that replies, one at a time: zenoh closes a full link only when the
/// last waiting sender gives up.
pub(crate) fn history_queries() -> Arc<Queue<HistoryQuery>> {
    // Drop-oldest; a dropped query gets an empty reply and a log line.
    Arc::new(Queue::new(WAITING_HISTORY_QUERIES))
}

impl HistoryQuery {
    /// Sends the requested messages; may wait for the client.
    pub(crate) fn answer(self) {
        let Self { query, kept, source } = self;
        let (numbers, limit) = wanted(query.parameters().get("_sn"), query.parameters().get("_max"));
        let lock = || kept.lock().unwrap_or_else(PoisonError::into_inner);
        let Some((mut next, mut left)) = lock().first(&numbers, limit) else { return };
        while left > 0 {
            let found = lock().from(next, &numbers, left.min(COPIED_AT_ONCE));
            let Some((last, _)) = found.last() else { return };
            (next, left) = (last.wrapping_add(1), left - found.len());
            for (number, payload) in found {
                let sent = query
                    .reply(&source.key, payload)
                    .encoding(source.encoding.clone())
                    .source_info(SourceInfo::new(source.publisher, number))
                    .wait();
                if let Err(error) = sent {
                    tracing::debug!(key = source.key, %error, "a client that asked for history disconnected");
                    return;
                }
            }
        }
    }
}

/// Parses the requested numbers, `a..b` (inclusive, either end optional) or a single one, and the limit. Unreadable values
/// are ignored.
fn wanted(numbers: Option<&str>, limit: Option<&str>) -> (RangeInclusive<u32>, usize) {
    let limit = limit.and_then(|text| text.parse().ok()).unwrap_or(usize::MAX);
    let text = numbers.unwrap_or("..");
    let (first, last) = text.split_once("..").unwrap_or((text, text));
    (first.parse().unwrap_or(0)..=last.parse().unwrap_or(u32::MAX), limit)
}

#[cfg(test)]
#[path = "cache_tests.rs"]
mod tests;
