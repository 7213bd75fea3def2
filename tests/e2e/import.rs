//! A lab's own files: mapped, imported, and used as if Tactus had recorded them.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on fails")]

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use serde_json::Value;
use tactus_e2e::{CommandOutput, repository, tactus};
use tactus_record::table;
use tempfile::TempDir;

/// What the lab writes: semicolons, decimal commas, milliseconds, micrometres, depths that grow downwards from 500, channels column by
/// column from 1.
const MAPPING: &str = r#"
schema = "tactus.mapping/1"

[file]
delimiter = ";"
decimal = ","

[time]
column = "Time (ms)"
unit = "ms"

[x]
column = "X [um]"
unit = "um"

[y]
column = "Y [um]"
unit = "um"

[z]
column = "Depth [um]"
unit = "um"
direction = -1
origin = 500.0

[counts]
columns = "ch{n}"
first = 1
order = "column-major"
zero = "raw"

[rig]
name = "our bench"
simulated = true
indenter = "tip"

[rig.array]
rows = 6
cols = 8
element_mm = [1.8, 1.8]
col_centres_mm = [0.9, 2.9, 5.1, 7.1, 9.1, 11.1, 13.3, 15.3]
row_centres_mm = [0.9, 2.9, 4.9, 6.9, 8.9, 10.9]
full_scale_counts = 4095

[rig.registration]
origin_mm = [20.0, 15.0]

[rig.covering]
thickness_mm = 1.016

[rig.indenters]
tip = { shape = "cylinder", diameter_mm = 1.0 }
"#;

const ROWS: usize = 6;
const COLS: usize = 8;

fn done(said: CommandOutput) -> CommandOutput {
    assert_eq!(said.code, Some(0), "{said:?}");
    said
}

/// The table of a run on the embedded rig, as Parquet and as the lab would have written it.
fn measured(folder: &Path, experiment: &[&str]) {
    let run = ["--json", "run", "--embedded", "--no-report", "--seed", "7"];
    let said = done(tactus(folder, &[&run[..], experiment].concat()));
    let recording = said.json()["recording"].as_str().unwrap().to_owned();
    done(tactus(folder, &["export", &recording, "--out", "ours.parquet"]));
    let table = table::read(folder.join("ours.parquet")).unwrap();
    let mut text = "Time (ms);X [um];Y [um];Depth [um];state;press".to_owned();
    (1..=ROWS * COLS).for_each(|channel| write!(text, ";ch{channel}").unwrap());
    for row in table.rows() {
        let [x_mm, y_mm, z_mm] = row.position_mm;
        let milliseconds = 1e6 + row.t_ns as f64 / 1e6;
        let (x_um, y_um, depth_um) = (1e3 * x_mm, 1e3 * y_mm, 500.0 - 1e3 * z_mm);
        write!(text, "\n{milliseconds};{x_um};{y_um};{depth_um};{};{}", row.phase.name(), row.press).unwrap();
        for channel in 0..ROWS * COLS {
            let (col, line) = (channel / ROWS, channel % ROWS);
            write!(text, ";{}", row.counts[line * COLS + col]).unwrap();
        }
    }
    fs::write(folder.join("bench.csv"), text.replace('.', ",")).unwrap();
    fs::write(folder.join("lab.toml"), MAPPING).unwrap();
}

fn calibrated(folder: &Path, table: &str) -> Value {
    let said = tactus(folder, &["--json", "calibrate", table, "--out", table.trim_end_matches(".parquet")]);
    assert_eq!(said.code, Some(3), "one covering does not tell the slope against thickness: {said:?}");
    said.json()
}

