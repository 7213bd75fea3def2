//! `collect`: records all rigs that an endpoint reaches, each into files of its own.
//!
//! | task | does | waits for |
//! |---|---|---|
//! | main | finds rigs by their services' liveliness | rigs that come and go, a signal, a second |
//! | keeper, of each rig | hears it, and asks again for what is missing | its messages, answers, room in the queue |
//! | archive (a thread) | writes all files | the queue, the disk |
//!
//! A disk that is slow delays the keepers, whose subscriptions then fill up. What does not fit there is a gap like any other: it is
//! asked for again, and counted if it is no longer kept.

mod archive;
mod keeper;

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use anyhow::Context;
use serde_json::json;
use tactus_bus::{BusError, Lab};
use tactus_runner::open_files;
use tactus_runner::signals::EndingSignals;
use tokio::sync::watch;
use tokio::task::{JoinError, JoinSet};
use tokio::time::{MissedTickBehavior, interval, sleep};

use crate::cli::{CollectArgs, Common};
use crate::connection;
use crate::exit::{Exit, Failure};
use crate::output::{print_table, say, say_next};
use archive::{Archive, Collected, Limits};
use keeper::Keeper;

/// Period at which files are looked at: whether one is complete, or has messages in memory for too long.
const TICK: Duration = Duration::from_secs(1);

/// What is wrong with a rig, by its name.
type Problems = BTreeMap<String, String>;

pub(crate) fn collect(common: &Common, args: &CollectArgs) -> anyhow::Result<Exit> {
    let limits = Limits::checked(args.roll_min, args.roll_mib)?;
    if let Some(seconds) = args.seconds.filter(|seconds| !(seconds.is_finite() && *seconds > 0.0)) {
        return Err(Failure::new(Exit::Usage, format!("--seconds must be positive, not {seconds}")).into());
    }
    let named: BTreeSet<String> = args.rigs.iter().chain(&common.rig).cloned().collect();
    open_files::allow_all();
    let runtime = connection::runtime()?;
    let (collected, problems) = runtime.block_on(async {
        // Before a file is begun, so that no signal leaves it without its end.
        let mut signals = EndingSignals::listen().context("no signals")?;
        let lab = Lab::connect(&connection::endpoint(common)?, &common.credentials()).await?;
        let archive = Archive::start(&args.out, limits, connection::who())?;
        let (to_end, ending) = watch::channel(false);
        let (keepers, there, known) = (JoinSet::new(), BTreeSet::new(), BTreeMap::new());
        let mut collection = Collection { lab, archive, ending, keepers, there, known };
        let ended = async {
            match args.seconds {
                Some(seconds) => sleep(Duration::from_secs_f64(seconds)).await,
                None => std::future::pending().await,
            }
        };
        tokio::select! {
            ending = signals.next() => eprintln!("{}: closing the files", ending.name),
            () = ended => {}
            () = collection.run(&named) => {}
        }
        to_end.send_replace(true);
        collection.finish(&named).await
    })?;
    Ok(report(common, args, &collected, &problems))
}

/// How a keeper ended.
type Kept = Result<Result<(), BusError>, JoinError>;

/// The rigs that are being recorded.
struct Collection {
    lab: Lab,
    archive: Archive,
    ending: watch::Receiver<bool>,
    keepers: JoinSet<(String, Kept)>,
    /// Rigs that are there now.
    there: BTreeSet<String>,
    /// What is wrong with each rig that was found, if anything is.
    known: BTreeMap<String, Option<String>>,
}

impl Collection {
    /// Records each rig that comes, until the connection is closed or nothing can be written.
    async fn run(&mut self, named: &BTreeSet<String>) {
        let mut tick = interval(TICK);
        tick.set_missed_tick_behavior(MissedTickBehavior::Skip);
        self.look(named).await;
        loop {
            tokio::select! {
                _ = tick.tick() => if self.archive.tick().is_err() {
                    return;
                },
                changed = self.lab.changed() => match changed {
                    Some(()) => self.look(named).await,
                    None => return,
                },
                Some(Ok((rig, kept))) = self.keepers.join_next() => self.note(rig, kept),
            }
        }
    }

