//! The page of all commands with their options.

use std::fmt::Write as _;

use clap::{Arg, Command};

/// The programs, as on every machine.
pub(super) fn programs() -> Vec<Command> {
    // Its default is the socket of the installed service on a machine that has one.
    let tactus = tactus::command().mut_arg("endpoint", |arg| arg.default_value("tcp/127.0.0.1:7447"));
    let mut programs = vec![tactus, tactus_daemon::command(), tactus_web::command(), tactus_mock::command()];
    for program in &mut programs {
        program.build();
    }
    programs
}

pub(super) fn page() -> String {
    let mut page = "Every option of every program, as `--help` tells it. The manual pages (`man tactus-run`) say the same.\n".to_owned();
    for program in programs() {
        describe(&program, &[], &mut page);
    }
    page
}

/// `inherited` options are told of the command above this one.
fn describe(command: &Command, inherited: &[&str], page: &mut String) {
    let name = command.get_bin_name().unwrap_or(command.get_name());
    let about = command.get_long_about().or(command.get_about()).map(ToString::to_string).unwrap_or_default();
    let usage = command.clone().render_usage().to_string();
    let usage = usage.trim_start_matches("Usage: ").trim();
    // Writing to a string cannot fail.
    let _written = write!(page, "\n## {name}\n\n{about}\n\n```text\n{usage}\n```\n");
    let own = |arg: &&Arg| {
        let id = arg.get_id().as_str();
        !arg.is_hide_set() && !inherited.contains(&id) && !["help", "version"].contains(&id)
    };
    let args: Vec<&Arg> = command.get_arguments().filter(own).collect();
    if !args.is_empty() {
        page.push_str("\n| | |\n|---|---|\n");
        for arg in args {
            let _written = writeln!(page, "| `{}` | {} |", cell(&call(arg)), cell(&meaning(arg)));
        }
    }
    let global = command.get_arguments().filter(|arg| arg.is_global_set()).map(|arg| arg.get_id().as_str());
    let inherited: Vec<&str> = inherited.iter().copied().chain(global).collect();
    for inner in command.get_subcommands().filter(|inner| !inner.is_hide_set() && inner.get_name() != "help")
    {
        describe(inner, &inherited, page);
    }
}

/// How the argument is written.
fn call(arg: &Arg) -> String {
    let values = || {
        let names = arg.get_value_names().unwrap_or_default();
        names.iter().map(|name| format!("<{name}>")).collect::<Vec<_>>().join(" ")
    };
    let short = arg.get_short().map(|short| format!("-{short}, ")).unwrap_or_default();
    match arg.get_long() {
        Some(long) if arg.get_action().takes_values() => format!("{short}--{long} {}", values()),
        Some(long) => format!("{short}--{long}"),
        None => values(),
    }
}

fn meaning(arg: &Arg) -> String {
    let help = arg.get_long_help().or(arg.get_help()).map(ToString::to_string).unwrap_or_default();
    let help = help.replace("\n\n", " ").replace('\n', " ");
    let end = if help.is_empty() || help.ends_with('.') { "" } else { "." };
    let mut parts = vec![format!("{help}{end}")];
    let values = arg.get_possible_values();
    if !values.is_empty() && arg.get_action().takes_values() {
        let names: Vec<_> = values.iter().map(|value| format!("`{}`", value.get_name())).collect();
        parts.push(format!("One of {}.", names.join(", ")));
    }
    let defaults: Vec<_> =
        arg.get_default_values().iter().map(|value| format!("`{}`", value.to_string_lossy())).collect();
    if !defaults.is_empty() && arg.get_action().takes_values() {
        parts.push(format!("Default: {}.", defaults.join(" ")));
    }
    if let Some(variable) = arg.get_env() {
        parts.push(format!("Environment: `{}`.", variable.to_string_lossy()));
    }
    parts.join(" ")
}

/// A text within a cell of a table.
fn cell(text: &str) -> String {
    text.replace('|', "\\|")
}