/// Fails if a number with its standard error differs from the other by more than `share` of the error.
fn assert_same_estimates(ours: &Value, theirs: &Value, share: f64, path: &str) {
    match (ours, theirs) {
        (Value::Object(ours), Value::Object(theirs)) => {
            if let (Some(value), Some(error)) = (ours.get("value"), ours.get("standard_error")) {
                let [value, error, other] = [value, error, &theirs["value"]].map(|one| one.as_f64().unwrap());
                // Without an error of its own it is what the other elements have, whose errors are some percent.
                let most = share * if error > 0.0 { error } else { 0.02 * value.abs() };
                assert!((value - other).abs() <= most, "{path}: {value} and {other}, error {error}");
                return;
            }
            for (key, ours) in ours {
                assert_same_estimates(ours, &theirs[key], share, &format!("{path}.{key}"));
            }
        }
        (Value::Array(ours), Value::Array(theirs)) => {
            assert_eq!(ours.len(), theirs.len(), "{path}");
            for (index, (ours, theirs)) in ours.iter().zip(theirs).enumerate() {
                assert_same_estimates(ours, theirs, share, &format!("{path}[{index}]"));
            }
        }
        _ => {}
    }
}

#[test]
fn a_foreign_file_gives_the_model_of_the_original() {
    let folder = TempDir::new().unwrap();
    measured(folder.path(), &["element-centres"]);
    let said = done(tactus(folder.path(), &["--json", "import", "--map", "lab.toml", "bench.csv"])).json();
    let run = &said["runs"][0];
    assert_eq!(
        (&run["run"], &run["presses"], &run["holds"]),
        (&"bench".into(), &48.into(), &240.into()),
        "{said}"
    );
    assert!(said["assumed"].to_string().contains("rate_hz = 30.0"), "{said}");
    done(tactus(folder.path(), &["validate", "bench.parquet"]));
    let validated = done(tactus(folder.path(), &["validate", "lab.toml"]));
    assert!(validated.out.contains("a mapping for `tactus import`, 6 x 8 elements"), "{validated:?}");
    fs::write(folder.path().join("wrong.toml"), MAPPING.replacen("unit = \"", "unit = \"x", 1)).unwrap();
    let refused = tactus(folder.path(), &["validate", "wrong.toml"]);
    assert_eq!(refused.code, Some(1), "{refused:?}");
    assert!(refused.err.contains("unit"), "{refused:?}");
    let with_phases =
        MAPPING.replace("[rig]\n", "[phases]\ncolumn = \"state\"\npress = \"press\"\n\n[rig]\n");
    fs::write(folder.path().join("phases.toml"), with_phases).unwrap();
    done(tactus(folder.path(), &["import", "--map", "phases.toml", "bench.csv", "--out", "phases.parquet"]));

    // Phases from the path give each dwell some frames more; the same phases give the same model.
    let ours = calibrated(folder.path(), "ours.parquet");
    for (table, share) in [("bench.parquet", 0.5), ("phases.parquet", 1e-3)] {
        let theirs = calibrated(folder.path(), table);
        let faulty = |found: &Value| {
            let faults = found["health"]["faults"].as_array().unwrap().iter();
            faults.map(|fault| fault["element"].clone()).collect::<Vec<_>>()
        };
        assert_eq!(faulty(&ours), faulty(&theirs));
        for part in ["registration", "response", "spreads"] {
            assert_same_estimates(&ours[part], &theirs[part], share, part);
        }
    }
}

#[test]
fn numpy_arrays_are_imported_by_a_rig_file() {
    let folder = TempDir::new().unwrap();
    let run = ["--json", "run", "corners", "--embedded", "--no-report", "--seed", "7"];
    let recording = done(tactus(folder.path(), &run)).json()["recording"].as_str().unwrap().to_owned();
    done(tactus(folder.path(), &["export", &recording, "--out", "frames.npz"]));
    done(tactus(folder.path(), &["export", &recording, "--out", "ours.parquet"]));
    fs::copy(repository("config/rigs/sim.toml"), folder.path().join("sim.toml")).unwrap();
    let map = r#"
schema = "tactus.mapping/1"
rig = "sim.toml"
time = { column = "t_ns", unit = "ns" }
x = { column = "x_mm", unit = "mm" }
y = { column = "y_mm", unit = "mm" }
z = { column = "z_mm", unit = "mm", direction = 1, origin = 0.0 }
counts = { columns = "counts[{n}]", first = 0, order = "row-major", zero = "raw" }
covering = { column = "covering_mm", unit = "mm" }
"#;
    fs::write(folder.path().join("npz.toml"), map).unwrap();
    done(tactus(folder.path(), &["import", "--map", "npz.toml", "frames.npz", "--out", "theirs.parquet"]));
    let [ours, theirs] =
        ["ours.parquet", "theirs.parquet"].map(|name| table::read(folder.path().join(name)).unwrap());
    assert_eq!(ours.counts(), theirs.counts());
    let presses = |table: &table::Table| table.rows().map(|row| row.press).max();
    assert_eq!(presses(&ours), presses(&theirs));
    assert_eq!(theirs.head().metadata["tactus.rig"], ours.head().metadata["tactus.rig"]);
}

