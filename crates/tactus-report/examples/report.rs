//! Writes the report of a recording: `cargo run -p tactus-report --example report -- RUN.mcap report.html`

use std::{env, error::Error, fs, path::Path};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [recording, page] = arguments.as_slice() else {
        return Err("name a recording and the page to write".into());
    };
    let report = tactus_report::run_report(Path::new(recording))?;
    fs::write(page, tactus_report::render_html(&report))?;
    Ok(())
}
