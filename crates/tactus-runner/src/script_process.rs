//! Scripts in a process of their own, which the system bounds and which can be killed at any time.
//!
//! The program executes itself again, with [`main_if_child`] as its main function:
//!
//! | this process | the script's process |
//! |---|---|
//! | starts it, and sends the script and its limits | limits itself, then evaluates |
//! | performs a step | waits |
//! | kills it when the run is stopped or its time is over | ends with this process, however that ends |
//!
//! Messages are frames on its standard input and output: a length of 4 bytes, least significant first, then `postcard`.
//! What goes wrong in it (too much memory, too much computing, a stack that overflows, a crash of the evaluator) is a
//! [`ScriptError`] here.

mod child;
mod frame;

use std::io::{self, Read};
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::PathBuf;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use rustix::process::Signal;
use serde::{Deserialize, Serialize};
use tactus_plan::{
    Arguments, Call, Evaluate, Exceeded, Host, Location, Outcome, Parameter, Refusal, RigView, Script,
    ScriptError, ScriptLimits,
};

pub use child::main_if_child;
use frame::{FrameReader, FrameWriter};

/// How often it is asked whether to stop, while the script computes.
const POLL: Duration = Duration::from_millis(20);

/// Time beyond [`ScriptLimits::think`] in which the script's process may itself tell which line took too long.
const GRACE: Duration = Duration::from_secs(3);

/// Longest message of the script's process.
const ANSWER_MAX_BYTES: usize = 4 << 20;

/// Most that is read of what the script's process says about its own end.
const LAST_WORDS_MAX_BYTES: u64 = 8 << 10;

/// First message to the script's process: all that it has to know.
#[derive(Debug, Serialize, Deserialize)]
struct Task {
    name: String,
    source: String,
    arguments: Arguments,
    rig: RigView,
    limits: ScriptLimits,
    purpose: Purpose,
}

/// What is to be evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
enum Purpose {
    /// The values of the parameters only.
    Resolve,
    /// The declarations of the parameters only.
    Declare,
    /// The whole script.
    Run { seed: u64 },
}

/// Message from the script's process.
#[derive(Debug, Serialize, Deserialize)]
enum Answer {
    /// A step; the script waits for its result.
    Call(Call),
    Resolved(Result<Arguments, ScriptError>),
    /// The parameters as JSON: their values have any type.
    Declared(Result<String, ScriptError>),
    Ended(Result<Outcome, ScriptError>),
}

/// Evaluates each script in a process of its own.
#[derive(Debug, Clone)]
pub struct ScriptProcesses {
    program: PathBuf,
    /// What the program gets before its own argument.
    leading: Vec<String>,
}

impl ScriptProcesses {
    /// Processes of this program, whose main function begins with [`main_if_child`].
    pub fn of_this_program() -> Self {
        // Not the program's path: behind that may stand a newer version by now.
        Self::of("/proc/self/exe")
    }

    /// Processes of another program of that kind.
    pub fn of(program: impl Into<PathBuf>) -> Self {
        Self { program: program.into(), leading: Vec::new() }
    }

    fn start(&self, script: &str, limits: ScriptLimits) -> io::Result<ScriptProcess> {
        let mut program = Command::new(&self.program);
        program.arg0("tactus-script").args(&self.leading).arg(child::ARGUMENT);
        ScriptProcess::start(&mut program, script, limits)
    }

    fn converse(&self, task: &Task, host: &mut dyn Host) -> Result<Answer, ScriptError> {
        let (script, limits) = (task.name.clone(), task.limits.clone());
        let broken = |problem: String| ScriptError::Evaluator { script: script.clone(), problem };
        let mut process = self
            .start(&script, limits)
            .map_err(|error| broken(format!("no process for the script: {error}")))?;
        let mut next = process.send(task, host);
        loop {
            next = match next.and_then(|()| process.receive(host)) {
                Ok(Answer::Call(call)) => {
                    process.line = call.at.line;
                    let result = host.perform(&call);
                    process.send(&result, host)
                }
                Ok(answer) => return Ok(answer),
                Err(end) => return Err(process.explain(end)),
            };
        }
    }
}