/// What `discover` finds in a table.
fn discovered(folder: &Path, table: &str) -> Value {
    let out = table.trim_end_matches(".parquet");
    tactus(folder, &["--json", "discover", table, "--out", out]).json()
}

/// The same sensor with an amplifier that inverts, in volts, with the reading at rest taken off: every count is a number below 1, most of them
/// negative. A tone is hidden in both.
#[test]
#[ignore = "a minute on two cores: `just long-tests`"]
fn a_discovery_does_not_depend_on_what_a_lab_calls_a_count() {
    const VOLTS_A_COUNT: f64 = 3.3 / 4095.0;
    let folder = TempDir::new().unwrap();
    measured(folder.path(), &["diagnose", "-p", "parts=drift,repeats"]);
    let text = fs::read_to_string(folder.path().join("bench.csv")).unwrap();
    let mut lines = text.lines();
    let head = lines.next().unwrap();
    let rows: Vec<Vec<f64>> = lines
        .map(|line| line.split(';').map(|cell| cell.replace(',', ".").parse().unwrap_or(0.0)).collect())
        .collect();
    let written = |counts: &dyn Fn(usize, f64) -> f64| {
        let mut out = head.to_owned();
        for row in &rows {
            let tone = 6.0 * (2.0 * std::f64::consts::PI * 1.37e-3 * row[0]).sin();
            let cell = |(at, value): (usize, &f64)| {
                if at < 6 { *value } else { counts(at, (value + tone).round()) }
            };
            let cells: Vec<String> = row.iter().enumerate().map(|pair| cell(pair).to_string()).collect();
            write!(out, "\n{}", cells.join(";").replace('.', ",")).unwrap();
        }
        out
    };
    fs::write(folder.path().join("counts.csv"), written(&|_, counts| counts)).unwrap();
    let rest = rows[0].clone();
    let volts = |at: usize, counts: f64| -VOLTS_A_COUNT * (counts - rest[at].round());
    fs::write(folder.path().join("volts.csv"), written(&volts)).unwrap();
    let in_volts = MAPPING.replace("zero = \"raw\"", "zero = \"subtracted\"").replace(
        "full_scale_counts = 4095",
        &format!("full_scale_counts = 3.3\nstep_counts = {VOLTS_A_COUNT}"),
    );
    fs::write(folder.path().join("volts.toml"), in_volts).unwrap();
    done(tactus(folder.path(), &["import", "--map", "lab.toml", "counts.csv"]));
    let said = done(tactus(folder.path(), &["--json", "import", "--map", "volts.toml", "volts.csv"])).json();
    assert!(said["assumed"].to_string().contains("least_counts"), "{said}");

    let [counts, volts] = ["counts.parquet", "volts.parquet"].map(|table| discovered(folder.path(), table));
    assert_eq!(counts["verdict"], volts["verdict"]);
    let names = |found: &Value| -> Vec<Value> {
        found["steps"].as_array().unwrap().iter().map(|step| step["effect"].clone()).collect()
    };
    assert_eq!(names(&counts), ["miswired", "periodic-interference"]);
    assert_eq!(names(&volts), names(&counts));
    for (part, key) in [("base", "heldout_chi2"), ("final", "heldout_chi2")] {
        let [ours, theirs] = [&counts, &volts].map(|found| found[part][key].as_f64().unwrap());
        assert!((theirs / ours - 1.0).abs() < 1e-3, "{part}: {ours} and {theirs}");
    }
    let amplitude = |found: &Value| {
        let term = &found["steps"][1]["terms"][0];
        let [sine, cosine] =
            ["sine_counts", "cosine_counts"].map(|name| term[name]["value"].as_f64().unwrap());
        sine.hypot(cosine)
    };
    let ratio = amplitude(&volts) / amplitude(&counts) / VOLTS_A_COUNT;
    assert!((ratio - 1.0).abs() < 1e-3 && amplitude(&counts) > 5.0, "{ratio}: {}", counts["steps"]);
}

