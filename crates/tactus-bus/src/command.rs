//! Commands as the service receives them.

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

/// Commands that wait for the service; one more is refused with an answer that says so.
const WAITING_COMMANDS: usize = 16;

/// Answers that may wait to be sent.
const WAITING_ANSWERS: usize = 256;

/// The exit code of a request that makes no sense.
const EXIT_USAGE: u32 = 2;
/// The exit code of a request that failed.
const EXIT_FAILED: u32 = 1;

/// What clients ask of the service.
///
/// A stop comes by a way of its own: give [`Calls::stops`] a task of its own, and it waits for nothing.
#[derive(Debug)]
pub struct Calls {
    /// Calls of `cmd/stop` only.
    pub stops: mpsc::Receiver<CommandCall>,
    /// All others, in the order of their arrival.
    pub commands: mpsc::Receiver<CommandCall>,
}

/// One command, to be answered.
#[derive(Debug)]
pub struct CommandCall {
    /// What is asked.
    pub command: Command,
    /// With what.
    pub request: Request,
    /// Where the answer goes. A client whose call is dropped learns that there is no answer.
    pub reply: Responder,
}

/// What comes with a command.
#[derive(Debug, Clone, PartialEq)]
pub enum Request {
    /// With [`Command::Run`].
    Run(pb::RunRequest),
    /// With all others.
    Control(pb::CommandRequest),
}

/// The way back to the client that asked.
#[derive(Debug)]
pub struct Responder {
    query: Query,
    replies: Replies,
}

/// An answer on its way. One thread sends them all: a client that stands still can delay another's answer,
/// but not what was asked for, and it is waited for once only.
#[derive(Debug)]
pub(crate) struct Answer {
    query: Query,
    reply: pb::CommandReply,
}

/// Where answers go.
#[derive(Debug, Clone)]
pub(crate) struct Replies {
    answers: Arc<Queue<Answer>>,
    runtime: Handle,
}

impl Responder {
    /// Answers. Never waits.
    pub fn reply(self, reply: pb::CommandReply) {
        let Self { query, replies } = self;
        replies.send(query, reply);
    }
}

impl Replies {
    /// Answers go to this queue.
    pub(crate) fn to(answers: Arc<Queue<Answer>>) -> Self {
        Self { answers, runtime: Handle::current() }
    }

    fn send(&self, query: Query, reply: pb::CommandReply) {
        if let Some(displaced) = self.answers.push(Answer { query, reply }) {
            tracing::warn!(
                key = %displaced.query.key_expr(),
                "an answer is not sent: too many are waiting, or the bus is closed"
            );
            let_go(displaced.query, &self.runtime);
        }
    }
}

/// The queue of answers.
pub(crate) fn answers() -> Arc<Queue<Answer>> {
    // Drop-oldest: whoever asks so much at once does without answers to the first.
    Arc::new(Queue::new(WAITING_ANSWERS))
}

impl Answer {
    /// Sends it; may wait for the client.
    pub(crate) fn send(self) {
        let Self { query, reply } = self;
        let sent = query
            .reply(query.key_expr(), reply.encode_to_vec())
            .encoding(encoding(pb::CommandReply::NAME))
            .wait();
        if let Err(error) = sent {
            tracing::warn!(key = %query.key_expr(), %error, "the answer did not reach its client");
        }
    }
}

/// Ends a query unanswered. To let go of it is to send, which may wait for the client, so that is left to a
/// thread that may wait.
pub(crate) fn let_go(query: Query, runtime: &Handle) {
    runtime.spawn_blocking(move || drop(query));
}

/// Declares the rig's commands.
pub(crate) async fn declare(
    session: &Session,
    keys: &Keys,
    replies: &Replies,
) -> Result<(Vec<Queryable<()>>, Calls), BusError> {
    // Both bounded; a call that finds no place is answered at once and not executed.
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

/// Passes a query on to the service, or says why not.
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
            TrySendError::Closed(call) => (call, "the service is closing down".to_owned()),
        };
        Box::new((call.reply.query, refusal(EXIT_FAILED, error)))
    })
}

fn refusal(exit_code: u32, error: String) -> pb::CommandReply {
    pb::CommandReply { ok: false, error, exit_code, ..Default::default() }
}

/// Reads what came with a command. A stop is a stop, whatever came with it.
fn read(command: Command, query: &Query) -> Result<Request, String> {
    let payload = query.payload().map(|payload| payload.to_bytes()).unwrap_or_default();
    match command {
        Command::Run => decode::<pb::RunRequest>(query.encoding(), &payload).map(Request::Run),
        Command::Status | Command::Pause | Command::Resume | Command::Reset => {
            decode::<pb::CommandRequest>(query.encoding(), &payload).map(Request::Control)
        }
        Command::Stop => {
            let request = decode::<pb::CommandRequest>(query.encoding(), &payload).unwrap_or_else(|error| {
                tracing::warn!(%error, "a stop with an unreadable request; stopping all the same");
                pb::CommandRequest { who: "unknown".to_owned(), reason: error, abort: false }
            });
            Ok(Request::Control(request))
        }
    }
}

fn decode<M: Message>(given: Option<&Encoding>, payload: &[u8]) -> Result<M, String> {
    let expected = encoding(M::NAME);
    // No encoding, or zenoh's word for "bytes", is what simple tools send.
    if let Some(given) = given.filter(|given| **given != Encoding::ZENOH_BYTES && **given != expected) {
        return Err(format!("this command takes {expected}, not {given}"));
    }
    M::decode(payload).map_err(|error: DecodeError| format!("this is no {}: {error}", M::NAME))
}
