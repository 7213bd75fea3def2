//! `figures`: computes the paper's figures.

use std::time::Instant;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde_json::json;
use tactus_report::figures;

use crate::cli::{Common, FiguresArgs};
use crate::exit::Exit;
use crate::output::duration;

pub(crate) fn figures(common: &Common, args: &FiguresArgs) -> anyhow::Result<Exit> {
    let start = Instant::now();
    let bar = bar(common.json);
    let files = figures::draw_all(&args.out, |progress| {
        bar.set_length(progress.figures as u64);
        bar.set_position(progress.written as u64);
        bar.set_message(progress.title);
    })?;
    bar.finish_and_clear();
    if common.json {
        println!("{}", json!({ "files": files, "simulated": true }));
    } else {
        for file in &files {
            println!("{}", file.display());
        }
        eprintln!("computed from the model without a sensor in {}", duration(start.elapsed().as_secs_f64()));
    }
    Ok(Exit::Done)
}

fn bar(silent: bool) -> ProgressBar {
    let target = if silent { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
    let bar = ProgressBar::with_draw_target(None, target);
    match ProgressStyle::with_template("{bar:30.cyan/dim} {pos}/{len} figures, {eta} left  {msg}") {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}
