//! Commands on the service's side.

use std::{mem, sync::Arc};

use prost::{DecodeError, Message as _};
use tactus_schema::{
    Message,
    key::{Command, Keys, STOP_EVERY_RIG},
    pb,
};
use tokio::{
    runtime::Handle,
    sync::mpsc::{self, error::TrySendError},
};
use zenoh::{
    Session, Wait,
    bytes::{Encoding, ZBytes},
    query::{Query, Queryable},
};

use crate::{BusError, queue::Queue, stop::StopSender, topic::encoding};

/// Commands that can wait for the service. Further ones are refused with an error.
const WAITING_COMMANDS: usize = 16;

/// Replies that can wait to be sent.
const WAITING_ANSWERS: usize = 256;

/// Longest request, in bytes: a script with its parameters. A longer one is refused.
const REQUEST_BYTES_MAX: usize = 1 << 20;

/// Exit code of an invalid request.
const EXIT_USAGE: u32 = 2;
/// Exit code of a failed request.
const EXIT_FAILED: u32 = 1;

/// Commands from clients.
///
/// Stops have their own channel. Read [`Calls::stops`] in its own task, so that a stop never waits for another command.
#[derive(Debug)]
pub struct Calls {
    /// Stops: of `cmd/stop`, of [`STOP_EVERY_RIG`], and datagrams.
    pub stops: mpsc::Receiver<Box<CommandCall>>,
    /// All other calls, in order of arrival.
    pub commands: mpsc::Receiver<Box<CommandCall>>,
}

/// A received command, which must be answered.
#[derive(Debug)]
pub struct CommandCall {
    /// Name of the rig; `None` for a stop of every rig.
    pub rig: Option<Arc<str>>,
    /// Which command.
    pub command: Command,
    /// Its arguments.
    pub request: Request,
    /// Sends the reply. If it is dropped, the client learns that there is no answer.
    pub reply: Responder,
}

/// Arguments of a command. Who asks is not empty.
#[derive(Debug, Clone, PartialEq)]
pub enum Request {
    /// Of [`Command::Run`] and [`Command::Plan`].
    Run(pb::RunRequest),
    /// Of [`Command::Lease`].
    Lease(pb::LeaseRequest),
    /// Of all other commands.
    Control(pb::CommandRequest),
}

/// Sends the reply to the client.
#[derive(Debug)]
pub struct Responder {
    to: ReplyTo,
}

#[derive(Debug)]
enum ReplyTo {
    Bus { query: Query, key: Arc<str>, replies: Replies },
    Datagram(StopSender),
}

/// Replies to one query, waiting to be sent. One thread sends all replies: a stalled client can delay another client's
/// reply, once, but not the execution of its command.
#[derive(Debug)]
pub(crate) struct PendingReplies {
    query: Query,
    key: Arc<str>,
    replies: Vec<pb::CommandReply>,
}

/// Sends replies through the queue.
#[derive(Debug, Clone)]
pub(crate) struct Replies {
    answers: Arc<Queue<PendingReplies>>,
    runtime: Handle,
}

impl CommandCall {
    /// True if that is who asks.
    pub(crate) fn is_by(&self, who: &str) -> bool {
        match &self.request {
            Request::Run(request) => request.who == who,
            Request::Lease(request) => request.who == who,
            Request::Control(request) => request.who == who,
        }
    }
}

impl Responder {
    /// Replies to a datagram.
    pub(crate) fn to_datagram(sender: StopSender) -> Self {
        Self { to: ReplyTo::Datagram(sender) }
    }

    /// Sends the reply. Never waits.
    pub fn reply(self, reply: pb::CommandReply) {
        self.reply_for_all(vec![reply]);
    }

    /// Sends the replies of all rigs that the command was for. Never waits. A datagram is answered with the first, which
    /// names the others in its note.
    pub fn reply_for_all(self, mut of_rigs: Vec<pb::CommandReply>) {
        match self.to {
            ReplyTo::Bus { query, key, replies } => replies.send(query, key, of_rigs),
            ReplyTo::Datagram(sender) => {
                let others: Vec<_> = of_rigs.iter().skip(1).map(|reply| reply.rig.clone()).collect();
                if let Some(first) = of_rigs.first_mut() {
                    if !others.is_empty() {
                        first.note = format!("the others of this service too: {}", others.join(", "));
                    }
                    sender.answer(first);
                }
            }
        }
    }
}