/// Real strokes of another lab's robot on a magnetic skin (`../shared/data`), without their phases, by the example's mapping.
#[test]
fn measured_strokes_become_presses() {
    let data = repository("../shared/data/eflesh-normal-20250401_014340.parquet");
    if !data.is_file() {
        eprintln!("skipped: {} is not here", data.display());
        return;
    }
    let folder = TempDir::new().unwrap();
    let measured = table::read(&data).unwrap();
    let mut text = "seconds,push_mm".to_owned();
    (0..15).for_each(|channel| write!(text, ",mag{channel}").unwrap());
    for row in measured.rows() {
        write!(text, "\n{},{}", row.t_ns as f64 / 1e9, -row.position_mm[2]).unwrap();
        row.counts.iter().for_each(|count| write!(text, ",{count}").unwrap());
    }
    fs::write(folder.path().join("strokes.csv"), text).unwrap();
    let map = repository("examples/import/skin.toml");
    let said =
        done(tactus(folder.path(), &["--json", "import", "--map", map.to_str().unwrap(), "strokes.csv"]))
            .json();
    assert_eq!((&said["rows"], &said["runs"][0]["presses"]), (&3600.into(), &10.into()), "{said}");
    let imported = table::read(folder.path().join("strokes.parquet")).unwrap();
    let phases = measured.rows().zip(imported.rows());
    let alike =
        phases.filter(|(ours, theirs)| (ours.phase, ours.press) == (theirs.phase, theirs.press)).count();
    assert!(alike * 100 > 3600 * 92, "{alike} of 3600 frames have the phase that people gave them");
    let [original, found] = [data.to_str().unwrap(), "strokes.parquet"].map(|table| {
        let said = tactus(folder.path(), &["--json", "calibrate", table]);
        assert_eq!(said.code, Some(3), "{said:?}");
        said.json()["response"]["elements"].clone()
    });
    let slopes = |elements: &Value| {
        let slope = |one: &Value| one["linear_counts_per_mm"]["value"].as_f64().unwrap();
        elements.as_array().unwrap().iter().map(slope).collect::<Vec<_>>()
    };
    // Channels bend with the depth, so their slopes depend a little on which slow frames count as held.
    let (original, found) = (slopes(&original), slopes(&found));
    let steepest = original.iter().fold(0.0_f64, |most, slope| most.max(slope.abs()));
    for (original, found) in original.into_iter().zip(found) {
        assert!((original - found).abs() < 0.03 * steepest, "{original} {found}");
    }
}

