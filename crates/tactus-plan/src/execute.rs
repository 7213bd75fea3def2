//! The caller's side of an evaluation.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::context::{Message, Stop, Watch};
use crate::evaluate::{self, Evaluated, Job, Purpose};
use crate::{
    Arguments, Exceeded, Host, Location, Refusal, RigView, Script, ScriptError, ScriptLimits, json_text,
};

/// Stack of a script's thread: enough for the allowed call depth and nesting in a build without optimisation. Only the
/// used part takes memory.
pub const STACK_BYTES: usize = 64 << 20;
/// Interval at which the host is asked whether to stop while the script computes.
const POLL: Duration = Duration::from_millis(20);
/// Longest time that a script which must end may take until its next check.
const GRACE: Duration = Duration::from_secs(1);

/// Outcome of a script that ended by itself.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Values of all parameters.
    pub arguments: Arguments,
    /// What `run` returned, as JSON; null where JSON has no form for it.
    #[serde(with = "json_text")]
    pub result: Value,
    /// Steps performed, `log` included.
    pub steps: u64,
    /// Loop turns and calls used, of [`ScriptLimits::ticks`].
    pub ticks: u64,
    /// Memory used, of [`ScriptLimits::heap_bytes`].
    pub heap_bytes: usize,
}

/// Runs a script to its end. Its steps are performed by `host` on the caller's thread, one at a time; the
/// script itself computes on a thread of its own and waits for each of them. Random numbers come from `seed`
/// alone: with the same replies, two executions ask for the same steps.
///
/// # Errors
/// [`ScriptError`] tells the line: the host refused a step, the script failed, or it used up its `limits`. A
/// script that cannot be interrupted is left behind a second after it was told to end; see the crate's
/// documentation.
pub fn execute(
    script: &Script,
    arguments: &Arguments,
    rig: &RigView,
    seed: u64,
    limits: &ScriptLimits,
    host: &mut dyn Host,
) -> Result<Outcome, ScriptError> {
    let done = converse(script, arguments, rig, limits, Purpose::Run { seed }, host)?;
    let Evaluated { values, result, steps, ticks, heap_bytes, .. } = done;
    Ok(Outcome { arguments: values, result, steps, ticks, heap_bytes })
}

/// Starts the script's thread and answers it until it ends.
pub(crate) fn converse(
    script: &Script,
    arguments: &Arguments,
    rig: &RigView,
    limits: &ScriptLimits,
    purpose: Purpose,
    host: &mut dyn Host,
) -> Result<Evaluated, ScriptError> {
    // Each side waits for the other, so each channel holds at most one message.
    let (calls, messages) = sync_channel(1);
    let (answers, replies) = sync_channel(1);
    let watch = Arc::new(Watch::default());
    let job = Job {
        script: script.clone(),
        arguments: arguments.clone(),
        rig: rig.clone(),
        limits: limits.clone(),
        purpose,
        watch: Arc::clone(&watch),
        calls,
        replies,
    };
    let broken = |problem: String| ScriptError::Evaluator { script: script.name().to_owned(), problem };
    let thread = thread::Builder::new().name("script".into()).stack_size(STACK_BYTES);
    let thread = thread.spawn(move || evaluate::evaluate(job)).map_err(|error| broken(error.to_string()))?;
    loop {
        match next(&messages, &watch, limits, host) {
            Next::Message(Message::Call(call)) => {
                let reply = host.perform(&call);
                if answers.send(reply).is_err() {
                    return Err(broken("it stopped listening".into()));
                }
            }
            Next::Message(Message::Ended(ended)) => return *ended,
            Next::LeftBehind(stop) => {
                let line = watch.line().max(1);
                let at = Location { script: script.name().to_owned(), line, column: None };
                return Err(left_behind(stop, at, limits));
            }
            Next::Gone => {
                let panic = thread.join().err();
                let said = panic.as_ref().and_then(|panic| {
                    panic
                        .downcast_ref::<String>()
                        .cloned()
                        .or_else(|| Some((*panic.downcast_ref::<&str>()?).into()))
                });
                return Err(broken(said.unwrap_or_else(|| "it ended without a word".into())));
            }
        }
    }
}

enum Next {
    Message(Message),
    /// The script had to end and did not.
    LeftBehind(Stop),
    /// The script's thread died.
    Gone,
}

/// Waits for the script's next message. Demands its end when the run is cancelled or its time is over.
fn next(messages: &Receiver<Message>, watch: &Watch, limits: &ScriptLimits, host: &dyn Host) -> Next {
    let since = Instant::now();
    let mut told = None;
    loop {
        match messages.recv_timeout(POLL) {
            Ok(message) => return Next::Message(message),
            Err(RecvTimeoutError::Disconnected) => return Next::Gone,
            Err(RecvTimeoutError::Timeout) => {}
        }
        match told {
            None if host.cancelled() => told = Some((Stop::Cancelled, Instant::now())),
            None if since.elapsed() > limits.think => told = Some((Stop::Think, Instant::now())),
            Some((stop, at)) if at.elapsed() > GRACE => return Next::LeftBehind(stop),
            _ => {}
        }
        if let Some((stop, _)) = told {
            watch.stop(stop);
        }
    }
}

fn left_behind(stop: Stop, at: Location, limits: &ScriptLimits) -> ScriptError {
    let call_stack = String::new();
    match stop {
        Stop::Cancelled => {
            ScriptError::Refused { at, refusal: Refusal::Stopped("the run was stopped".into()), call_stack }
        }
        Stop::Think => ScriptError::Limit { at, exceeded: Exceeded::Think(limits.think), call_stack },
    }
}