impl Replies {
    /// Sends replies through this queue.
    pub(crate) fn to(answers: Arc<Queue<PendingReplies>>) -> Self {
        Self { answers, runtime: Handle::current() }
    }

    fn send(&self, query: Query, key: Arc<str>, replies: Vec<pb::CommandReply>) {
        if let Some(displaced) = self.answers.push(PendingReplies { query, key, replies }) {
            tracing::warn!(
                key = %displaced.key,
                "a reply is not sent: too many are waiting, or the bus is closed"
            );
            drop_on_blocking_thread(displaced.query, &self.runtime);
        }
    }
}

/// The queue of replies of a service of so many rigs.
pub(crate) fn answers(rigs: usize) -> Arc<Queue<PendingReplies>> {
    // Drop-oldest: a client that sends this many commands at once loses the first replies.
    Arc::new(Queue::new(WAITING_ANSWERS + rigs))
}

impl PendingReplies {
    /// Sends the replies; may wait for the client.
    pub(crate) fn send(self) {
        let Self { query, key, replies } = self;
        for reply in replies {
            let sent =
                query.reply(&*key, reply.encode_to_vec()).encoding(encoding(pb::CommandReply::NAME)).wait();
            if let Err(error) = sent {
                tracing::warn!(%key, %error, "the reply did not reach its client");
                return;
            }
        }
    }
}

/// Drops an unanswered query on a blocking thread. Dropping a query sends a message, which may wait for the client.
pub(crate) fn drop_on_blocking_thread(query: Query, runtime: &Handle) {
    runtime.spawn_blocking(move || drop(query));
}

/// Where a rig's calls go.
#[derive(Debug, Clone)]
pub(crate) struct Intake {
    stops: mpsc::Sender<Box<CommandCall>>,
    commands: mpsc::Sender<Box<CommandCall>>,
}

impl Intake {
    /// A rig's own channel of commands, beside the channel of all rigs' stops.
    pub(crate) fn open(stops: mpsc::Sender<Box<CommandCall>>) -> (Self, mpsc::Receiver<Box<CommandCall>>) {
        // Bounded; a call that does not fit is refused at once. Boxed: the channel takes memory for 32 calls from the start, of each rig.
        let (commands, calls) = mpsc::channel(WAITING_COMMANDS);
        (Self { stops, commands }, calls)
    }
}

/// Declares the rig's commands: as one key, because each key costs every client a message and the service memory.
pub(crate) async fn declare(
    session: &Session,
    keys: &Keys,
    intake: Intake,
    replies: &Replies,
) -> Result<Queryable<()>, BusError> {
    let key = keys.commands();
    let rig: Arc<str> = keys.rig().into();
    let (keys, replies) = (keys.clone(), replies.clone());
    let taking = move |query: Query| {
        // A question to many keys is a read: a wildcard must not command.
        let Some(command) = keys.command_at(query.key_expr()) else {
            return ignore(query, &replies);
        };
        let calls = if command == Command::Stop { &intake.stops } else { &intake.commands };
        let key = query.key_expr().as_str().into();
        take_in(Some(&rig), command, query, &key, calls, &replies);
    };
    session.declare_queryable(&key).callback(taking).await.map_err(BusError::key(&key))
}

/// Declares the stop of every rig.
pub(crate) async fn declare_stop(
    session: &Session,
    stops: &mpsc::Sender<Box<CommandCall>>,
    replies: &Replies,
) -> Result<Queryable<()>, BusError> {
    let key: Arc<str> = STOP_EVERY_RIG.into();
    let (stops, replies) = (stops.clone(), replies.clone());
    let taking = move |query: Query| {
        if query.key_expr().as_str() == &*key {
            take_in(None, Command::Stop, query, &key, &stops, &replies);
        } else {
            ignore(query, &replies);
        }
    };
    session.declare_queryable(STOP_EVERY_RIG).callback(taking).await.map_err(BusError::key(STOP_EVERY_RIG))
}

fn ignore(query: Query, replies: &Replies) {
    tracing::debug!(asked = %query.key_expr(), "a wildcard commands nothing");
    drop_on_blocking_thread(query, &replies.runtime);
}

