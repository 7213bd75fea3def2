//! Commands on the service's side.

use std::sync::Arc;

use prost::{DecodeError, Message as _};
use tactus_schema::{
    Message,
    key::{Command, Keys},
    pb,
};
use tokio::{
    runtime::Handle,
    sync::mpsc::{self, error::TrySendError},
};
use zenoh::{
    Session, Wait,
    bytes::Encoding,
    query::{Query, Queryable},
};

use crate::{BusError, queue::Queue, topic::encoding};

/// Commands that can wait for the service. Further ones are refused with an error.
const WAITING_COMMANDS: usize = 16;

/// Replies that can wait to be sent.
const WAITING_ANSWERS: usize = 256;

/// Exit code of an invalid request.
const EXIT_USAGE: u32 = 2;
/// Exit code of a failed request.
const EXIT_FAILED: u32 = 1;

/// Commands from clients.
///
/// Stops have their own channel. Read [`Calls::stops`] in its own task, so that a stop never waits for another command.
#[derive(Debug)]
pub struct Calls {
    /// Calls of `cmd/stop`.
    pub stops: mpsc::Receiver<CommandCall>,
    /// All other calls, in order of arrival.
    pub commands: mpsc::Receiver<CommandCall>,
}

/// A received command, which must be answered.
#[derive(Debug)]
pub struct CommandCall {
    /// Which command.
    pub command: Command,
    /// Its arguments.
    pub request: Request,
    /// Sends the reply. If it is dropped, the client learns that there is no answer.
    pub reply: Responder,
}

/// Arguments of a command.
#[derive(Debug, Clone, PartialEq)]
pub enum Request {
    /// Of [`Command::Run`].
    Run(pb::RunRequest),
    /// Of all other commands.
    Control(pb::CommandRequest),
}

/// Sends the reply to the client.
#[derive(Debug)]
pub struct Responder {
    query: Query,
    replies: Replies,
}

/// A reply waiting to be sent. One thread sends all replies: a stalled client can delay another client's reply, once,
/// but not the execution of its command.
#[derive(Debug)]
pub(crate) struct PendingReply {
    query: Query,
    reply: pb::CommandReply,
}

/// Sends replies through the queue.
#[derive(Debug, Clone)]
pub(crate) struct Replies {
    answers: Arc<Queue<PendingReply>>,
    runtime: Handle,
}

impl Responder {
    /// Sends the reply. Never waits.
    pub fn reply(self, reply: pb::CommandReply) {
        let Self { query, replies } = self;
        replies.send(query, reply);
    }
}

impl Replies {
    /// Sends replies through this queue.
    pub(crate) fn to(answers: Arc<Queue<PendingReply>>) -> Self {
        Self { answers, runtime: Handle::current() }
    }

    fn send(&self, query: Query, reply: pb::CommandReply) {
        if let Some(displaced) = self.answers.push(PendingReply { query, reply }) {
            tracing::warn!(
                key = %displaced.query.key_expr(),
                "a reply is not sent: too many are waiting, or the bus is closed"
            );
            drop_on_blocking_thread(displaced.query, &self.runtime);
        }
    }
}

/// The queue of replies.
pub(crate) fn answers() -> Arc<Queue<PendingReply>> {
    // Drop-oldest: a client that sends so many commands at once loses the first replies.
    Arc::new(Queue::new(WAITING_ANSWERS))
}

impl PendingReply {
    /// Sends the reply; may wait for the client.
    pub(crate) fn send(self) {
        let Self { query, reply } = self;
        let sent = query
            .reply(query.key_expr(), reply.encode_to_vec())
            .encoding(encoding(pb::CommandReply::NAME))
            .wait();
        if let Err(error) = sent {
            tracing::warn!(key = %query.key_expr(), %error, "the reply did not reach its client");
        }
    }
}

/// Drops an unanswered query on a blocking thread. Dropping a query sends a message, which may wait for the client.
pub(crate) fn drop_on_blocking_thread(query: Query, runtime: &Handle) {
    runtime.spawn_blocking(move || drop(query));
}

/// Declares the rig's commands.
pub(crate) async fn declare(
    session: &Session,
    keys: &Keys,
    replies: &Replies,
) -> Result<(Vec<Queryable<()>>, Calls), BusError> {
    // Both bounded; a call that does not fit is refused at once.
    let (stop, stops) = mpsc::channel(WAITING_COMMANDS);
    let (other, commands) = mpsc::channel(WAITING_COMMANDS);
    let mut queryables = Vec::new();
    for command in Command::ALL {
        let key = keys.command(command);
        let calls = if command == Command::Stop { stop.clone() } else { other.clone() };
        let replies = replies.clone();
        let rig = keys.rig().to_owned();
        let queryable = session
            .declare_queryable(&key)
            .callback(move |query| {
                if let Err(refusal) = take_in(command, query, &calls, &replies) {
                    let (query, reply) = *refusal;
                    replies.send(query, pb::CommandReply { rig: rig.clone(), ..reply });
                }
            })
            .await
            .map_err(BusError::key(&key))?;
        queryables.push(queryable);
    }
    Ok((queryables, Calls { stops, commands }))
}

/// Passes a query on to the service.
///
/// # Errors
/// The refusal, with its query.
fn take_in(
    command: Command,
    query: Query,
    calls: &mpsc::Sender<CommandCall>,
    replies: &Replies,
) -> Result<(), Box<(Query, pb::CommandReply)>> {
    let request = match read(command, &query) {
        Ok(request) => request,
        Err(error) => return Err(Box::new((query, refusal(EXIT_USAGE, error)))),
    };
    let call = CommandCall { command, request, reply: Responder { query, replies: replies.clone() } };
    calls.try_send(call).map_err(|refused| {
        let (call, error) = match refused {
            TrySendError::Full(call) => (call, format!("{WAITING_COMMANDS} commands are waiting; try again")),
            TrySendError::Closed(call) => (call, "the service is shutting down".to_owned()),
        };
        Box::new((call.reply.query, refusal(EXIT_FAILED, error)))
    })
}

fn refusal(exit_code: u32, error: String) -> pb::CommandReply {
    pb::CommandReply { ok: false, error, exit_code, ..Default::default() }
}

/// Decodes the arguments of a command. A stop is valid whatever its arguments are.
fn read(command: Command, query: &Query) -> Result<Request, String> {
    let payload = query.payload().map(|payload| payload.to_bytes()).unwrap_or_default();
    match command {
        Command::Run => decode::<pb::RunRequest>(query.encoding(), &payload).map(Request::Run),
        Command::Status | Command::Pause | Command::Resume | Command::Reset => {
            decode::<pb::CommandRequest>(query.encoding(), &payload).map(Request::Control)
        }
        Command::Stop => {
            let request = decode::<pb::CommandRequest>(query.encoding(), &payload).unwrap_or_else(|error| {
                tracing::warn!(%error, "a stop with an unreadable request; stopping anyway");
                pb::CommandRequest { who: "unknown".to_owned(), reason: error, abort: false }
            });
            Ok(Request::Control(request))
        }
    }
}

fn decode<M: Message>(given: Option<&Encoding>, payload: &[u8]) -> Result<M, String> {
    let expected = encoding(M::NAME);
    // Simple tools send no encoding, or zenoh's default, bytes.
    if let Some(given) = given.filter(|given| **given != Encoding::ZENOH_BYTES && **given != expected) {
        return Err(format!("this command takes {expected}, not {given}"));
    }
    M::decode(payload).map_err(|error: DecodeError| format!("this is not a {}: {error}", M::NAME))
}
