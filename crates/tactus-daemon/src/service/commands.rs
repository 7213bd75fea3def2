//! Answers the commands on the bus.

use std::fmt;
use std::sync::Arc;

use tactus_bus::{CommandCall, Publisher, Request};
use tactus_engine::{Engine, ResetError, RunOrder, StopOrder};
use tactus_plan::{Arguments, Evaluate, Script};
use tactus_runner::config::Config;
use tactus_runner::order::{self, RunRequest};
use tactus_runner::recorder::ThreadRecorder;
use tactus_runner::script_process::ScriptProcesses;
use tactus_runner::twin::DryRun;
use tactus_runner::{experiments, twin};
use tactus_schema::key::Command;
use tactus_schema::{MonoTime, Rig, WallTime, pb};
use tokio::sync::mpsc;
use tracing::{info, warn};

use super::health::health;

/// The CLI's exit codes for a failed command.
mod exit {
    pub(super) const FAILED: u32 = 1;
    pub(super) const USAGE: u32 = 2;
    pub(super) const REFUSED: u32 = 4;
    pub(super) const NOT_NOW: u32 = 5;
}

/// Answers commands for one engine.
pub(super) struct CommandDesk {
    engine: Engine,
    config: Config,
    publisher: Publisher,
    evaluator: Arc<dyn Evaluate>,
}

/// Why a command was not done.
struct Refusal {
    exit_code: u32,
    error: String,
}

impl CommandDesk {
    pub(super) fn new(engine: Engine, config: Config, publisher: Publisher) -> Self {
        let evaluator = Arc::new(ScriptProcesses::of_this_program());
        Self { engine, config, publisher, evaluator }
    }

    pub(super) async fn answer_stops(self: Arc<Self>, mut stops: mpsc::Receiver<CommandCall>) {
        while let Some(call) = stops.recv().await {
            let order = match call.request {
                Request::Control(request) => {
                    StopOrder { by: request.who, reason: request.reason, abort: request.abort }
                }
                Request::Run(_) => StopOrder { by: "unknown".into(), reason: String::new(), abort: false },
            };
            let was_running = self.engine.stop(order.clone());
            warn!(by = order.by, reason = order.reason, was_running, "stop");
            call.reply.reply(self.reply(Ok(())));
        }
    }

    pub(super) async fn answer_commands(self: Arc<Self>, mut commands: mpsc::Receiver<CommandCall>) {
        while let Some(call) = commands.recv().await {
            match (call.command, call.request) {
                (Command::Run, Request::Run(request)) => {
                    // A dry run takes a while: other commands are answered meanwhile.
                    let desk = Arc::clone(&self);
                    tokio::spawn(async move {
                        let done = desk.run(request).await;
                        call.reply.reply(desk.reply(done));
                    });
                }
                (Command::Reset, _) => {
                    // Homing takes a while.
                    let desk = Arc::clone(&self);
                    tokio::spawn(async move {
                        let done = desk.reset().await;
                        call.reply.reply(desk.reply(done));
                    });
                }
                (Command::Pause, _) => call.reply.reply(self.reply(self.pause())),
                (Command::Resume, _) => call.reply.reply(self.reply(self.resume())),
                (Command::Status | Command::Stop | Command::Run, _) => call.reply.reply(self.reply(Ok(()))),
            }
        }
    }

    fn pause(&self) -> Result<(), Refusal> {
        if self.engine.pause() { Ok(()) } else { Err(Refusal::failed("no run is in progress")) }
    }

    fn resume(&self) -> Result<(), Refusal> {
        if self.engine.resume() { Ok(()) } else { Err(Refusal::failed("no run is paused")) }
    }

    async fn reset(&self) -> Result<(), Refusal> {
        info!("reset: clearing the stage's alarm and homing");
        self.engine.reset().await.map_err(|error| match error {
            ResetError::Busy(busy) => Refusal::not_now(busy),
            ResetError::Stopped(_) | ResetError::Stage(_) | ResetError::NotReady(_) => Refusal::failed(error),
        })
    }

