//! State that the functions of a script share during one evaluation.
//!
//! The evaluator passes no context to functions. Each evaluation has its own thread, so the context is thread-local.

use std::cell::{Cell, RefCell};
use std::rc::Rc;
use std::sync::atomic::{AtomicU8, AtomicU32, Ordering};

use serde_json::Value;
use starlark::eval::Evaluator;

use crate::evaluate::{Evaluated, Job, Purpose};
use crate::script_rng::ScriptRng;
use crate::{
    Call, Exceeded, LOG_LINE_MAX_BYTES, Location, Parameter, Refusal, Reply, ScriptError, Step, sandbox,
};

/// Message from the script's thread to the caller's.
#[derive(Debug)]
pub(crate) enum Message {
    /// A step; the script waits for the answer.
    Call(Call),
    /// The script has ended.
    Ended(Box<Result<Evaluated, ScriptError>>),
}

/// State that both threads see while the script computes.
#[derive(Debug, Default)]
pub(crate) struct Watch {
    stop: AtomicU8,
    line: AtomicU32,
}

/// Why the caller's thread wants the script to end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum Stop {
    /// The host cancelled.
    Cancelled = 1,
    /// [`ScriptLimits::think`](crate::ScriptLimits::think) is over.
    Think = 2,
}

impl Watch {
    pub(crate) fn stop(&self, stop: Stop) {
        self.stop.store(stop as u8, Ordering::Relaxed);
    }

    pub(crate) fn stopped(&self) -> Option<Stop> {
        match self.stop.load(Ordering::Relaxed) {
            1 => Some(Stop::Cancelled),
            2 => Some(Stop::Think),
            _ => None,
        }
    }

    /// The line in execution, counted from 1; 0 before the first.
    pub(crate) fn line(&self) -> u32 {
        self.line.load(Ordering::Relaxed)
    }

    pub(crate) fn at_line(&self, line: u32) {
        self.line.store(line, Ordering::Relaxed);
    }
}

/// Why a function ends the script.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(crate) enum Halt {
    #[error("{0}")]
    Failed(String),
    #[error("{0}")]
    Argument(String),
    #[error(transparent)]
    Refused(#[from] Refusal),
    #[error(transparent)]
    Exceeded(#[from] Exceeded),
}

impl From<Halt> for starlark::Error {
    fn from(halt: Halt) -> Self {
        Self::new_native(halt)
    }
}

/// The section of the script in execution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ScriptSection {
    /// The top level: may declare parameters, may not ask for steps.
    TopLevel,
    /// The function `run`: may ask for steps, may not declare parameters.
    Run,
}

/// One evaluation.
#[derive(Debug)]
pub(crate) struct EvaluationContext {
    pub(crate) job: Job,
    pub(crate) part: Cell<ScriptSection>,
    pub(crate) parameters: RefCell<Vec<Parameter>>,
    pub(crate) values: RefCell<Vec<(String, Value)>>,
    pub(crate) rng: RefCell<ScriptRng>,
    pub(crate) steps: Cell<u64>,
    log_bytes: Cell<usize>,
}

thread_local! {
    static SESSION: RefCell<Option<Rc<EvaluationContext>>> = const { RefCell::new(None) };
}

/// The context of this thread's evaluation.
pub(crate) fn current() -> Result<Rc<EvaluationContext>, Halt> {
    let context = SESSION.with_borrow(Clone::clone);
    context.ok_or_else(|| Halt::Failed("no script is being evaluated on this thread".into()))
}

/// An error once the script's values take more memory than they may, or the script is to end.
pub(crate) fn check_heap(eval: &Evaluator<'_, '_, '_>) -> Result<(), Halt> {
    current()?.check(eval)
}

impl EvaluationContext {
    pub(crate) fn new(job: Job) -> Self {
        let seed = match job.purpose {
            Purpose::Declare => 0,
            Purpose::Run { seed } => seed,
        };
        Self {
            job,
            part: Cell::new(ScriptSection::TopLevel),
            parameters: RefCell::default(),
            values: RefCell::default(),
            rng: RefCell::new(ScriptRng::seeded(seed)),
            steps: Cell::new(0),
            log_bytes: Cell::new(0),
        }
    }

