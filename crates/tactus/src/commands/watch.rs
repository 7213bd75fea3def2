//! `watch`: shows the live image, the stage and the run in the terminal.

mod image;
mod place;
mod screen;
mod traces;

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use anyhow::Context;
use ratatui::crossterm::event::{Event, KeyCode, KeyEvent, KeyModifiers, poll, read};
use serde_json::json;
use tactus_bus::{Client, History, Subscription};
use tactus_live::Weight;
use tactus_schema::key::Command;
use tactus_schema::pb::{self, run_event};
use tokio::sync::mpsc;
use tokio::time::{MissedTickBehavior, interval};

use crate::cli::Common;
use crate::connection::{self, PATIENCE};
use crate::exit::{Exit, in_words};
use screen::{Key, Screen};

/// Period of the terminal view; frames in between are kept, not shown.
const REDRAW: Duration = Duration::from_millis(50);

/// This view's name for the service.
const WHO: &str = "watch";

pub(crate) fn watch(common: &Common) -> anyhow::Result<Exit> {
    connection::runtime()?.block_on(async {
        let client = connection::require(common).await?;
        if common.json { stream(&client).await } else { Box::pin(show(&client)).await }
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
            "temperature_c": frame.temperature_c,
        });
        // The reader closed the pipe.
        if writeln!(out, "{line}").and_then(|()| out.flush()).is_err() {
            break;
        }
    }
    Ok(Exit::Done)
}

/// What the view hears.
struct Heard {
    frames: Subscription<pb::Frame>,
    infos: Subscription<pb::SensorInfo>,
    stages: Subscription<pb::StageState>,
    states: Subscription<pb::RunState>,
    events: Subscription<pb::RunEvent>,
    safety: Subscription<pb::SafetyEvent>,
    health: Subscription<pb::Health>,
}

async fn show(client: &Client) -> anyhow::Result<Exit> {
    let mut heard = Heard {
        frames: client.subscribe(History::All).await?,
        infos: client.subscribe(History::Last).await?,
        stages: client.subscribe(History::Last).await?,
        states: client.subscribe(History::Last).await?,
        events: client.subscribe(History::All).await?,
        safety: client.subscribe(History::Last).await?,
        health: client.subscribe(History::Last).await?,
    };
    let mut terminal =
        ratatui::try_init().context("no terminal to draw on; `tactus watch --json` works without one")?;
    let mut screen = Screen::new(client.rig());
    let ended = follow(client, &mut heard, &mut screen, &mut terminal).await;
    ratatui::restore();
    ended?;
    Ok(Exit::Done)
}

/// Draws what is heard until somebody quits.
async fn follow(
    client: &Client,
    heard: &mut Heard,
    screen: &mut Screen,
    terminal: &mut ratatui::DefaultTerminal,
) -> anyhow::Result<()> {
    let mut alive = client.alive();
    let mut keys = keys();
    let mut redraw = interval(REDRAW);
    redraw.set_missed_tick_behavior(MissedTickBehavior::Skip);
    let mut is_asking = true;
    let description = describe(client);
    tokio::pin!(description);
    loop {
        tokio::select! {
            // Frames last: what was told of them before is known then. Whatever else comes is rare.
            biased;
            Some(key) = keys.recv() => match key {
                Typed::Quit => return Ok(()),
                Typed::Stop => stop(client, screen).await,
                Typed::Key(key) => screen.on_key(key),
            },
            _ = redraw.tick() => {
                let losses = heard.frames.losses();
                screen.missed = losses.missed + losses.overrun;
                // The terminal's size is asked for each time.
                terminal.draw(|frame| screen.draw(frame))?;
            }
            there = alive.changed() => screen.alive = there == Some(true),
            Some(info) = heard.infos.recv() => screen.on_info(&info),
            Some(stage) = heard.stages.recv() => screen.stage = Some(stage),
            Some(state) = heard.states.recv() => screen.run = Some(state),
            Some(event) = heard.safety.recv() => screen.log.on_safety(&event),
            Some(pulse) = heard.health.recv() => screen.health = Some(pulse),
            Some(event) = heard.events.recv() => {
                if matches!(event.event, Some(run_event::Event::CoveringChanged(_))) {
                    description.set(describe(client));
                    is_asking = true;
                }
                screen.on_event(&event);
            }
            described = &mut description, if is_asking => {
                is_asking = false;
                match described {
                    Ok(described) => screen.on_description(described),
                    Err(error) => screen.note = format!("the service does not describe its rig: {}", in_words(&error)),
                }
            }
            Some(frame) = heard.frames.recv() => screen.on_frame(frame),
        }
    }
}

/// The rig as it is now.
async fn describe(client: &Client) -> anyhow::Result<pb::RigDescription> {
    let request = pb::CommandRequest { who: WHO.into(), ..Default::default() };
    let reply = connection::ask(client, Command::Status, &request, PATIENCE).await?;
    reply.description.context("it is of an older version")
}

async fn stop(client: &Client, screen: &mut Screen) {
    let request = pb::CommandRequest { who: WHO.into(), reason: "key S".into(), ..Default::default() };
    match client.stop(&request, PATIENCE).await {
        Ok(_) => screen.note = "STOP sent".into(),
        Err(error) => {
            screen.note = format!("STOP FAILED: {}", in_words(&error.into()));
            screen.log.note(now_wall_ns(), "view", Weight::Stop, &screen.note);
        }
    }
}

fn now_wall_ns() -> i64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    i64::try_from(since.as_nanos()).unwrap_or(i64::MAX)
}

enum Typed {
    Quit,
    Stop,
    Key(Key),
}

/// Reads the keyboard on a separate thread, which ends with the process.
fn keys() -> mpsc::Receiver<Typed> {
    // Drops keys if full; a person types slowly.
    let (typed, keys) = mpsc::channel(8);
    std::thread::spawn(move || {
        while !typed.is_closed() {
            if !matches!(poll(Duration::from_millis(200)), Ok(true)) {
                continue;
            }
            let Ok(Event::Key(key)) = read() else { continue };
            let Some(meant) = meant(key) else { continue };
            // Full only if the view hangs.
            drop(typed.try_send(meant));
        }
    });
    keys
}

#[expect(clippy::wildcard_enum_match_arm, reason = "other keys mean nothing")]
fn meant(key: KeyEvent) -> Option<Typed> {
    if key.code == KeyCode::Char('c') && key.modifiers.contains(KeyModifiers::CONTROL) {
        return Some(Typed::Quit);
    }
    Some(match key.code {
        KeyCode::Char('q') | KeyCode::Esc => Typed::Quit,
        KeyCode::Char('S') => Typed::Stop,
        KeyCode::Char('t') => Typed::Key(Key::Zero),
        KeyCode::Left => Typed::Key(Key::Move([-1, 0])),
        KeyCode::Right => Typed::Key(Key::Move([1, 0])),
        KeyCode::Up => Typed::Key(Key::Move([0, 1])),
        KeyCode::Down => Typed::Key(Key::Move([0, -1])),
        KeyCode::Char(' ') | KeyCode::Enter => Typed::Key(Key::Choose),
        KeyCode::Char('a') => Typed::Key(Key::Automatic),
        KeyCode::Char('+') => Typed::Key(Key::Longer),
        KeyCode::Char('-') => Typed::Key(Key::Shorter),
        KeyCode::PageUp => Typed::Key(Key::Earlier),
        KeyCode::PageDown => Typed::Key(Key::Later),
        _ => return None,
    })
}