/// Passes a query on to the service, or refuses it.
fn take_in(
    rig: Option<&Arc<str>>,
    command: Command,
    query: Query,
    key: &Arc<str>,
    calls: &mpsc::Sender<Box<CommandCall>>,
    replies: &Replies,
) {
    if let Err(refusal) = pass_on(rig, command, query, key, calls, replies) {
        let (query, reply) = *refusal;
        let rig = rig.map(ToString::to_string).unwrap_or_default();
        replies.send(query, key.clone(), vec![pb::CommandReply { rig, ..reply }]);
    }
}

/// Passes a query on to the service.
///
/// # Errors
/// The refusal, with its query.
fn pass_on(
    rig: Option<&Arc<str>>,
    command: Command,
    mut query: Query,
    key: &Arc<str>,
    calls: &mpsc::Sender<Box<CommandCall>>,
    replies: &Replies,
) -> Result<(), Box<(Query, pb::CommandReply)>> {
    // Taken out: a waiting reply then holds no request.
    let payload = query.payload_mut().map(mem::take);
    let request = match read(command, query.encoding(), payload.as_ref()) {
        Ok(request) => request,
        Err(error) => return Err(Box::new((query, refusal(EXIT_USAGE, error)))),
    };
    let to = ReplyTo::Bus { query, key: key.clone(), replies: replies.clone() };
    let call = Box::new(CommandCall { rig: rig.cloned(), command, request, reply: Responder { to } });
    calls.try_send(call).or_else(|refused| {
        let (call, error) = match refused {
            TrySendError::Full(call) => {
                (call, format!("{} commands are waiting; try again", calls.max_capacity()))
            }
            TrySendError::Closed(call) => (call, "the service is shutting down".to_owned()),
        };
        match call.reply.to {
            ReplyTo::Bus { query, .. } => Err(Box::new((query, refusal(EXIT_FAILED, error)))),
            ReplyTo::Datagram(_) => Ok(()),
        }
    })
}

fn refusal(exit_code: u32, error: String) -> pb::CommandReply {
    pb::CommandReply { ok: false, error, exit_code, ..Default::default() }
}

/// Decodes the arguments of a command. A stop is valid whatever its arguments are.
fn read(command: Command, given: Option<&Encoding>, payload: Option<&ZBytes>) -> Result<Request, String> {
    match command {
        Command::Run | Command::Plan => {
            let request: pb::RunRequest = decode(given, payload)?;
            named(&request.who)?;
            Ok(Request::Run(request))
        }
        Command::Lease => {
            let request: pb::LeaseRequest = decode(given, payload)?;
            named(&request.who)?;
            Ok(Request::Lease(request))
        }
        Command::Status | Command::Experiments | Command::Pause | Command::Resume | Command::Reset => {
            let request: pb::CommandRequest = decode(given, payload)?;
            named(&request.who)?;
            Ok(Request::Control(request))
        }
        Command::Stop => Ok(Request::Control(match decode::<pb::CommandRequest>(given, payload) {
            Ok(request) if request.who.is_empty() => {
                pb::CommandRequest { who: "unknown".to_owned(), ..request }
            }
            Ok(request) => request,
            Err(error) => unreadable_stop(error),
        })),
    }
}

/// The stop of a client that nobody understands.
pub(crate) fn unreadable_stop(error: String) -> pb::CommandRequest {
    tracing::warn!(%error, "a stop with an unreadable request; stopping anyway");
    pb::CommandRequest { who: "unknown".to_owned(), reason: error, ..Default::default() }
}

fn named(who: &str) -> Result<(), String> {
    if who.is_empty() { Err("the request does not say who asks".to_owned()) } else { Ok(()) }
}

fn decode<M: Message>(given: Option<&Encoding>, payload: Option<&ZBytes>) -> Result<M, String> {
    let expected = encoding(M::NAME);
    let Some(payload) = payload else { return Err(format!("a command carries a {}", M::NAME)) };
    if payload.len() > REQUEST_BYTES_MAX {
        return Err(format!(
            "the request has {} bytes; at most {REQUEST_BYTES_MAX} are taken",
            payload.len()
        ));
    }
    // Simple tools send no encoding, or zenoh's default, bytes.
    if let Some(given) = given.filter(|given| **given != Encoding::ZENOH_BYTES && **given != expected) {
        return Err(format!("this command takes {expected}, not {given}"));
    }
    M::decode(&*payload.to_bytes())
        .map_err(|error: DecodeError| format!("this is not a {}: {error}", M::NAME))
}
