//! The way of a rig's messages to the bus: each rig has a queue for each lane, and a lane has one thread that takes from all queues.
//!
//! A queue with messages calls the thread, once until the thread has come to it. Rigs therefore share no lock: whoever
//! publishes touches only the rig's own queue and a channel that nobody waits for.
//!
//! Where many rigs call, the thread lets calls gather for a millisecond: it is woken once for all of them, and zenoh sends their
//! messages in one packet.
//!
//! In a service of one rig or two who has a frame may send it itself, which spares the wake of a thread on the frame's way. Such a service
//! lets zenoh drop a message for a full link at once. What may still wait are answers to a client that does not read, so that only
//! frames at rest go this way.

use std::{
    io,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    thread::{self, JoinHandle},
    time::Duration,
};

use tokio::sync::{Notify, mpsc};

use crate::{
    publisher::{Outgoing, TopicPublishers},
    queue::Queue,
    topic::Lane,
};

/// Bytes that wait in each outgoing queue at most.
const WAITING_BYTES_MAX: usize = 16 << 20;
/// Messages of one rig that are sent before it is the next one's turn.
const AT_ONCE: usize = 64;
/// Rigs that call at a time from which on calls gather.
pub(crate) const MANY: usize = 3;
/// Time in which calls gather.
const GATHERING: Duration = Duration::from_millis(1);

/// Who sends a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Way {
    /// The thread, which is called.
    Called,
    /// Who has it, if nobody else is sending.
    Direct,
}

/// A rig's outgoing queues.
#[derive(Debug)]
pub(crate) struct Outlets {
    pub(crate) frames: Arc<Outlet>,
    pub(crate) updates: Arc<Outlet>,
}

/// An outgoing queue of one rig, with the publishers of its messages.
#[derive(Debug)]
pub(crate) struct Outlet {
    queue: Queue<Outgoing>,
    /// Of who sends; `None` once all is sent, so that nothing of zenoh outlives the session.
    publishers: Mutex<Option<TopicPublishers>>,
    /// Nobody but the thread sends, because it gathers the messages of many rigs.
    gathers: bool,
    /// The thread has been called and has not come yet.
    is_called: AtomicBool,
    caller: Caller,
    /// The queue is closed, and its last message was sent.
    finished: Notify,
}

/// Calls the thread of a lane.
#[derive(Debug, Clone)]
pub(crate) struct Caller(mpsc::UnboundedSender<Call>);

#[derive(Debug)]
enum Call {
    /// This outlet has something to send.
    Outlet(Arc<Outlet>),
    /// Nothing follows.
    End,
}

/// The thread of a lane: it passes messages to zenoh, and may wait there for slow clients.
#[derive(Debug)]
pub(crate) struct Carrier {
    caller: Caller,
    thread: JoinHandle<()>,
}

impl Outlets {
    pub(crate) fn of(&self, lane: Lane) -> &Arc<Outlet> {
        match lane {
            Lane::Frames => &self.frames,
            Lane::Updates => &self.updates,
        }
    }
}

impl Outlet {
    pub(crate) fn new(lane: Lane, publishers: TopicPublishers, caller: Caller, gathers: bool) -> Arc<Self> {
        // Drop-oldest, counted.
        let capacity = match lane {
            // 10 s.
            Lane::Frames => 300,
            // Far more than a run sends while stalled clients cost a millisecond per message each, where zenoh waits for room.
            Lane::Updates => 8_192,
        };
        let queue = Queue::bounded(capacity, WAITING_BYTES_MAX, |message: &Outgoing| message.payload.len());
        let publishers = Mutex::new(Some(publishers));
        let (is_called, finished) = (AtomicBool::new(false), Notify::new());
        Arc::new(Self { queue, publishers, gathers, is_called, caller, finished })
    }

    /// Appends a message; returns the one that gave way to it, if the queue is full.
    pub(crate) fn push(self: &Arc<Self>, message: Outgoing, way: Way) -> Option<Outgoing> {
        let displaced = self.queue.push(message);
        if way == Way::Direct
            && !self.gathers
            && let Ok(publishers) = self.publishers.try_lock()
        {
            self.send_turn(publishers.as_ref());
        } else {
            // Whoever sends now may have seen the queue without this message.
            self.call();
        }
        displaced
    }

    /// Messages that gave way to newer ones.
    pub(crate) fn dropped(&self) -> u64 {
        self.queue.dropped()
    }

    /// Refuses further messages, and returns once those inside are sent.
    pub(crate) async fn finish(self: &Arc<Self>) {
        self.queue.close();
        self.call();
        self.finished.notified().await;
    }

    fn call(self: &Arc<Self>) {
        if !self.is_called.swap(true, Ordering::AcqRel) {
            self.caller.call(Call::Outlet(Arc::clone(self)));
        }
    }

    /// The thread's turn.
    fn send(self: &Arc<Self>) {
        // Before the queue is looked at: a message that comes later calls again.
        self.is_called.store(false, Ordering::Release);
        let mut publishers = self.publishers.lock().unwrap_or_else(PoisonError::into_inner);
        self.send_turn(publishers.as_ref());
        if self.queue.is_finished() {
            *publishers = None;
            self.finished.notify_one();
        }
    }

    /// Sends what waits, but no more than is one rig's turn.
    fn send_turn(self: &Arc<Self>, publishers: Option<&TopicPublishers>) {
        for _ in 0..AT_ONCE {
            let Some(message) = self.queue.try_pop() else { return };
            if let Some(publishers) = publishers {
                publishers.publish(message);
            }
        }
        self.call();
    }
}

impl Caller {
    fn call(&self, call: Call) {
        if self.0.send(call).is_err() {
            tracing::debug!("a message after the end of the bus");
        }
    }
}

impl Carrier {
    pub(crate) fn start(lane: Lane) -> io::Result<Self> {
        // Bounded by the number of rigs: each outlet is in it at most once.
        let (caller, mut calls) = mpsc::unbounded_channel();
        let name = match lane {
            Lane::Frames => "bus-frames",
            Lane::Updates => "bus-updates",
        };
        let thread = thread::Builder::new().name(name.to_owned()).spawn(move || {
            while let Some(Call::Outlet(outlet)) = calls.blocking_recv() {
                outlet.send();
                let mut called = 1;
                loop {
                    match calls.try_recv() {
                        Ok(Call::Outlet(outlet)) => outlet.send(),
                        Ok(Call::End) => return,
                        Err(_) => break,
                    }
                    called += 1;
                }
                if called >= MANY {
                    thread::sleep(GATHERING);
                }
            }
        })?;
        Ok(Self { caller: Caller(caller), thread })
    }

    pub(crate) fn caller(&self) -> Caller {
        self.caller.clone()
    }

    /// Returns once everything before is sent.
    pub(crate) async fn finish(self) {
        self.caller.call(Call::End);
        let joined = tokio::task::spawn_blocking(|| self.thread.join()).await;
        if !matches!(joined, Ok(Ok(()))) {
            tracing::error!("a thread of the bus panicked");
        }
    }
}
