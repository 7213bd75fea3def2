//! `status`, `stop`, `pause`, `resume`, `reset`: one request to the service and its answer.

use std::time::Duration;

use serde_json::{Value, json};
use tactus_bus::BusError;
use tactus_schema::key::Command;
use tactus_schema::{pb, with_message};

use crate::cli::{Common, LeaseArgs, ResumeArgs, StopArgs};
use crate::connection::{self, PATIENCE};
use crate::exit::{Exit, Failure};
use crate::output::{duration, print_fields, print_table, say_next};

/// How long to wait for `reset`: homing is slow.
const HOMING_PATIENCE: Duration = Duration::from_mins(2);

/// Of one rig in detail or, if several are served and none is named, of all in a table.
pub(crate) fn status(common: &Common) -> anyhow::Result<Exit> {
    let request = pb::CommandRequest { who: connection::who(), ..Default::default() };
    connection::runtime()?.block_on(async {
        if let Some(client) = connection::require_one_or_all(common).await? {
            let reply = connection::ask(&client, Command::Status, &request, PATIENCE).await?;
            client.close().await?;
            show(common, &reply);
        } else {
            let (endpoint, credentials) = (connection::endpoint(common)?, common.credentials());
            let asked = tactus_bus::ask_all(&endpoint, &credentials, Command::Status, &request, PATIENCE);
            show_all(common, &asked.await?);
        }
        Ok(Exit::Done)
    })
}

fn show_all(common: &Common, answers: &[(String, Result<pb::CommandReply, BusError>)]) {
    if common.json {
        let of_rig = |(rig, reply): &(String, Result<pb::CommandReply, BusError>)| match reply {
            Ok(reply) => to_json(reply),
            Err(error) => json!({ "rig": rig, "problem": problem(error) }),
        };
        println!("{}", json!({ "rigs": answers.iter().map(of_rig).collect::<Vec<_>>() }));
        return;
    }
    let rows: Vec<_> = answers.iter().map(|(rig, reply)| row(rig, reply)).collect();
    print_table(&["RIG", "STATE", "FRAMES", "LOST", "LEASE", "WHAT"], &rows);
    say_next("`tactus status --rig NAME` shows one in detail");
}

/// Why a rig has no state to show.
fn problem(error: &BusError) -> String {
    if matches!(error, BusError::NoAnswer { .. }) {
        "it does not answer".to_owned()
    } else {
        error.to_string()
    }
}

/// A rig in a line: its state, and what a person should know first.
fn row(rig: &str, reply: &Result<pb::CommandReply, BusError>) -> Vec<String> {
    let reply = match reply {
        Ok(reply) => reply.clone(),
        Err(error) => pb::CommandReply {
            health: Some(pb::Health { problem: problem(error), ..Default::default() }),
            ..Default::default()
        },
    };
    let lease = holder(&reply).map_or_else(|| "-".to_owned(), |lease| lease.holder.clone());
    let (state, health) = (reply.state.unwrap_or_default(), reply.health.unwrap_or_default());
    let (word, what) = if !health.problem.is_empty() {
        ("OFF", health.problem)
    } else if !state.fault.is_empty() {
        ("fault", state.fault)
    } else if state.run_id.is_empty() {
        ("idle", String::new())
    } else {
        let presses = format!("{}/{} presses", state.presses, state.presses_planned);
        (state.phase().word(), format!("{}, {presses}", with_message(&state.run_id, &state.message)))
    };
    // One line, whatever the text has.
    let what = what.split_whitespace().collect::<Vec<_>>().join(" ");
    vec![
        rig.to_owned(),
        word.to_owned(),
        health.frames.to_string(),
        health.frames_lost.to_string(),
        lease,
        what,
    ]
}

/// Needs no lease, no rig's name, and no service that is ready.
pub(crate) fn stop(common: &Common, args: &StopArgs) -> anyhow::Result<Exit> {
    let endpoint = connection::endpoint(common)?;
    let request = pb::CommandRequest {
        who: connection::who(),
        reason: args.reason.clone(),
        abort: args.abort,
        ..Default::default()
    };
    let runtime = connection::runtime()?;
    let rig = common.rig.as_deref();
    let answers =
        runtime.block_on(tactus_bus::stop(&endpoint, rig, &request, &common.credentials(), PATIENCE));
    // A connection that is still being made keeps nobody waiting.
    runtime.shutdown_background();
    let answers = answers?;
    if let Some(refusal) = answers.iter().find(|reply| !reply.ok) {
        return Err(Failure::new(Exit::of_reply(refusal.exit_code), &refusal.error).into());
    }
    for reply in &answers {
        show(common, reply);
    }
    Ok(Exit::Done)
}

