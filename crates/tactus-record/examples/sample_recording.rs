//! Writes a synthetic run's recording, summary and measurement table into a directory, to test programs in other
//! languages: `cargo run -p tactus-record --example sample_recording -- DIR`

mod synthetic;

use std::{env, error::Error, fs, path::PathBuf};

use synthetic::Plan;

fn main() -> Result<(), Box<dyn Error>> {
    let dir = PathBuf::from(env::args().nth(1).ok_or("name a directory to write into")?);
    fs::create_dir_all(&dir)?;
    let (recording, table) = (dir.join("sample.mcap"), dir.join("sample.parquet"));
    if recording.exists() {
        fs::remove_file(&recording)?;
    }
    let run = Plan { lost: vec![40, 41, 100], ..Plan::short(4) }.make();
    run.record(&recording)?;
    fs::write(dir.join("sample.json"), serde_json::to_string_pretty(&tactus_record::info(&recording)?)?)?;
    tactus_record::export(&[&recording], &table)?;
    Ok(())
}