#[test]
fn what_a_file_cannot_show_is_asked() {
    let folder = TempDir::new().unwrap();
    let write = |rows: [&str; 2]| {
        let text = format!("t_ms,x_mm,y_mm,depth_um,ch0,ch1\n{}\n{}\n", rows[0], rows[1]);
        fs::write(folder.path().join("bench.csv"), text).unwrap();
    };
    let refused = |replace: &str, with: &str| {
        assert!(SMALL.contains(replace), "{replace}");
        fs::write(folder.path().join("lab.toml"), SMALL.replace(replace, with)).unwrap();
        let said = tactus(folder.path(), &["--json", "import", "--map", "lab.toml", "bench.csv"]);
        assert_eq!(said.code, Some(1), "{said:?}");
        assert!(!folder.path().join("bench.parquet").exists());
        said.json()["error"].as_str().unwrap().to_owned()
    };
    for (rows, told) in [
        (["0,1,2,-9,5,6", "30,1,2,abc,5,6"], "bench.csv: line 3, column \"depth_um\": \"abc\" is no number"),
        (["0,1,2,-9,5,6", "30,1,2,-9,,6"], "bench.csv: line 3, column \"ch0\": empty"),
        (["0,1,2,-9,5,6", "0,1,2,-9,5,6"], "bench.csv: line 3, column \"t_ms\": the time does not rise"),
        (["0,1,2,-9,5,6", "30,1,2,-9,5"], "line: 3"),
        // A stage that never came down: nothing tells the sensitivity.
        (["0,1,2,-9,5,6", "30,1,2,-9,5,6"], "rig.sensitivity_counts_per_mm: missing: no press is seen"),
    ] {
        write(rows);
        let error = refused("", "");
        assert!(error.contains(told), "{error}");
    }
    for (replace, with, told) in [
        (
            "direction = -1, ",
            "",
            "lab.toml: z.direction: missing: write 1 if the column grows upwards, -1 if",
        ),
        (
            ", origin = 0.0",
            "",
            "lab.toml: z.origin: missing: write what the column says where the tip just touches",
        ),
        (
            ", zero = \"raw\"",
            "",
            "lab.toml: counts.zero: write \"raw\" if the counts are as the sensor gave them",
        ),
        ("order = \"row-major\", ", "", "lab.toml: counts.order: missing: write \"row-major\""),
        (
            "column = \"x_mm\"",
            "column = \"X\"",
            "no column \"X\", which x.column of the mapping names; the file has \"t_ms\"",
        ),
        ("cols = 2", "cols = 3", "no column \"ch2\", which counts.columns of the mapping names"),
        (
            "thickness_mm = 1.0",
            "",
            "lab.toml: rig.covering.thickness_mm: missing: write the thickness of the covering",
        ),
        ("unit = \"ms\"", "unit = \"hours\"", "unknown variant `hours`"),
        (", full_scale_counts = 4095", "", "lab.toml: rig.array.full_scale_counts: missing"),
    ] {
        let error = refused(replace, with);
        assert!(error.contains(told), "{error}");
    }
}

/// A mapping of two elements.
const SMALL: &str = r#"
schema = "tactus.mapping/1"
time = { column = "t_ms", unit = "ms" }
x = { column = "x_mm", unit = "mm" }
y = { column = "y_mm", unit = "mm" }
z = { column = "depth_um", unit = "um", direction = -1, origin = 0.0 }
counts = { columns = "ch{n}", first = 0, order = "row-major", zero = "raw" }

[rig]
name = "small"
indenter = "tip"
array = { rows = 1, cols = 2, pitch_mm = 2.0, element_mm = [1.8, 1.8], full_scale_counts = 4095 }
registration = { origin_mm = [0.0, 0.0] }
covering = { thickness_mm = 1.0 }
indenters = { tip = { shape = "cylinder", diameter_mm = 1.0 } }
"#;

#[test]
fn a_new_mapping_asks_what_names_do_not_say() {
    let folder = TempDir::new().unwrap();
    measured(folder.path(), &["element-centres"]);
    let said = done(tactus(folder.path(), &["import", "--new-map", "new.toml", "bench.csv"]));
    let proposed = fs::read_to_string(folder.path().join("new.toml")).unwrap();
    for line in [
        "delimiter = \";\"",
        "column = \"Time (ms)\"",
        "unit = \"ms\"",
        "column = \"Depth [um]\"",
        "columns = \"ch{n}\"",
        "first = 1",
    ] {
        assert!(proposed.contains(line), "{line} in {proposed}");
    }
    assert!(said.out.contains("#?") && proposed.contains("# 48 elements in all"), "{said:?} {proposed}");
    // Every question left open is an error that names its key; complete, it imports.
    let told = tactus(folder.path(), &["import", "--map", "new.toml", "bench.csv"]);
    assert!(told.code == Some(1) && told.err.contains("z.direction: missing"), "{told:?}");
    assert!(told.err.contains("begin with #? and are still to be completed"), "{told:?}");
    let answered = proposed
        .replace("#? ", "")
        .replace("direction = 1 ", "direction = -1 ")
        .replace("origin = 0.0 ", "origin = 500.0 ")
        .replace("order = \"row-major\"", "order = \"column-major\"");
    fs::write(folder.path().join("new.toml"), answered).unwrap();
    let said = done(tactus(folder.path(), &["--json", "import", "--map", "new.toml", "bench.csv"])).json();
    assert_eq!(said["runs"][0]["presses"], 48, "{said}");
    let again = tactus(folder.path(), &["import", "--new-map", "new.toml", "bench.csv"]);
    assert!(again.code == Some(2) && again.err.contains("exists"), "{again:?}");
}
