//! The last messages of a topic, for clients that join late or missed some.
//!
//! It replies like the cache of zenoh-ext's advanced publisher, on the same keys and parameters, so that it serves any
//! advanced subscriber. That cache itself is not used, because it replies on zenoh's two receiving threads: two clients
//! that ask for a long history and do not read it would delay everybody's commands (measured: a stop for 15 s and more).

use std::{
    collections::VecDeque,
    ops::{Range, RangeInclusive},
    sync::{Arc, Mutex, PoisonError},
};

use zenoh::{
    Session, Wait,
    bytes::Encoding,
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

/// The last messages with their publisher's numbers: 0, 1, 2, ... Their bytes stand one behind the other: a buffer for each would cost as much again in
/// the allocator, and a service keeps some 100,000.
#[derive(Debug)]
struct KeptMessages {
    capacity: usize,
    next: u32,
    bytes: VecDeque<u8>,
    lengths: VecDeque<u32>,
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
    pub(crate) fn keep(&self, payload: &[u8]) {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner).push(payload);
    }
}

impl KeptMessages {
    fn new(capacity: usize) -> Self {
        Self { capacity, next: 0, bytes: VecDeque::new(), lengths: VecDeque::new() }
    }

    fn push(&mut self, payload: &[u8]) {
        let is_full = |kept: &Self| {
            kept.lengths.len() == kept.capacity || kept.bytes.len() + payload.len() > KEPT_BYTES_MAX
        };
        while is_full(self)
            && let Some(oldest) = self.lengths.pop_front()
        {
            self.bytes.drain(..oldest as usize);
        }
        make_room(&mut self.bytes, payload.len());
        make_room(&mut self.lengths, 1);
        self.bytes.extend(payload);
        // No message has 4 GiB.
        self.lengths.push_back(u32::try_from(payload.len()).unwrap_or(u32::MAX));
        self.next = self.next.wrapping_add(1);
    }

    /// The messages' numbers, and where each stands.
    fn places(&self) -> impl Iterator<Item = (u32, Range<usize>)> {
        let mut end = 0;
        self.lengths.iter().zip(self.oldest()..).map(move |(length, number)| {
            let start = end;
            end += *length as usize;
            (wrapped(number), start..end)
        })
    }

    /// Number of the oldest message, as if numbers did not begin anew after the greatest.
    fn oldest(&self) -> u64 {
        u64::from(self.next) + (1 << 32) - self.lengths.len() as u64
    }

    /// The first of the messages numbered within the range, of at most the last `limit`, and how many they are.
    fn first(&self, numbers: &RangeInclusive<u32>, limit: usize) -> Option<(u32, usize)> {
        let wanted = || self.places().map(|(number, _)| number).filter(|number| numbers.contains(number));
        let count = wanted().count();
        Some((wanted().nth(count.saturating_sub(limit))?, count.min(limit)))
    }

    /// From the message of this number on, or the oldest that is left: the next ones within the range, at most `count`.
    fn from(&self, number: u32, numbers: &RangeInclusive<u32>, count: usize) -> Vec<(u32, Vec<u8>)> {
        let at = number.wrapping_sub(wrapped(self.oldest())) as usize;
        let skipped = if at <= self.lengths.len() { at } else { 0 };
        let next = self.places().skip(skipped).filter(|(number, _)| numbers.contains(number));
        next.take(count).map(|(number, place)| (number, self.copied(place))).collect()
    }

    fn copied(&self, place: Range<usize>) -> Vec<u8> {
        let (front, back) = self.bytes.as_slices();
        let split = front.len();
        let of = |bytes: &[u8], range: Range<usize>| bytes.get(range).unwrap_or_default().to_vec();
        if place.end <= split {
            of(front, place)
        } else if place.start >= split {
            of(back, place.start - split..place.end - split)
        } else {
            [of(front, place.start..split), of(back, 0..place.end - split)].concat()
        }
    }
}

/// Makes room for more items, and an eighth beyond: to double, as a queue does by itself, would leave half of it empty.
fn make_room<T>(queue: &mut VecDeque<T>, more: usize) {
    if queue.capacity() - queue.len() < more {
        queue.reserve_exact(more.max(queue.len() / 8));
    }
}

/// The number of a message.
fn wrapped(number: u64) -> u32 {
    #[expect(clippy::cast_possible_truncation, reason = "numbers begin anew after the greatest")]
    let low = number as u32;
    low
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