impl Evaluate for ScriptProcesses {
    fn execute(
        &self,
        script: &Script,
        arguments: &Arguments,
        rig: &RigView,
        seed: u64,
        limits: &ScriptLimits,
        host: &mut dyn Host,
    ) -> Result<Outcome, ScriptError> {
        let task = Task::new(script, arguments, rig, limits, Purpose::Run { seed });
        match self.converse(&task, host)? {
            Answer::Ended(ended) => ended,
            Answer::Call(_) | Answer::Resolved(_) | Answer::Declared(_) => Err(out_of_turn(script)),
        }
    }

    fn resolve(
        &self,
        script: &Script,
        arguments: &Arguments,
        rig: &RigView,
        limits: &ScriptLimits,
        stopped: &dyn Fn() -> bool,
    ) -> Result<Arguments, ScriptError> {
        let task = Task::new(script, arguments, rig, limits, Purpose::Resolve);
        match self.converse(&task, &mut Unasked(stopped))? {
            Answer::Resolved(resolved) => resolved,
            Answer::Call(_) | Answer::Ended(_) | Answer::Declared(_) => Err(out_of_turn(script)),
        }
    }

    fn parameters(
        &self,
        script: &Script,
        rig: &RigView,
        limits: &ScriptLimits,
        stopped: &dyn Fn() -> bool,
    ) -> Result<Vec<Parameter>, ScriptError> {
        let task = Task::new(script, &Arguments::default(), rig, limits, Purpose::Declare);
        match self.converse(&task, &mut Unasked(stopped))? {
            Answer::Declared(declared) => {
                serde_json::from_str(&declared?).map_err(|error| ScriptError::Evaluator {
                    script: script.name().to_owned(),
                    problem: format!("its parameters cannot be read: {error}"),
                })
            }
            Answer::Call(_) | Answer::Ended(_) | Answer::Resolved(_) => Err(out_of_turn(script)),
        }
    }
}

fn out_of_turn(script: &Script) -> ScriptError {
    let problem = "its process answered what it was not asked; this is a defect of Tactus".into();
    ScriptError::Evaluator { script: script.name().to_owned(), problem }
}

impl Task {
    fn new(
        script: &Script,
        arguments: &Arguments,
        rig: &RigView,
        limits: &ScriptLimits,
        purpose: Purpose,
    ) -> Self {
        Self {
            name: script.name().to_owned(),
            source: script.source().to_owned(),
            arguments: arguments.clone(),
            rig: rig.clone(),
            limits: limits.clone(),
            purpose,
        }
    }
}

/// The host while parameters are resolved: no step is performed.
struct Unasked<'a>(&'a dyn Fn() -> bool);

impl Host for Unasked<'_> {
    fn perform(&mut self, _call: &Call) -> Result<tactus_plan::Reply, Refusal> {
        Err(Refusal::Failed("nothing is performed while parameters are resolved".into()))
    }

    fn cancelled(&self) -> bool {
        self.0()
    }
}

/// Why a conversation ended early.
#[derive(Debug)]
enum End {
    /// The host wants the script to end.
    Cancelled,
    /// The script computed too long.
    Late,
    /// The process ended without an answer.
    Gone,
    /// It sent what cannot be understood.
    Garbled(String),
}

impl From<io::Error> for End {
    fn from(error: io::Error) -> Self {
        // The pipes are closed when the process ends.
        let gone = [io::ErrorKind::BrokenPipe, io::ErrorKind::UnexpectedEof];
        if gone.contains(&error.kind()) { Self::Gone } else { Self::Garbled(error.to_string()) }
    }
}

/// The script's process. Dropping it kills it.
#[derive(Debug)]
struct ScriptProcess {
    child: Child,
    to: FrameWriter,
    from: FrameReader,
    script: String,
    limits: ScriptLimits,
    /// The line of the last step.
    line: u32,
}

impl ScriptProcess {
    fn start(program: &mut Command, script: &str, limits: ScriptLimits) -> io::Result<Self> {
        let mut child = program
            .env_clear()
            .current_dir("/")
            // Keys of a terminal are for the program, which then decides about its script.
            .process_group(0)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()?;
        let closed = || io::Error::other("its pipes are not there");
        let to = FrameWriter::new(child.stdin.take().ok_or_else(closed)?.into());
        let from = FrameReader::new(child.stdout.take().ok_or_else(closed)?.into(), ANSWER_MAX_BYTES);
        Ok(Self { child, to, from, script: script.to_owned(), limits, line: 1 })
    }

