//! `figures`: computes the paper's figures.

use std::time::Instant;

use serde_json::json;
use tactus_report::figures;

use crate::cli::{Common, FiguresArgs};
use crate::exit::Exit;
use crate::output::{duration, say, say_next};
use crate::progress::Busy;

pub(crate) fn figures(common: &Common, args: &FiguresArgs) -> anyhow::Result<Exit> {
    let start = Instant::now();
    let busy = Busy::with("drawing", common.json);
    let files = figures::draw_all(&args.out, |drawn| {
        busy.shows(drawn.finished as f64 / drawn.figures as f64);
    })?;
    drop(busy);
    if common.json {
        say(&json!({ "files": files, "simulated": true }).to_string());
        return Ok(Exit::Done);
    }
    for file in &files {
        say(&file.display().to_string());
    }
    say(&format!("computed from the model without a sensor in {}", duration(start.elapsed().as_secs_f64())));
    let page = std::path::absolute(args.out.join("index.html"))?;
    say_next(&format!("{} shows all of them with captions in a browser", page.display()));
    Ok(Exit::Done)
}