    /// Checks the request, dry-runs it, and starts the run.
    async fn run(&self, request: pb::RunRequest) -> Result<(), Refusal> {
        // From here on a stop ends this run, even before the dry run is over.
        let claim = self.engine.claim().map_err(Refusal::not_now)?;
        if let Some(fault) = self.engine.fault() {
            return Err(Refusal::refused(format!(
                "{fault}: see that the tip is free to move, then `tactus reset`"
            )));
        }
        let script = self.script(&request)?;
        let arguments = Arguments::from_json(&request.parameters_json).map_err(Refusal::usage)?;
        let who = if request.who.is_empty() { "unknown".into() } else { request.who };
        let evaluator = Arc::clone(&self.evaluator);
        let request = RunRequest { script, arguments, seed: request.seed, who, evaluator };
        let rig = self.engine.rig();
        let now = self.engine.clock().now().wall;
        let twin_rig = rig.clone();
        info!(who = request.who, "the dry run begins");
        let prepare = move || {
            let prepared = prepare(request, &twin_rig, now, &|| claim.check().is_err());
            (claim, prepared)
        };
        let (claim, prepared) = tokio::task::spawn_blocking(prepare).await.map_err(Refusal::failed)?;
        // What a stop has broken off is told as stopped, not as impossible.
        claim.check().map_err(Refusal::failed)?;
        let (mut order, plan) = prepared?;
        if !plan.is_possible() {
            let refused = plan.outcome.exit_status == pb::ExitStatus::Refused;
            let exit_code = if refused { exit::REFUSED } else { exit::FAILED };
            return Err(Refusal { exit_code, error: plan.outcome.message });
        }
        order.planned = Some(plan.promise());
        let texts = self.config.rig.texts.all();
        let (recording, path) =
            order::recording(&order, &rig, texts, &self.config.recordings, now).map_err(Refusal::failed)?;
        let path = std::path::absolute(&path).unwrap_or(path);
        info!(run = order.run_id, recording = %path.display(), presses = plan.promise().presses, "run accepted");
        let record = Box::new(ThreadRecorder::start(recording).map_err(Refusal::failed)?);
        order.recording = path.display().to_string();
        let run_id = order.run_id.clone();
        tokio::spawn(claim.run(order, record));
        // The answer contains the state of this run, not of the previous one.
        self.engine.state().wait_for(|state| state.run_id == run_id).await.map(drop).map_err(Refusal::failed)
    }

    fn script(&self, request: &pb::RunRequest) -> Result<Script, Refusal> {
        if request.script.is_empty() {
            experiments::named(&request.experiment, self.config.experiments.as_deref())
                .map_err(Refusal::usage)
        } else {
            Script::parse(&request.experiment, &request.script).map_err(Refusal::usage)
        }
    }

    fn reply(&self, done: Result<(), Refusal>) -> pb::CommandReply {
        let (ok, error, exit_code) = match done {
            Ok(()) => (true, String::new(), 0),
            Err(Refusal { exit_code, error }) => (false, error, exit_code),
        };
        pb::CommandReply {
            ok,
            error,
            exit_code,
            state: Some(self.engine.run_state()),
            rig: self.engine.rig().name.clone(),
            version: env!("CARGO_PKG_VERSION").into(),
            stage: Some(self.engine.stage_state()),
            health: Some(health(&self.engine, &self.publisher, (0, MonoTime::default()))),
        }
    }
}

/// Checks the parameters and makes the dry run, until `stopped`.
fn prepare(
    request: RunRequest,
    rig: &Rig,
    now: WallTime,
    stopped: &dyn Fn() -> bool,
) -> Result<(RunOrder, DryRun), Refusal> {
    let order = order::order(request, rig, now, stopped).map_err(Refusal::usage)?;
    let plan = twin::dry_run(rig, order.clone(), stopped).map_err(Refusal::failed)?;
    Ok((order, plan))
}

impl Refusal {
    fn failed(error: impl fmt::Display) -> Self {
        Self { exit_code: exit::FAILED, error: format!("{error}") }
    }

    fn not_now(error: impl fmt::Display) -> Self {
        Self { exit_code: exit::NOT_NOW, error: format!("{error}") }
    }

    fn refused(error: impl fmt::Display) -> Self {
        Self { exit_code: exit::REFUSED, error: format!("{error}") }
    }

    fn usage(error: impl fmt::Display) -> Self {
        Self { exit_code: exit::USAGE, error: format!("{error}") }
    }
}

#[cfg(test)]
#[path = "commands_tests.rs"]
mod tests;