    /// Begins with the rigs that are new; says which come and go, and which names more than one service has.
    async fn look(&mut self, named: &BTreeSet<String>) {
        let is_wanted = |rig: &String| named.is_empty() || named.contains(rig);
        let there: BTreeSet<_> = self.lab.rigs().into_iter().filter(is_wanted).collect();
        for gone in self.there.difference(&there) {
            eprintln!("{gone}: gone");
        }
        for come in there.difference(&self.there) {
            eprintln!("{come}: {}", if self.archive.has(come) { "there again" } else { "found" });
        }
        for rig in &there {
            let (client, problem) = match self.lab.client(rig).await {
                Ok(client) => (Some(client), None),
                Err(error) => (None, Some(error.to_string())),
            };
            // A rig that has had no keeper so far, because nobody could be believed, gets one now.
            if let Some(client) = client.filter(|_| !self.archive.has(rig)) {
                let keeper = Keeper::new(client, self.archive.add(rig), self.ending.clone());
                let name = rig.clone();
                self.keepers.spawn(async move { (name, tokio::spawn(keeper.keep()).await) });
            }
            let before = self.known.insert(rig.clone(), problem.clone()).flatten();
            if let Some(problem) = problem.filter(|problem| before.as_ref() != Some(problem)) {
                eprintln!("{rig}: {problem}");
            }
        }
        self.there = there;
    }

    fn note(&mut self, rig: String, kept: Kept) {
        let problem = match kept {
            Ok(Ok(())) => return,
            Ok(Err(error)) => error.to_string(),
            Err(panic) => format!("it is no longer recorded: {panic}; this is a defect of Tactus"),
        };
        eprintln!("{rig}: {problem}");
        self.known.insert(rig, Some(problem));
    }

    /// Closes all files.
    async fn finish(mut self, named: &BTreeSet<String>) -> anyhow::Result<(Collected, Problems)> {
        while let Some(Ok((rig, kept))) = self.keepers.join_next().await {
            self.note(rig, kept);
        }
        let Self { lab, archive, known, .. } = self;
        let missing = named.iter().filter(|rig| !archive.has(rig) && !known.contains_key(*rig));
        let mut problems: Problems = missing.map(|rig| (rig.clone(), "it was not found".into())).collect();
        let collected = archive.finish().await?;
        problems.extend(known.into_iter().filter_map(|(rig, problem)| Some((rig, problem?))));
        if let Err(error) = lab.close().await {
            tracing::debug!(%error, "the connection did not close cleanly");
        }
        Ok((collected, problems))
    }
}

/// Prints what was recorded and what was lost.
fn report(common: &Common, args: &CollectArgs, collected: &Collected, problems: &Problems) -> Exit {
    let is_lossy = collected.values().any(archive::Totals::is_lossy) || !problems.is_empty();
    let exit = if is_lossy { Exit::Degraded } else { Exit::Done };
    let rigs: BTreeSet<_> = collected.keys().chain(problems.keys()).collect();
    if common.json {
        let rigs: Vec<_> = rigs
            .into_iter()
            .map(|rig| {
                let totals = collected.get(rig).cloned().unwrap_or_default();
                json!({
                    "rig": rig,
                    "files": totals.files,
                    "bytes": totals.bytes,
                    "frames": totals.frames,
                    "frames_lost": totals.frames_lost,
                    "frames_lost_at_device": totals.frames_lost_at_device,
                    "messages_lost": totals.messages_lost,
                    "messages_asked_again": totals.messages_asked_again,
                    "messages_foreign": totals.messages_foreign,
                    "restarts": totals.restarts,
                    "problem": problems.get(rig),
                })
            })
            .collect();
        say(&json!({ "folder": args.out, "rigs": rigs, "exit_code": exit as u8 }).to_string());
        return exit;
    }
    let rows: Vec<_> = rigs
        .into_iter()
        .map(|rig| {
            let totals = collected.get(rig).cloned().unwrap_or_default();
            vec![
                rig.clone(),
                totals.files.to_string(),
                totals.frames.to_string(),
                totals.frames_lost.to_string(),
                totals.messages_lost.to_string(),
                problems.get(rig).cloned().unwrap_or_else(|| totals.warning()),
            ]
        })
        .collect();
    print_table(&["RIG", "FILES", "FRAMES", "LOST", "OTHERS LOST", "WHAT"], &rows);
    say_next(&format!("`tactus record info {}/*/*.mcap`", args.out.display()));
    exit
}
