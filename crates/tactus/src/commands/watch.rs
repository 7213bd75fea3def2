//! `watch`: shows the live image, the stage and the run in the terminal.

mod screen;

use std::time::Duration;

use anyhow::Context;
use ratatui::crossterm::event::{Event, KeyCode, KeyModifiers, poll, read};
use serde_json::json;
use tactus_bus::{Client, History};
use tactus_schema::pb;
use tokio::sync::mpsc;
use tokio::time::{MissedTickBehavior, interval};

use crate::cli::Common;
use crate::connection::{self, PATIENCE};
use crate::exit::{Exit, in_words};
use screen::Screen;

/// Period of the terminal view; frames in between are counted, not shown.
const REDRAW: Duration = Duration::from_millis(50);

pub(crate) fn watch(common: &Common) -> anyhow::Result<Exit> {
    connection::runtime()?.block_on(async {
        let client = connection::require(common).await?;
        if common.json { stream(&client).await } else { show(&client).await }
    })
}

/// Prints one JSON object per frame until the reader closes the pipe or the service ends.
async fn stream(client: &Client) -> anyhow::Result<Exit> {
    use std::io::Write as _;
    let mut frames = client.subscribe::<pb::Frame>(History::None).await?;
    let mut out = std::io::stdout();
    while let Some(frame) = frames.recv().await {
        let line = json!({
            "seq": frame.seq,
            "t_wall_ns": frame.t_wall_ns,
            "lost_before": frame.lost_before,
            "simulated": frame.simulated,
            "counts": frame.counts,
            "bad_elements": frame.bad_elements,
        });
        // The reader closed the pipe.
        if writeln!(out, "{line}").and_then(|()| out.flush()).is_err() {
            break;
        }
    }
    Ok(Exit::Done)
}

async fn show(client: &Client) -> anyhow::Result<Exit> {
    let mut frames = client.subscribe::<pb::Frame>(History::Last).await?;
    let mut infos = client.subscribe::<pb::SensorInfo>(History::Last).await?;
    let mut stages = client.subscribe::<pb::StageState>(History::Last).await?;
    let mut states = client.subscribe::<pb::RunState>(History::Last).await?;
    let mut safety = client.subscribe::<pb::SafetyEvent>(History::Last).await?;
    let mut health = client.subscribe::<pb::Health>(History::Last).await?;
    let mut alive = client.alive();

    let mut terminal =
        ratatui::try_init().context("no terminal to draw on; `tactus watch --json` works without one")?;
    let mut keys = keys();
    let mut screen = Screen::new(client.rig());
    let mut redraw = interval(REDRAW);
    redraw.set_missed_tick_behavior(MissedTickBehavior::Skip);
    let ended = loop {
        tokio::select! {
            Some(frame) = frames.recv() => screen.on_frame(frame),
            Some(info) = infos.recv() => screen.on_info(&info),
            Some(stage) = stages.recv() => screen.stage = Some(stage),
            Some(state) = states.recv() => screen.run = Some(state),
            Some(event) = safety.recv() => screen.safety = Some(event),
            Some(pulse) = health.recv() => screen.health = Some(pulse),
            there = alive.changed() => screen.alive = there == Some(true),
            Some(key) = keys.recv() => match key {
                KeyAction::Quit => break Ok(()),
                KeyAction::Stop => {
                    let request =
                        pb::CommandRequest { who: "watch".into(), reason: "key S".into(), ..Default::default() };
                    screen.note = match client.stop(&request, PATIENCE).await {
                        Ok(_) => "STOP sent".into(),
                        Err(error) => format!("STOP FAILED: {}", in_words(&error.into())),
                    };
                }
                KeyAction::Tare => screen.tare(),
            },
            _ = redraw.tick() => {
                screen.missed = frames.losses().missed + frames.losses().overrun;
                if let Err(error) = terminal.draw(|frame| screen.draw(frame)) {
                    break Err(error);
                }
            }
        }
    };
    ratatui::restore();
    ended?;
    Ok(Exit::Done)
}

enum KeyAction {
    Quit,
    Stop,
    Tare,
}

/// Reads the keyboard on a separate thread, which ends with the process.
fn keys() -> mpsc::Receiver<KeyAction> {
    // Drops keys if full; a person types slowly.
    let (typed, keys) = mpsc::channel(8);
    std::thread::spawn(move || {
        while !typed.is_closed() {
            if !matches!(poll(Duration::from_millis(200)), Ok(true)) {
                continue;
            }
            let Ok(Event::Key(key)) = read() else { continue };
            let ctrl_c = key.code == KeyCode::Char('c') && key.modifiers.contains(KeyModifiers::CONTROL);
            let meant = if ctrl_c || key.code == KeyCode::Char('q') || key.code == KeyCode::Esc {
                KeyAction::Quit
            } else if key.code == KeyCode::Char('S') {
                KeyAction::Stop
            } else if key.code == KeyCode::Char('t') {
                KeyAction::Tare
            } else {
                continue;
            };
            // Full only if the view hangs.
            drop(typed.try_send(meant));
        }
    });
    keys
}
