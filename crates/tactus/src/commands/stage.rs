//! `stage check`: checks that a stage answers, matches the rig file and moves as it reports.

use std::io::{IsTerminal, Write as _};
use std::path::{Path, PathBuf};

use anyhow::Context;
use serde_json::{Value, json};
use tactus_bus::BusError;
use tactus_runner::config;
use tactus_runner::embedded::SIMULATED_RIG;
use tactus_runner::stage_check::{self, CheckedMove, STEP_MM, StageCheck};
use tactus_schema::key::Command;
use tactus_schema::rig::{StageLink, Transport};
use tactus_schema::{Rig, pb};

use crate::cli::{Common, StageCheckArgs};
use crate::connection::{self, PATIENCE};
use crate::exit::{Exit, Failure};
use crate::output::{print_fields, print_table, say};

pub(crate) fn check(common: &Common, args: &StageCheckArgs) -> anyhow::Result<Exit> {
    let rig = match rig_file(common, args)? {
        Some(path) => config::load_rig(&path).map_err(|error| Failure::new(Exit::Usage, error))?.rig,
        None => Rig::from_toml(SIMULATED_RIG)?,
    };
    let stage = rig.service.as_ref().map(|service| service.stage.clone());
    if let Some(stage) = stage.as_ref().filter(|stage| stage.transport != Transport::Embedded) {
        check_free(common, &rig, stage)?;
        confirm(&rig, stage, args)?;
    }
    let checked =
        stage_check::run(&rig, args.home, |_| {}).map_err(|error| Failure::new(Exit::Usage, error))?;
    let link = stage.as_ref().map(in_words).unwrap_or_default();
    if common.json {
        say(&to_json(&rig, &link, &checked).to_string());
    } else {
        print(&rig, &link, &checked);
    }
    Ok(if checked.is_good() { Exit::Done } else { Exit::Failed })
}

/// The file given by `--rig-file`, or by `--rig` if that is a path.
fn rig_file(common: &Common, args: &StageCheckArgs) -> anyhow::Result<Option<PathBuf>> {
    let Some(rig) = args.rig_file.is_none().then_some(common.rig.as_deref()).flatten() else {
        return Ok(args.rig_file.clone());
    };
    // A rig's name has no dot and no slash.
    if rig.contains(['.', '/']) {
        return Ok(Some(Path::new(rig).to_owned()));
    }
    let what =
        format!("--rig {rig}: the check opens the stage itself and needs the rig's file: --rig RIG.toml");
    Err(Failure::new(Exit::Usage, what).into())
}

/// Fails if a running service holds the stage.
fn check_free(common: &Common, rig: &Rig, stage: &StageLink) -> anyhow::Result<()> {
    if !connection::runtime()?.block_on(is_held(common, rig, stage))? {
        return Ok(());
    }
    let what = format!(
        "stage ({}): busy: the service of rig {:?} at {} holds it; stop the service first (`systemctl stop tactusd`), or \
         ask it with `tactus status`",
        in_words(stage),
        rig.name,
        common.endpoint
    );
    Err(Failure::new(Exit::Failed, what).into())
}

/// True if the rig's own service runs at the endpoint, unless it says that its stage is at another place. That of another rig is
/// no obstacle: if it holds the port nevertheless, opening the port fails.
async fn is_held(common: &Common, rig: &Rig, stage: &StageLink) -> anyhow::Result<bool> {
    let endpoint = connection::endpoint(common)?;
    match tactus_bus::rigs_at(&endpoint, &common.credentials()).await {
        Ok(served) if served.contains(&rig.name) => {}
        Ok(_) | Err(BusError::NoService { .. }) => return Ok(false),
        Err(error) => return Err(error.into()),
    }
    let of_the_rig = Common { rig: Some(rig.name.clone()), ..common.clone() };
    let Some(client) = connection::look(&of_the_rig).await? else { return Ok(false) };
    let request = pb::CommandRequest { who: connection::who(), ..Default::default() };
    let told = connection::ask(&client, Command::Status, &request, PATIENCE).await;
    client.close().await?;
    let theirs = told.ok().and_then(|told| Rig::from_toml(&told.rig_toml).ok()?.service);
    Ok(theirs.is_none_or(|theirs| theirs.stage.transport == stage.transport))
}

