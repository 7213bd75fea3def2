//! Completions for shells, which ask this program at each key: experiments, rigs and runs are those that are there now.

use std::ffi::OsStr;
use std::path::Path;

use clap_complete::engine::{CompletionCandidate, PathCompleter, ValueCompleter as _};
use clap_complete::env::Shells;
use tactus_bus::{BusError, Client, Credentials, Endpoint};
use tactus_plan::Script;
use tactus_runner::experiments as known;

use crate::commands::devices;
use crate::connection;
use crate::exit::{Exit, Failure};
use crate::output;

/// The variable by which a shell asks.
const VARIABLE: &str = "COMPLETE";

/// Prints what a shell's start file has to read.
pub(crate) fn register(shell: &str) -> anyhow::Result<Exit> {
    let shells = Shells::builtins();
    let Some(shell) = shells.completer(shell) else {
        let names: Vec<_> = shells.names().collect();
        let problem = format!("no completions for {shell:?}; there are some for {}", names.join(", "));
        return Err(Failure::new(Exit::Usage, problem).into());
    };
    let mut script = Vec::new();
    shell.write_registration(VARIABLE, "tactus", "tactus", "tactus", &mut script)?;
    output::write(&String::from_utf8(script)?)?;
    Ok(Exit::Done)
}

/// Names of experiments with what they do, and scripts.
pub(crate) fn experiments(typed: &OsStr) -> Vec<CompletionCandidate> {
    let named = known::BUILT_IN.iter().map(|(name, source)| {
        let summary = Script::parse(name, source).map(|script| script.summary().to_owned()).ok();
        CompletionCandidate::new(*name).help(summary.map(Into::into))
    });
    starting(named, typed).chain(files(typed, "star")).collect()
}

/// Rigs that the service at hand reaches, by name, and rig files.
pub(crate) fn rigs(typed: &OsStr) -> Vec<CompletionCandidate> {
    let served = served().into_iter().map(|name| CompletionCandidate::new(name).help(Some("served".into())));
    starting(served, typed).chain(rig_files(typed)).collect()
}

/// Rig files: those where `tactus devices` looks, and any other.
pub(crate) fn rig_files(typed: &OsStr) -> Vec<CompletionCandidate> {
    let known = devices::rig_files().into_iter().map(CompletionCandidate::new);
    let mut found: Vec<_> = starting(known, typed).chain(files(typed, "toml")).collect();
    found.sort_by(|one, other| one.get_value().cmp(other.get_value()));
    found.dedup_by(|one, other| one.get_value() == other.get_value());
    found
}

/// Ids of the runs in the usual folder.
pub(crate) fn run_ids(typed: &OsStr) -> Vec<CompletionCandidate> {
    let ids = tactus_runs::ids(Path::new("runs")).into_iter().map(CompletionCandidate::new);
    starting(ids, typed).collect()
}

fn starting(
    candidates: impl Iterator<Item = CompletionCandidate>,
    typed: &OsStr,
) -> impl Iterator<Item = CompletionCandidate> {
    let typed = typed.to_string_lossy().into_owned();
    candidates.filter(move |one| one.get_value().to_string_lossy().starts_with(&typed))
}

/// Folders, and files whose name ends so.
fn files(typed: &OsStr, ending: &'static str) -> Vec<CompletionCandidate> {
    let fits = move |path: &Path| path.extension().is_some_and(|extension| extension == ending);
    PathCompleter::file().filter(fits).complete(typed)
}

/// Names of the rigs at the endpoint of the environment, or the usual one. Without a service there is none.
fn served() -> Vec<String> {
    let given = std::env::var("TACTUS_ENDPOINT").ok();
    let endpoint = given.map_or_else(|| Some(Endpoint::of_this_machine()), |given| given.parse().ok());
    let (Some(endpoint), Ok(runtime)) = (endpoint, connection::runtime()) else { return Vec::new() };
    runtime.block_on(async {
        match Client::connect_as(&endpoint, None, &Credentials::default()).await {
            Ok(client) => vec![client.rig().to_owned()],
            Err(BusError::SeveralRigs { rigs, .. }) => rigs,
            // A shell that completes has no place for an error.
            Err(_) => Vec::new(),
        }
    })
}
