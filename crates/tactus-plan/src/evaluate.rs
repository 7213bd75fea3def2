//! The script's side of an evaluation, on a thread of its own.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender};

use serde_json::Value as Json;
use starlark::codemap::FileSpanRef;
use starlark::environment::Module;
use starlark::eval::{BeforeStmtFunc, BeforeStmtFuncDyn, Evaluator};
use starlark::{Error, ErrorKind};

use crate::builtins::{rig_value, to_json};
use crate::context::{self, EvaluationContext, Halt, Message, ScriptSection, Watch};
use crate::{
    Arguments, Exceeded, Location, Parameter, Refusal, Reply, RigView, Script, ScriptError, ScriptLimits,
    sandbox,
};

/// Purpose of an evaluation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// The parameters only.
    Declare,
    /// The whole script.
    Run {
        /// Seed of its random numbers.
        seed: u64,
    },
}

/// Input of the script's thread.
#[derive(Debug)]
pub(crate) struct Job {
    pub(crate) script: Script,
    pub(crate) arguments: Arguments,
    pub(crate) rig: RigView,
    pub(crate) limits: ScriptLimits,
    pub(crate) purpose: Purpose,
    pub(crate) watch: Arc<Watch>,
    pub(crate) calls: SyncSender<Message>,
    pub(crate) replies: Receiver<Result<Reply, Refusal>>,
}

/// Result of an evaluation.
#[derive(Debug)]
pub(crate) struct Evaluated {
    pub(crate) parameters: Vec<Parameter>,
    pub(crate) values: Arguments,
    pub(crate) result: Json,
    pub(crate) steps: u64,
    pub(crate) ticks: u64,
    pub(crate) heap_bytes: usize,
}

/// Evaluates a script and sends the result.
pub(crate) fn evaluate(job: Job) {
    let context = EvaluationContext::new(job).begin();
    let ended = Module::with_temp_heap(|module| evaluate_in(&module, &context));
    // If the receiver is gone, nobody needs the result.
    drop(context.job.calls.send(Message::Ended(Box::new(ended))));
}

fn evaluate_in(module: &Module<'_>, context: &EvaluationContext) -> Result<Evaluated, ScriptError> {
    let Job { script, limits, purpose, watch, .. } = &context.job;
    let rig = rig_value(&context.job.rig, module.heap());
    module.set("rig", rig);
    let mut eval = Evaluator::new(module);
    // Garbage collection would run between top-level statements only, where scripts do no work, and recurses into values
    // of any depth. Memory is bounded without it.
    eval.disable_gc();
    let bounded = eval
        .set_max_callstack_size(limits.call_depth.max(1))
        .and_then(|()| eval.set_max_tick_count(limits.ticks.max(1)))
        .and_then(|()| eval.set_max_heap_size(limits.heap_bytes.max(1)));
    bounded.map_err(|error| ScriptError::Evaluator {
        script: script.name().to_owned(),
        problem: error.to_string(),
    })?;
    eval.set_check_cancelled(Box::new(|| watch.stopped().is_some()));
    // Hidden from the crate's documentation, but public: its debugger is built on it.
    eval.before_stmt_for_dap(BeforeStmtFunc::from_dyn(Box::new(BeforeStatement)));

    let mut evaluated = eval.eval_module(script.ast().clone(), &sandbox::GLOBALS).map(|_| Json::Null);
    evaluated = evaluated.and_then(|none| Ok(context.check_arguments().map(|()| none)?));
    if let (Ok(_), Purpose::Run { .. }) = (&evaluated, purpose) {
        context.part.set(ScriptSection::Run);
        watch.at_line(script.run_line());
        evaluated = match module.get("run") {
            Some(run) => eval.eval_function(run, &[rig], &[]).map(to_json),
            None => Err(Halt::Failed("`run` is not defined at the end of the top level".into()).into()),
        };
    }
    match evaluated {
        Ok(result) => Ok(Evaluated {
            parameters: context.parameters.take(),
            values: context.values.take().into_iter().collect(),
            result,
            steps: context.steps.get(),
            ticks: eval.get_total_tick_count(),
            heap_bytes: module.heap().allocated_bytes(),
        }),
        Err(error) => Err(script_error(&error, &eval, context)),
    }
}

/// Checks the limits before each statement.
struct BeforeStatement;

impl<'e> BeforeStmtFuncDyn<'e> for BeforeStatement {
    fn call<'v>(
        &mut self,
        span: FileSpanRef<'_>,
        _continued: bool,
        eval: &mut Evaluator<'v, '_, 'e>,
    ) -> starlark::Result<()> {
        let context = context::current()?;
        context.job.watch.at_line(sandbox::line(&span.to_file_span()));
        Ok(context.check(eval)?)
    }
}

/// Converts the evaluator's error.
fn script_error(error: &Error, eval: &Evaluator<'_, '_, '_>, context: &EvaluationContext) -> ScriptError {
    let script = context.job.script.name().to_owned();
    let line = error.span().map_or_else(|| context.job.watch.line().max(1), sandbox::line);
    let column = error.span().and_then(sandbox::column);
    let at = Location { script: script.clone(), line, column };
    let call_stack = shortened(error.to_string());
    match halt(error, eval, context) {
        Halt::Failed(problem) => ScriptError::Evaluation { at, problem: shortened(problem), call_stack },
        Halt::Argument(problem) => ScriptError::Argument { script, problem: shortened(problem) },
        Halt::Refused(refusal) => ScriptError::Refused { at, refusal, call_stack },
        Halt::Exceeded(exceeded) => ScriptError::Limit { at, exceeded, call_stack },
    }
}

fn halt(error: &Error, eval: &Evaluator<'_, '_, '_>, context: &EvaluationContext) -> Halt {
    let Job { limits, watch, .. } = &context.job;
    if let ErrorKind::Native(native) = error.kind()
        && let Some(halt) = native.downcast_ref::<Halt>()
    {
        return halt.clone();
    }
    if let ErrorKind::StackOverflow(_) = error.kind() {
        return Exceeded::CallDepth(limits.call_depth).into();
    }
    // The evaluator's own checks, once in a thousand ticks, have no kind of their own.
    if let ErrorKind::Other(_) = error.kind() {
        if let Some(stop) = watch.stopped() {
            return context.halt(stop);
        }
        if eval.get_total_tick_count() > limits.ticks {
            return Exceeded::Ticks(limits.ticks).into();
        }
        if eval.heap().allocated_bytes() > limits.heap_bytes {
            return Exceeded::Heap(limits.heap_bytes).into();
        }
    }
    Halt::Failed(error.without_diagnostic().to_string().trim().to_owned())
}

/// Shortens a text that may quote a script's values, for use in messages.
fn shortened(mut text: String) -> String {
    const BYTES_MAX: usize = 8 << 10;
    if text.len() > BYTES_MAX {
        text.truncate(text.floor_char_boundary(BYTES_MAX));
        text.push_str(" ...");
    }
    text
}