/// Asks before any hardware moves, unless `--yes` was given.
fn confirm(rig: &Rig, stage: &StageLink, args: &StageCheckArgs) -> anyhow::Result<()> {
    if args.yes {
        return Ok(());
    }
    let homes = if args.home { "homes the stage to its limit switches, then " } else { "" };
    let what = format!(
        "this {homes}moves each axis of the stage of rig {:?} ({}) by {} um and back; a tip \
         below the safe height is raised first",
        rig.name,
        in_words(stage),
        STEP_MM * 1000.0
    );
    if !std::io::stdin().is_terminal() {
        return Err(Failure::new(Exit::Failed, format!("nothing was moved: {what}; add --yes")).into());
    }
    // On standard error, because standard output may carry JSON.
    let mut out = std::io::stderr().lock();
    write!(out, "{what}.\nIs the way clear? [y/N] ").and_then(|()| out.flush())?;
    let mut answer = String::new();
    std::io::stdin().read_line(&mut answer).context("no answer")?;
    if matches!(answer.trim(), "y" | "Y" | "yes") {
        return Ok(());
    }
    Err(Failure::new(Exit::Failed, "nothing was moved").into())
}

fn in_words(stage: &StageLink) -> String {
    let place = match &stage.transport {
        Transport::Embedded => "embedded, virtual".to_owned(),
        Transport::Serial { port, baud } => format!("{port}, {baud} baud"),
        link @ (Transport::Usb(_) | Transport::Hid(_) | Transport::Tcp { .. }) => link.to_string(),
    };
    format!("{} on {place}", stage.protocol.name())
}

fn print(rig: &Rig, link: &str, checked: &StageCheck) {
    let simulated = if rig.simulated { " (SIMULATED)" } else { "" };
    let mut fields = vec![("rig", format!("{}{simulated}", rig.name)), ("stage", link.to_owned())];
    if let Some(controller) = &checked.controller {
        let [x, y, z] = checked.position_mm;
        let known = if checked.is_homed { "" } else { ", not homed: unreliable" };
        fields.push(("controller", controller.identity.clone()));
        fields.push(("position", format!("{x:.3}, {y:.3}, {z:.3} mm{known}")));
        print_fields(&fields);
        let settings = controller.settings.iter();
        let rows: Vec<_> =
            settings.map(|one| vec![one.name.clone(), one.value.clone(), one.meaning.clone()]).collect();
        say("");
        print_table(&["setting", "value", "meaning"], &rows);
    } else {
        print_fields(&fields);
    }
    if !checked.moves.is_empty() {
        say("");
        let header = ["axis", "asked mm", "reported mm", "error um", "took ms", "verdict"];
        print_table(&header, &checked.moves.iter().map(row).collect::<Vec<_>>());
    }
    say("");
    match (&checked.trouble, checked.is_good()) {
        (Some(trouble), _) => say(&format!("not good: {trouble}")),
        (None, true) => say("good: the stage matches the rig file and moves as it reports"),
        (None, false) => say("not good: see the verdicts"),
    }
}

fn row(one: &CheckedMove) -> Vec<String> {
    let or_none = |value: Option<String>| value.unwrap_or_else(|| "-".to_owned());
    vec![
        one.axis.to_owned(),
        format!("{:.3}", one.asked_mm),
        or_none(one.reported_mm.map(|mm| format!("{mm:.3}"))),
        or_none(one.error_mm.map(|mm| format!("{:.1}", mm * 1000.0))),
        one.took.as_millis().to_string(),
        one.trouble.clone().unwrap_or_else(|| "ok".to_owned()),
    ]
}

fn to_json(rig: &Rig, link: &str, checked: &StageCheck) -> Value {
    let controller = checked.controller.as_ref().map(|controller| {
        let settings = controller.settings.iter();
        let settings: Vec<_> =
            settings.map(|one| json!({ "name": one.name, "value": one.value, "is": one.meaning })).collect();
        json!({ "identity": controller.identity, "settings": settings })
    });
    let moves = checked.moves.iter().map(|one| {
        json!({
            "axis": one.axis,
            "asked_mm": one.asked_mm,
            "reported_mm": one.reported_mm,
            "error_mm": one.error_mm,
            "took_ms": one.took.as_secs_f64() * 1000.0,
            "ok": one.trouble.is_none(),
            "trouble": one.trouble,
        })
    });
    json!({
        "rig": rig.name,
        "simulated": rig.simulated,
        "stage": link,
        "controller": controller,
        "position_mm": checked.position_mm,
        "homed": checked.is_homed,
        "moves": moves.collect::<Vec<_>>(),
        "ok": checked.is_good(),
        "trouble": checked.trouble,
    })
}
