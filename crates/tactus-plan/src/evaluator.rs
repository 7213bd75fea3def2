//! Where scripts are evaluated.

use std::fmt;

use crate::script::{declare, resolve};
use crate::{Arguments, Host, Outcome, Parameter, RigView, Script, ScriptError, ScriptLimits, execute};

/// Evaluates scripts: in this process, or in one of their own.
pub trait Evaluate: fmt::Debug + Send + Sync {
    /// As [`execute()`]: runs a script to its end. Its steps are performed by `host` on the caller's thread.
    ///
    /// # Errors
    /// As [`execute()`]; also a limit of the script's process.
    fn execute(
        &self,
        script: &Script,
        arguments: &Arguments,
        rig: &RigView,
        seed: u64,
        limits: &ScriptLimits,
        host: &mut dyn Host,
    ) -> Result<Outcome, ScriptError>;

    /// As [`Arguments::resolve`], within `limits`. Ends early once `stopped` is true, which is asked now and then.
    ///
    /// # Errors
    /// As [`Arguments::resolve`]; also a limit of the script's process.
    fn resolve(
        &self,
        script: &Script,
        arguments: &Arguments,
        rig: &RigView,
        limits: &ScriptLimits,
        stopped: &dyn Fn() -> bool,
    ) -> Result<Arguments, ScriptError>;

    /// As [`Script::parameters`], within `limits`. Ends early once `stopped` is true, which is asked now and then.
    ///
    /// # Errors
    /// As [`Script::parameters`]; also a limit of the script's process.
    fn parameters(
        &self,
        script: &Script,
        rig: &RigView,
        limits: &ScriptLimits,
        stopped: &dyn Fn() -> bool,
    ) -> Result<Vec<Parameter>, ScriptError>;
}

/// Evaluates in the caller's process: for libraries and tests. The crate's documentation tells what this does not bound.
#[derive(Debug, Clone, Copy, Default)]
pub struct InThisProcess;

impl Evaluate for InThisProcess {
    fn execute(
        &self,
        script: &Script,
        arguments: &Arguments,
        rig: &RigView,
        seed: u64,
        limits: &ScriptLimits,
        host: &mut dyn Host,
    ) -> Result<Outcome, ScriptError> {
        execute(script, arguments, rig, seed, limits, host)
    }

    fn resolve(
        &self,
        script: &Script,
        arguments: &Arguments,
        rig: &RigView,
        limits: &ScriptLimits,
        stopped: &dyn Fn() -> bool,
    ) -> Result<Arguments, ScriptError> {
        resolve(script, arguments, rig, limits, stopped)
    }

    fn parameters(
        &self,
        script: &Script,
        rig: &RigView,
        limits: &ScriptLimits,
        stopped: &dyn Fn() -> bool,
    ) -> Result<Vec<Parameter>, ScriptError> {
        Ok(declare(script, &Arguments::default(), rig, limits, stopped)?.parameters)
    }
}