    /// Makes this the context of the current thread.
    pub(crate) fn begin(self) -> Rc<Self> {
        let context = Rc::new(self);
        SESSION.set(Some(Rc::clone(&context)));
        context
    }

    /// An error once the script's values take more memory than they may, or the script is to end.
    pub(crate) fn check(&self, eval: &Evaluator<'_, '_, '_>) -> Result<(), Halt> {
        let heap_bytes = eval.heap().allocated_bytes() + eval.frozen_heap().allocated_bytes();
        if heap_bytes > self.job.limits.heap_bytes {
            return Err(Exceeded::Heap(self.job.limits.heap_bytes).into());
        }
        self.job.watch.stopped().map_or(Ok(()), |stop| Err(self.halt(stop)))
    }

    /// The reason for the script's end when the caller's thread demands it.
    pub(crate) fn halt(&self, stop: Stop) -> Halt {
        match stop {
            Stop::Cancelled => Refusal::Stopped("the run was stopped".into()).into(),
            Stop::Think => Exceeded::Think(self.job.limits.think).into(),
        }
    }

    /// Declares a parameter and returns its value.
    pub(crate) fn declare(&self, parameter: Parameter) -> Result<Value, Halt> {
        if self.part.get() != ScriptSection::TopLevel {
            return Err(Halt::Failed("parameters are declared at the top level, not inside run".into()));
        }
        let parameter = parameter.declare().map_err(Halt::Failed)?;
        let mut parameters = self.parameters.borrow_mut();
        if parameters.iter().any(|earlier| earlier.name == parameter.name) {
            return Err(Halt::Failed(format!("the parameter {:?} is declared twice", parameter.name)));
        }
        let value = self.job.arguments.value_for(&parameter).map_err(Halt::Argument)?;
        self.values.borrow_mut().push((parameter.name.clone(), value.clone()));
        parameters.push(parameter);
        Ok(value)
    }

    /// An error if there is an argument for a parameter that was not declared.
    pub(crate) fn check_arguments(&self) -> Result<(), Halt> {
        self.job.arguments.check_names(&self.parameters.borrow()).map_err(Halt::Argument)
    }

    /// A line for the run's events, cut if it is too long.
    pub(crate) fn log_line(&self, mut line: String) -> Result<String, Halt> {
        let bytes = line.len();
        if bytes > LOG_LINE_MAX_BYTES {
            line.truncate(line.floor_char_boundary(LOG_LINE_MAX_BYTES));
            line = format!("{line} ... (a line of {bytes} bytes)");
        }
        let logged = self.log_bytes.get() + line.len();
        if logged > self.job.limits.log_bytes {
            return Err(Exceeded::Log(self.job.limits.log_bytes).into());
        }
        self.log_bytes.set(logged);
        Ok(line)
    }

    /// Asks the host for a step, and waits for its result.
    pub(crate) fn ask(&self, step: Step, eval: &Evaluator<'_, '_, '_>) -> Result<Reply, Halt> {
        if self.part.get() != ScriptSection::Run {
            return Err(Halt::Failed(
                "only run(rig) may do something: the top level declares parameters".into(),
            ));
        }
        self.check(eval)?;
        if self.steps.get() >= self.job.limits.steps {
            return Err(Exceeded::Steps(self.job.limits.steps).into());
        }
        self.steps.set(self.steps.get() + 1);
        let line =
            eval.call_stack_top_location().map_or_else(|| self.job.watch.line(), |span| sandbox::line(&span));
        let at = Location { script: self.job.script.name().to_owned(), line, column: None };
        let call = Call { step, at };
        let gone = |()| Halt::from(Refusal::Stopped("nobody waits for the script any more".into()));
        self.job.calls.send(Message::Call(call)).map_err(|_| gone(()))?;
        Ok(self.job.replies.recv().map_err(|_| gone(()))??)
    }
}
