//! Draws the paper's figures: `cargo run -p tactus-report --example figures -- DIR`

use std::{env, error::Error, path::Path};

use tactus_report::figures::draw_all;

fn main() -> Result<(), Box<dyn Error>> {
    let directory = env::args().nth(1).ok_or("name a folder to draw into")?;
    draw_all(Path::new(&directory), |_| ())?;
    Ok(())
}
