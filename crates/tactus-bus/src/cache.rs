//! The last messages of a topic, for those who come late or missed some.
//!
//! Answers as the cache of zenoh-ext's advanced publisher does, on the same keys and parameters, so that
//! any advanced subscriber is served. That cache itself is not used: it answers on zenoh's receiving
//! threads, of which there are two, so that two clients who ask for a long history and do not read it keep
//! everybody's commands waiting (measured: a stop for 15 s and more).

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

use crate::{BusError, command::let_go, queue::Queue};

/// Questions that may wait for an answer.
const WAITING_QUESTIONS: usize = 64;

/// Keeps the last messages of one publisher.
#[derive(Debug)]
pub(crate) struct Cache {
    kept: Arc<Mutex<Kept>>,
    _queryable: Queryable<()>,
}

/// What goes with every message of a publisher.
#[derive(Debug, Clone)]
pub(crate) struct Source {
    pub(crate) key: String,
    pub(crate) publisher: EntityGlobalId,
    pub(crate) encoding: Encoding,
}

/// Somebody asks for the past.
#[derive(Debug)]
pub(crate) struct Question {
    query: Query,
    kept: Arc<Mutex<Kept>>,
    source: Source,
}

/// The last messages, numbered as their publisher numbers them: 0, 1, 2, ...
#[derive(Debug)]
struct Kept {
    capacity: usize,
    next: u32,
    messages: VecDeque<(u32, ZBytes)>,
}

impl Cache {
    /// Keeps the last `capacity` messages of a publisher that has published nothing yet.
    pub(crate) async fn declare(
        session: &Session,
        source: Source,
        capacity: usize,
        questions: Arc<Queue<Question>>,
    ) -> Result<Self, BusError> {
        let key = format!("{}/@adv/pub/{}/{}/_", source.key, source.publisher.zid(), source.publisher.eid());
        let kept = Arc::new(Mutex::new(Kept { capacity, next: 0, messages: VecDeque::new() }));
        let queryable = session
            .declare_queryable(&key)
            .callback({
                let kept = kept.clone();
                let runtime = tokio::runtime::Handle::current();
                move |query| {
                    let question = Question { query, kept: kept.clone(), source: source.clone() };
                    if let Some(displaced) = questions.push(question) {
                        tracing::warn!("too many clients ask for the past; one gets nothing");
                        let_go(displaced.query, &runtime);
                    }
                }
            })
            .await
            .map_err(BusError::key(&key))?;
        Ok(Self { kept, _queryable: queryable })
    }

    /// Keeps a message that is about to be published. Before, not after: a client that comes in between
    /// would get it neither from here nor live.
    pub(crate) fn keep(&self, payload: ZBytes) {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner).push(payload);
    }
}

impl Kept {
    fn push(&mut self, payload: ZBytes) {
        if self.messages.len() == self.capacity {
            self.messages.pop_front();
        }
        self.messages.push_back((self.next, payload));
        self.next = self.next.wrapping_add(1);
    }

    /// The messages numbered within the range, at most the last `limit`.
    fn find(&self, numbers: &RangeInclusive<u32>, limit: usize) -> Vec<(u32, ZBytes)> {
        let wanted = || self.messages.iter().filter(|(number, _)| numbers.contains(number));
        let spare = wanted().count().saturating_sub(limit);
        wanted().skip(spare).cloned().collect()
    }
}

/// The way of questions from the caches to the thread that answers them, one at a time: zenoh closes a
/// link that is full only when the last of those who wait for it has given up.
pub(crate) fn questions() -> Arc<Queue<Question>> {
    // Drop-oldest; a question that finds no place is answered with nothing, and logged.
    Arc::new(Queue::new(WAITING_QUESTIONS))
}

impl Question {
    /// Sends all that is asked for; may wait for the client.
    pub(crate) fn answer(self) {
        let Self { query, kept, source } = self;
        let (numbers, limit) = wanted(query.parameters().get("_sn"), query.parameters().get("_max"));
        let found = kept.lock().unwrap_or_else(PoisonError::into_inner).find(&numbers, limit);
        for (number, payload) in found {
            let sent = query
                .reply(&source.key, payload)
                .encoding(source.encoding.clone())
                .source_info(SourceInfo::new(source.publisher, number))
                .wait();
            if let Err(error) = sent {
                tracing::debug!(key = source.key, %error, "a client that asked for the past has gone");
                return;
            }
        }
    }
}

/// What is asked for: numbers as `a..b` (both included, either absent) or one alone, and how many at most.
/// What cannot be read is taken as not said.
fn wanted(numbers: Option<&str>, limit: Option<&str>) -> (RangeInclusive<u32>, usize) {
    let limit = limit.and_then(|text| text.parse().ok()).unwrap_or(usize::MAX);
    let text = numbers.unwrap_or("..");
    let (first, last) = text.split_once("..").unwrap_or((text, text));
    (first.parse().unwrap_or(0)..=last.parse().unwrap_or(u32::MAX), limit)
}

#[cfg(test)]
#[path = "cache_tests.rs"]
mod tests;
