//! The script's thread, and the channel by which it asks the run for one step at a time.

use std::sync::Arc;
use std::sync::mpsc as blocking;
use std::thread;

use tactus_plan::{Call, Host, Outcome, Refusal, Reply, RigView, ScriptError};
use tokio::sync::{mpsc, watch};

use crate::engine::Control;
use crate::run::RunOrder;

/// Message from the script's thread to the run.
#[derive(Debug)]
pub(crate) enum Request {
    /// A step; the script waits for the answer.
    Step(Call, blocking::SyncSender<Result<Reply, Refusal>>),
    /// The script is over.
    Ended(Result<Outcome, ScriptError>),
}

/// The run's end of the channel. There is at most one pending request, because the script waits for each answer.
pub(crate) enum Requests {
    /// Real time: the runtime does other work while the script thinks.
    Waiting(mpsc::Receiver<Request>),
    /// Virtual time: no time passes while the script thinks, so nothing else may happen either.
    Blocking(blocking::Receiver<Request>),
}

/// Has the order's evaluator run the script. A thread of its own performs the conversation.
pub(crate) fn start(
    order: &RunOrder,
    rig: RigView,
    control: watch::Receiver<Control>,
    is_virtual: bool,
) -> std::io::Result<Requests> {
    let (send, requests): (Box<dyn Fn(Request) -> bool + Send>, _) = if is_virtual {
        let (sender, requests) = blocking::sync_channel(1);
        (Box::new(move |request| sender.send(request).is_ok()), Requests::Blocking(requests))
    } else {
        let (sender, requests) = mpsc::channel(1);
        (Box::new(move |request| sender.blocking_send(request).is_ok()), Requests::Waiting(requests))
    };
    let (script, arguments, seed, limits) =
        (order.script.clone(), order.arguments.clone(), order.seed, order.limits.clone());
    let evaluator = Arc::clone(&order.evaluator);
    thread::Builder::new().name("script".into()).spawn(move || {
        let mut host = RunHost { send, control };
        let outcome = evaluator.execute(&script, &arguments, &rig, seed, &limits, &mut host);
        // If the run is gone, nobody needs the result.
        let _told = (host.send)(Request::Ended(outcome));
    })?;
    Ok(requests)
}

impl Requests {
    /// The next request; `None` if the script's thread died.
    pub(crate) async fn next(&mut self) -> Option<Request> {
        match self {
            Self::Waiting(requests) => requests.recv().await,
            Self::Blocking(requests) => requests.recv().ok(),
        }
    }
}

struct RunHost {
    send: Box<dyn Fn(Request) -> bool + Send>,
    control: watch::Receiver<Control>,
}

impl Host for RunHost {
    fn perform(&mut self, call: &Call) -> Result<Reply, Refusal> {
        let (answer, reply) = blocking::sync_channel(1);
        let asked = (self.send)(Request::Step(call.clone(), answer));
        let gone = || Refusal::Stopped("the run has ended".into());
        if asked { reply.recv().unwrap_or_else(|_| Err(gone())) } else { Err(gone()) }
    }

    fn cancelled(&self) -> bool {
        self.control.borrow().ending.is_some()
    }
}
