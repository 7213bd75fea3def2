//! The script's process.

use std::env;
use std::fs;
use std::io;
use std::os::fd::AsFd;
use std::process::{self, ExitCode};

use rustix::process::{Resource, Rlimit, Signal, set_parent_process_death_signal, setrlimit};
use serde::Serialize;
use tactus_plan::{
    Call, Evaluate, Host, InThisProcess, Outcome, Refusal, Reply, Script, ScriptError, ScriptLimits,
};

use super::frame::{self, FrameReader, FrameWriter};
use super::{ANSWER_MAX_BYTES, Answer, Purpose, Task};

/// The argument that makes a program the script's process. Programs look at it before anything else.
pub(super) const ARGUMENT: &str = "--evaluate-a-script-for-the-parent-process";

/// Longest message of the parent: the readings of one press with very many depths.
const MESSAGE_MAX_BYTES: usize = 256 << 20;

/// Evaluates a script for the parent process, if this process was started for that; otherwise `None`. The first thing in
/// the main function of every program that uses [`ScriptProcesses::of_this_program`](super::ScriptProcesses).
pub fn main_if_child() -> Option<ExitCode> {
    (env::args_os().nth(1)? == ARGUMENT).then(|| match main() {
        Ok(()) => ExitCode::SUCCESS,
        // Nobody is there to be told: the parent process has ended, or has left this one.
        Err(_) => ExitCode::FAILURE,
    })
}

fn main() -> io::Result<()> {
    set_parent_process_death_signal(Some(Signal::KILL))?;
    // If the machine's memory runs out, this process goes first. Some systems do not allow it to say so.
    let _refused = fs::write("/proc/self/oom_score_adj", "1000");
    let mut pipes = Pipes {
        from: FrameReader::new(io::stdin().as_fd().try_clone_to_owned()?, MESSAGE_MAX_BYTES),
        to: FrameWriter::new(io::stdout().as_fd().try_clone_to_owned()?),
    };
    let task: Task = postcard::from_bytes(&pipes.from.read()?).map_err(io::Error::other)?;
    limit(&task.limits)?;
    let answer = evaluate(task, &mut pipes);
    pipes.answer(answer)
}

/// Has the system bound this process.
fn limit(limits: &ScriptLimits) -> io::Result<()> {
    let set = |resource, soft: u64, hard: u64| {
        setrlimit(resource, Rlimit { current: Some(soft), maximum: Some(hard) })
    };
    // Private memory that can be written: values, their allocator's, stacks.
    let bytes = u64::try_from(limits.process_bytes).unwrap_or(u64::MAX);
    set(Resource::Data, bytes, bytes)?;
    // At the first limit comes SIGXCPU, by which the parent knows it; at the second SIGKILL.
    let seconds = limits.processor.as_secs().max(1);
    set(Resource::Cpu, seconds, seconds.saturating_add(1))?;
    set(Resource::Core, 0, 0)?;
    // Nothing here opens, writes or starts anything.
    set(Resource::Fsize, 0, 0)?;
    Ok(())
}

fn evaluate(Task { name, source, arguments, rig, limits, purpose }: Task, pipes: &mut Pipes) -> Answer {
    let script = Script::parse(&name, &source);
    match purpose {
        Purpose::Resolve => Answer::Resolved(script.and_then(|script| {
            InThisProcess.resolve(&script, &arguments, &rig, &limits, &|| pipes.is_alone())
        })),
        Purpose::Declare => Answer::Declared(script.and_then(|script| {
            let parameters = InThisProcess.parameters(&script, &rig, &limits, &|| pipes.is_alone())?;
            serde_json::to_string(&parameters).map_err(|error| ScriptError::Evaluator {
                script: script.name().to_owned(),
                problem: error.to_string(),
            })
        })),
        Purpose::Run { seed } => Answer::Ended(
            script.and_then(|script| InThisProcess.execute(&script, &arguments, &rig, seed, &limits, pipes)),
        ),
    }
}

/// The pipes to and from the parent process.
struct Pipes {
    from: FrameReader,
    to: FrameWriter,
}

impl Pipes {
    fn send(&mut self, message: &impl Serialize) -> io::Result<()> {
        self.to.write_all(&frame::of(message).map_err(io::Error::other)?)
    }

    /// Sends the last message. A result that is too long is left out.
    fn answer(&mut self, answer: Answer) -> io::Result<()> {
        let whole = frame::of(&answer).map_err(io::Error::other)?;
        if whole.len() <= ANSWER_MAX_BYTES {
            return self.to.write_all(&whole);
        }
        self.send(&match answer {
            Answer::Ended(Ok(outcome)) => {
                Answer::Ended(Ok(Outcome { result: serde_json::Value::Null, ..outcome }))
            }
            other @ (Answer::Ended(Err(_)) | Answer::Call(_) | Answer::Resolved(_) | Answer::Declared(_)) => {
                other
            }
        })
    }

    /// Ends this process if the parent's has ended; otherwise false.
    fn is_alone(&self) -> bool {
        if self.from.is_closed() {
            process::exit(1);
        }
        false
    }
}

impl Host for Pipes {
    fn perform(&mut self, call: &Call) -> Result<Reply, Refusal> {
        let result = self.send(&Answer::Call(call.clone())).and_then(|()| self.from.read());
        let Ok(result) = result else { process::exit(1) };
        postcard::from_bytes(&result)
            .unwrap_or_else(|error| Err(Refusal::Failed(format!("the answer to a step is garbled: {error}"))))
    }

    fn cancelled(&self) -> bool {
        self.is_alone()
    }
}