    /// Sends a message, piece by piece, so that a process that does not read can be left at any time.
    fn send(&mut self, message: &impl Serialize, host: &dyn Host) -> Result<(), End> {
        let deadline = self.deadline();
        let frame = frame::of(message).map_err(End::Garbled)?;
        let mut left = frame.as_slice();
        while !left.is_empty() {
            let rest = self.to.write_some(left, POLL)?;
            if rest.len() == left.len() {
                check(host, deadline)?;
            }
            left = rest;
        }
        Ok(())
    }

    /// Waits for the next message.
    fn receive(&mut self, host: &dyn Host) -> Result<Answer, End> {
        let deadline = self.deadline();
        loop {
            if let Some(answer) = self.from.read_some(POLL)? {
                return postcard::from_bytes(&answer).map_err(|error| End::Garbled(error.to_string()));
            }
            check(host, deadline)?;
        }
    }

    fn deadline(&self) -> Instant {
        Instant::now() + self.limits.think + GRACE
    }

    /// Ends the process, and says why the conversation ended.
    fn explain(&mut self, end: End) -> ScriptError {
        // It may have ended already; then this does nothing.
        let killed = self.child.kill().and_then(|()| self.child.wait());
        let at = Location { script: self.script.clone(), line: self.line, column: None };
        let limit = |exceeded| ScriptError::Limit { at: at.clone(), exceeded, call_stack: String::new() };
        let broken = |problem| ScriptError::Evaluator { script: self.script.clone(), problem };
        match (end, killed) {
            (End::Cancelled, _) => {
                let refusal = Refusal::Stopped("the run was stopped".into());
                ScriptError::Refused { at, refusal, call_stack: String::new() }
            }
            (End::Late, _) => limit(Exceeded::Think(self.limits.think)),
            (End::Garbled(problem), _) => broken(format!("its process sent {problem}")),
            (End::Gone, Err(error)) => broken(format!("its process ended: {error}")),
            (End::Gone, Ok(status)) => {
                let said = last_words(&mut self.child);
                exceeded(status, &said, &self.limits)
                    .map_or_else(|| broken(format!("its process ended, {status}: {}", said.trim())), limit)
            }
        }
    }
}

impl Drop for ScriptProcess {
    fn drop(&mut self) {
        // At once and without a word: it holds nothing that has to be closed. It may have ended already.
        if self.child.kill().is_ok() {
            let _status = self.child.wait();
        }
    }
}

fn check(host: &dyn Host, deadline: Instant) -> Result<(), End> {
    if host.cancelled() {
        return Err(End::Cancelled);
    }
    if Instant::now() > deadline { Err(End::Late) } else { Ok(()) }
}

/// What the process wrote to its standard error.
fn last_words(child: &mut Child) -> String {
    let mut said = Vec::new();
    if let Some(stderr) = child.stderr.take() {
        // Nothing more comes: the process is gone. What cannot be read is not known.
        let _read = stderr.take(LAST_WORDS_MAX_BYTES).read_to_end(&mut said);
    }
    String::from_utf8_lossy(&said).into_owned()
}

/// The limit that ended the process, if it was one.
fn exceeded(status: ExitStatus, said: &str, limits: &ScriptLimits) -> Option<Exceeded> {
    if status.signal() == Some(Signal::XCPU.as_raw()) {
        return Some(Exceeded::Processor(limits.processor));
    }
    // The words of Rust's standard library, its allocator's callers, and the evaluator's heap.
    if said.contains("memory allocation of")
        || said.contains("out of memory")
        || said.contains("capacity overflow")
    {
        return Some(Exceeded::Process(limits.process_bytes));
    }
    said.contains("has overflowed its stack").then_some(Exceeded::Stack(tactus_plan::STACK_BYTES))
}

#[cfg(test)]
#[path = "script_process_tests.rs"]
mod tests;