pub(crate) fn pause(common: &Common, args: &LeaseArgs) -> anyhow::Result<Exit> {
    command(common, Command::Pause, args, None)
}

pub(crate) fn resume(common: &Common, args: &ResumeArgs) -> anyhow::Result<Exit> {
    command(common, Command::Resume, &args.lease, args.covering_mm)
}

pub(crate) fn reset(common: &Common, args: &LeaseArgs) -> anyhow::Result<Exit> {
    command(common, Command::Reset, args, None)
}

/// Sends a command that needs the lease.
fn command(
    common: &Common,
    command: Command,
    args: &LeaseArgs,
    covering_mm: Option<f64>,
) -> anyhow::Result<Exit> {
    let reply = connection::runtime()?.block_on(async {
        let client = connection::require(common).await?;
        let held = connection::hold(&client, args).await?;
        let request = pb::CommandRequest {
            who: connection::who(),
            reason: args.take_over.clone().unwrap_or_default(),
            lease: held.secret(),
            covering_mm,
            ..Default::default()
        };
        let reply = connection::ask(&client, command, &request, patience(command)).await;
        connection::release(held).await;
        client.close().await?;
        reply
    })?;
    show(common, &reply);
    Ok(Exit::Done)
}

fn show(common: &Common, reply: &pb::CommandReply) {
    if common.json {
        println!("{}", to_json(reply));
    } else {
        print(reply);
    }
}

fn patience(command: Command) -> Duration {
    if command == Command::Reset { HOMING_PATIENCE } else { PATIENCE }
}

/// The answer in the form of `--json`.
fn to_json(reply: &pb::CommandReply) -> Value {
    let state = reply.state.clone().unwrap_or_default();
    let stage = reply.stage.unwrap_or_default();
    let health = reply.health.clone().unwrap_or_default();
    json!({
        "rig": reply.rig,
        "version": reply.version,
        "simulated": health.simulated,
        "problem": (!health.problem.is_empty()).then_some(&health.problem),
        "lease": holder(reply).map(|lease| json!({ "holder": lease.holder, "expires_in_s": lease.expires_in_s })),
        "fault": (!state.fault.is_empty()).then_some(&state.fault),
        "safety": {
            "depth_max_mm": reply.depth_max_mm,
            "covering_mm": reply.covering_mm,
            "last": reply.safety.as_ref().map(|event| json!({
                "verdict": event.verdict().word(),
                "rule": event.rule,
                "detail": event.detail,
                "t_wall_ns": event.t_wall_ns,
            })),
        },
        "run": {
            "run_id": state.run_id,
            "experiment": state.experiment,
            "phase": state.phase().word(),
            "exit_status": state.exit_status().word(),
            "presses": state.presses,
            "presses_planned": state.presses_planned,
            "dwells": state.dwells,
            "dwells_planned": state.dwells_planned,
            "frames": state.frames,
            "frames_lost": state.frames_lost,
            "elapsed_s": state.elapsed_s,
            "remaining_s": (state.remaining_s >= 0.0).then_some(state.remaining_s),
            "message": state.message,
            "recording": state.recording,
        },
        "stage": {
            "status": stage.status().word(),
            "x_mm": stage.x_mm,
            "y_mm": stage.y_mm,
            "z_mm": stage.z_mm,
            "alarm": stage.alarm,
        },
        "sensor": {
            "connected": health.sensor_connected,
            "frames": health.frames,
            "frames_lost": health.frames_lost,
            "frames_dropped_on_bus": health.frames_dropped_on_bus,
            "clock_offset_s": health.clock_offset_s,
            "clock_uncertainty_s": health.clock_uncertainty_s,
        },
        "uptime_s": health.uptime_s,
    })
}

