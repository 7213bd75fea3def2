//! A run on the service.

use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Context, bail};
use tactus_bus::{Client, History};
use tactus_runner::twin::SoFar;
use tactus_schema::key::Command;
use tactus_schema::pb::{self, RunPhase, RunState};
use tokio::signal::unix::{SignalKind, signal};

use super::{RunSummary, Subject, Told, taken_over_in_words};
use crate::cli::RunArgs;
use crate::connection::{self, PATIENCE};
use crate::exit::in_words;
use crate::progress::RunProgress;

/// How long the dry run may take before the service answers.
const DRY_RUN_PATIENCE: Duration = Duration::from_mins(5);

pub(super) async fn run(
    client: Client,
    args: &RunArgs,
    subject: Subject,
    told: Told<'_>,
) -> anyhow::Result<RunSummary> {
    if told.has_words() {
        println!("running on the service at {} (rig {:?})", client.endpoint(), client.rig());
    }
    let mut states = client.subscribe::<RunState>(History::Last).await?;
    let held = connection::hold(&client, &args.lease).await?;
    let rehearsing = told.progress();
    rehearsing.rehearse(SoFar { presses: 0, share: None });
    let request = pb::RunRequest { who: args.who.clone(), lease: held.secret(), ..request_of(subject) };
    let reply = ask(&client, &request, &rehearsing).await;
    rehearsing.clear();
    let reply = match reply {
        Ok(reply) => reply,
        Err(refusal) => {
            connection::release(held).await;
            return Err(refusal);
        }
    };
    let accepted = reply.state.context("the service's answer has no state; is it of another version?")?;
    if !reply.note.is_empty() {
        eprintln!("tactus: {}", reply.note);
    }
    if let Some(taken) = accepted.taken_over.as_ref().filter(|_| told.has_words()) {
        println!("{}", taken_over_in_words(taken, accepted.presses_planned));
    }

    let progress = told.progress();
    let mut alive = client.alive();
    let mut interrupts = signal(SignalKind::interrupt())?;
    let mut held = Some(held);
    let finished = loop {
        let lost = async {
            match &mut held {
                Some(held) => held.lost().await,
                None => std::future::pending().await,
            }
        };
        tokio::select! {
            biased;
            Some(()) = interrupts.recv() => {
                progress.say("Ctrl-C: stopping and retracting");
                let request =
                    pb::CommandRequest { who: connection::who(), reason: "Ctrl-C".into(), ..Default::default() };
                if let Err(error) = client.stop(&request, PATIENCE).await {
                    progress.say(&format!("STOP FAILED: {}; Ctrl-C tries again", in_words(&error.into())));
                }
            }
            why = lost => {
                progress.say(&format!("the lease is lost, the run goes on without it: {why}"));
                held = None;
            }
            there = alive.changed() => if there != Some(true) {
                bail!("the service disappeared during run {}; `tactus status` shows whether it is back", accepted.run_id);
            },
            state = states.recv() => {
                let state = state.context("the connection to the service ended")?;
                if state.run_id != accepted.run_id {
                    continue;
                }
                if state.phase() == RunPhase::Finished {
                    break state;
                }
                progress.show(&state);
            }
        }
    };
    progress.clear();
    if let Some(held) = held {
        connection::release(held).await;
    }
    client.close().await?;
    Ok(RunSummary {
        exit_status: finished.exit_status(),
        run_id: finished.run_id,
        experiment: finished.experiment,
        message: finished.message,
        simulated: finished.simulated,
        embedded: false,
        frames: finished.frames,
        frames_lost: finished.frames_lost,
        presses: finished.presses,
        dwells: finished.dwells,
        duration_s: finished.elapsed_s,
        recording: PathBuf::from(finished.recording),
        taken_over: finished.taken_over,
    })
}

/// The request without who asks.
fn request_of(subject: Subject) -> pb::RunRequest {
    match subject {
        Subject::Experiment { script, arguments, seed } => pb::RunRequest {
            experiment: script.name().to_owned(),
            script: script.source().to_owned(),
            parameters_json: arguments.to_json(),
            seed,
            ..Default::default()
        },
        Subject::Rest(run_id) => pb::RunRequest { continue_run: run_id, ..Default::default() },
    }
}

/// Asks for the run, and shows how far its dry run is until the service answers.
async fn ask(
    client: &Client,
    request: &pb::RunRequest,
    rehearsing: &RunProgress,
) -> anyhow::Result<pb::CommandReply> {
    // Its own subscription, so that no state of the run is taken from the other one.
    let mut preparing = client.subscribe::<RunState>(History::None).await?;
    let asking = connection::ask(client, Command::Run, request, DRY_RUN_PATIENCE);
    tokio::pin!(asking);
    loop {
        tokio::select! {
            reply = &mut asking => return reply,
            Some(state) = preparing.recv() => if state.phase() == RunPhase::Preparing {
                rehearsing.rehearse(so_far(&state));
            },
        }
    }
}

/// How far the service's dry run is.
fn so_far(state: &RunState) -> SoFar {
    let whole_s = state.elapsed_s + state.remaining_s;
    let share = (state.remaining_s >= 0.0 && whole_s > 0.0).then(|| state.elapsed_s / whole_s);
    SoFar { presses: state.presses, share }
}