fn print(reply: &pb::CommandReply) {
    let state = reply.state.clone().unwrap_or_default();
    let stage = reply.stage.unwrap_or_default();
    let health = reply.health.clone().unwrap_or_default();
    let simulated = if health.simulated { " (SIMULATED)" } else { "" };
    let run = match state.phase() {
        pb::RunPhase::Idle | pb::RunPhase::Unspecified => "none since the service started".into(),
        pb::RunPhase::Finished => {
            format!("{}: {}", state.run_id, with_message(state.exit_status().word(), &state.message))
        }
        phase @ (pb::RunPhase::Preparing
        | pb::RunPhase::Running
        | pb::RunPhase::Paused
        | pb::RunPhase::Stopping) => format!(
            "{}: {}; {}/{} presses, {} frames, {} lost, {} left",
            state.run_id,
            with_message(phase.word(), &state.message),
            state.presses,
            state.presses_planned,
            state.frames,
            state.frames_lost,
            duration(state.remaining_s.max(0.0)),
        ),
    };
    let sensor = if health.sensor_connected { "connected" } else { "LOST" };
    let clock = match (health.clock_offset_s, health.clock_uncertainty_s) {
        (Some(offset_s), Some(uncertainty_s)) => {
            format!("device clock {offset_s:+.3} s, known to {:.1} ms", uncertainty_s * 1e3)
        }
        _ => "no estimate of the device clock".into(),
    };
    let mut fields = vec![("rig", format!("{}{simulated}", reply.rig))];
    if !health.problem.is_empty() {
        fields.push(("problem", health.problem.clone()));
    }
    if !state.fault.is_empty() {
        fields.push(("fault", fault_words(&state.fault)));
    }
    fields.extend([
        ("run", run),
        (
            "stage",
            format!(
                "{} at x {:.3}, y {:.3}, z {:.3} mm",
                stage.status().word(),
                stage.x_mm,
                stage.y_mm,
                stage.z_mm
            ),
        ),
        ("safety", safety_words(reply)),
        ("sensor", format!("{sensor}, {} frames, {} lost; {clock}", health.frames, health.frames_lost)),
        ("lease", holder(reply).map_or_else(|| "nobody's".to_owned(), |lease| lease.holder.clone())),
        ("service", format!("version {}, up {}", reply.version, duration(health.uptime_s))),
    ]);
    if !reply.note.is_empty() {
        fields.push(("note", reply.note.clone()));
    }
    print_fields(&fields);
    if let Some(next) = next_command(&state, holder(reply).is_some()) {
        say_next(&next);
    }
}

/// What a person is likely to do in this state of the service; a fault says it itself. While somebody else holds the lease, who pauses or
/// resumes takes it over.
fn next_command(state: &pb::RunState, is_held: bool) -> Option<String> {
    if !state.fault.is_empty() {
        return None;
    }
    let take_over = if is_held { " --take-over REASON" } else { "" };
    match state.phase() {
        pb::RunPhase::Finished if state.exit_status() == pb::ExitStatus::Stopped => {
            Some(format!("`tactus run --continue {}` goes on with it", state.run_id))
        }
        pb::RunPhase::Idle | pb::RunPhase::Unspecified | pb::RunPhase::Finished => {
            Some("`tactus run EXPERIMENT` runs one of `tactus experiments`".to_owned())
        }
        pb::RunPhase::Paused => {
            Some(format!("`tactus resume{take_over}` continues, `tactus stop` ends the run"))
        }
        pb::RunPhase::Preparing | pb::RunPhase::Running => Some(format!(
            "`tactus watch` shows it live, `tactus pause{take_over}` holds it, `tactus stop` ends it"
        )),
        pb::RunPhase::Stopping => None,
    }
}

/// The limit of depth, and what the safety supervisor did last.
fn safety_words(reply: &pb::CommandReply) -> String {
    let limit =
        format!("depth limit {:.3} mm under the {} mm covering", reply.depth_max_mm, reply.covering_mm);
    let health = reply.health.as_ref().map_or(0, |health| health.t_mono_ns);
    match &reply.safety {
        Some(event) => {
            let ago = duration(health.saturating_sub(event.t_mono_ns).max(0) as f64 * 1e-9);
            format!(
                "{limit}; last event {ago} ago: {}, {}: {}",
                event.verdict().word(),
                event.rule,
                event.detail
            )
        }
        None => format!("{limit}; no stop and no refusal since the service started"),
    }
}

/// The lease, if somebody holds it.
fn holder(reply: &pb::CommandReply) -> Option<&pb::Lease> {
    reply.lease.as_ref().filter(|lease| !lease.holder.is_empty())
}

/// A fault and how to clear it.
pub(crate) fn fault_words(fault: &str) -> String {
    format!("{fault}: make sure that the tip is free to move, then run `tactus reset`")
}

#[cfg(test)]
#[path = "control_tests.rs"]
mod tests;
