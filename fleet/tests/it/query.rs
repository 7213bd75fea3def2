//! SQL over a fleet: what it says against what the recordings say, computed here.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::{collections::BTreeMap, fs, path::Path, process::Command, thread};

use serde_json::Value;
use tactus_model::{Contact, Covering};
use tactus_record::table;
use tactus_schema::{
    Model,
    table::{Phase, Row},
};

use crate::lab::{DAY_NS, Lab, NOON_NS, Said};

const MODEL: &str = include_str!("../../../config/models/digitacts.toml");

/// Where the model file has its rows and columns.
const ROWS: &str = "row_centres_mm = [0.9, 2.9, 4.9, 6.9, 8.9, 10.9]";
const COLS: &str = "col_centres_mm = [0.9, 2.9, 5.1, 7.1, 9.1, 11.1, 13.3, 15.3]";

/// The rows of an answer.
fn rows(said: &Said) -> Vec<Value> {
    assert_eq!(said.code, Some(0), "{said:?}");
    said.out.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

fn ask(lab: &Lab, sql: &str) -> Vec<Value> {
    rows(&lab.fleet(&["--json", "query", sql]))
}

/// Why a query has no answer.
fn refused(lab: &Lab, sql: &str) -> String {
    let said = lab.fleet(&["query", sql]);
    assert_eq!((said.code, said.out.as_str()), (Some(1), ""), "{said:?}");
    said.err
}

/// The rows of a recording.
fn recorded(lab: &Lab, run: &str) -> Vec<Row> {
    let exported = lab.path("exported.parquet");
    tactus_record::export(&[lab.path(&format!("runs/{run}/recording.mcap"))], &exported).unwrap();
    let table = table::read(&exported).unwrap();
    table.rows().map(Row::from).collect()
}

fn mean<'a>(rows: impl Iterator<Item = &'a Row>) -> Vec<f64> {
    let (mut sums, mut number) = (vec![0.0; 48], 0.0);
    for row in rows {
        sums.iter_mut().zip(&row.counts).for_each(|(sum, counts)| *sum += f64::from(*counts));
        number += 1.0;
    }
    sums.into_iter().map(|sum| sum / number).collect()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

fn assert_close(one: &[f64], other: &[f64]) {
    assert_eq!(one.len(), other.len());
    for (one, other) in one.iter().zip(other) {
        assert!((one - other).abs() < 1e-9, "{one} {other}");
    }
}

#[test]
fn frames_are_counted_by_rig_and_date() {
    let lab = Lab::with_three_runs();
    lab.ingest();
    let sql = "SELECT rig, CAST(date AS VARCHAR) AS date, run, count(*) AS frames, sum(counts[18]) AS sum
               FROM frames WHERE phase = 'hold' GROUP BY rig, date, run ORDER BY rig, date";
    let told = ask(&lab, sql);
    let runs = [
        ("left", "2026-03-25", "20260325-120000-image"),
        ("right", "2026-03-25", "20260325-120000-centres"),
        ("right", "2026-03-26", "20260326-120000-centres"),
    ];
    assert_eq!(told.len(), runs.len());
    for (told, (rig, date, run)) in told.iter().zip(runs) {
        let held: Vec<Row> = recorded(&lab, run).into_iter().filter(|row| row.phase == Phase::Hold).collect();
        assert_eq!((&told["rig"], &told["date"], &told["run"]), (&rig.into(), &date.into(), &run.into()));
        assert_eq!(told["frames"], held.len());
        let sum: f64 = held.iter().map(|row| f64::from(row.counts[17])).sum();
        assert!((told["sum"].as_f64().unwrap() - sum).abs() < 1e-6, "{told} {sum}");
    }
}

#[test]
fn a_condition_on_rig_or_date_leaves_other_files_unread() {
    let lab = Lab::with_three_runs();
    lab.ingest();
    let file = lab.path("fleet").join(&lab.files()[2]);
    fs::write(&file, b"no longer Parquet").unwrap();
    for kept in ["rig = 'left'", "date = '2026-03-25'", "date < '2026-03-26' AND rig LIKE '%t'"] {
        let told = ask(&lab, &format!("SELECT sum(counts[1]) AS sum FROM frames WHERE {kept}"));
        assert!(told[0]["sum"].as_f64().unwrap() > 0.0, "{told:?}");
    }
    let told = refused(&lab, "SELECT sum(counts[1]) FROM frames");
    assert!(told.contains("20260326-120000-centres.parquet"), "{told}");
}

#[test]
fn runs_say_what_their_files_say() {
    let lab = Lab::with_three_runs();
    let ingested = lab.ingest();
    let sql = "SELECT rig, run, experiment, who, simulated, frames, cardinality(warnings) AS warnings,
               CAST(started AS VARCHAR) AS started FROM runs ORDER BY rig, date";
    let told = ask(&lab, sql);
    assert_eq!(told.len(), 3);
    assert_eq!(told[0]["rig"], "left");
    assert_eq!(told[0]["run"], "20260325-120000-image");
    assert_eq!((&told[0]["experiment"], &told[0]["who"]), (&"element-centres".into(), &"ada".into()));
    assert_eq!((&told[0]["simulated"], &told[0]["warnings"]), (&true.into(), &0.into()));
    assert_eq!(told[2]["started"], "2026-03-26T12:00:00");
    let frames: u64 = told.iter().map(|run| run["frames"].as_u64().unwrap()).sum();
    assert_eq!(ingested["rows"], frames);
}

#[test]
fn presses_and_dwells_have_the_images_of_their_frames() {
    let lab = Lab::with_three_runs();
    lab.ingest();
    let run = "20260325-120000-centres";
    let sql = "SELECT d.press, depth_mm, d.frames, image, zeros, response(image, zeros) AS rise
               FROM dwells d JOIN presses p USING (rig, date, run, press)
               WHERE d.rig = 'right' AND d.date = '2026-03-25' ORDER BY d.press, depth_mm";
    let told = ask(&lab, sql);
    // Two presses, five depths each.
    assert_eq!(told.len(), 10, "{told:?}");
    let recorded = recorded(&lab, run);
    let mut dwells: BTreeMap<(i32, i64), Vec<&Row>> = BTreeMap::new();
    for row in recorded.iter().filter(|row| row.press >= 0 && row.phase == Phase::Hold) {
        #[expect(clippy::cast_possible_truncation, reason = "depths are below a mm")]
        let hundredths = (-row.position_mm[2] * 100.0).round() as i64;
        dwells.entry((row.press, hundredths)).or_default().push(row);
    }
    for (told, ((press, hundredths), of_dwell)) in told.iter().zip(&dwells) {
        assert_eq!((&told["press"], &told["frames"]), (&(*press).into(), &of_dwell.len().into()));
        assert!((told["depth_mm"].as_f64().unwrap() * 100.0 - *hundredths as f64).abs() < 1e-6, "{told}");
        let image = mean(of_dwell.iter().copied());
        assert_close(&numbers(&told["image"]), &image);
        let above =
            |row: &&Row| row.press == *press && row.phase == Phase::Approach && row.position_mm[2] > 0.3;
        let zeros = mean(recorded.iter().filter(above));
        assert_close(&numbers(&told["zeros"]), &zeros);
        let rises: Vec<f64> = image.iter().zip(&zeros).map(|(image, zeros)| image - zeros).collect();
        assert_close(&numbers(&told["rise"]), &rises);
    }
}

#[test]
fn residuals_are_the_counts_less_what_the_model_gives() {
    let lab = Lab::with_three_runs();
    lab.ingest();
    fs::write(lab.path("model.toml"), MODEL).unwrap();
    let sql = "SELECT t_ns, prediction, residual, rms(residual) AS rms FROM predicted('model.toml')
               WHERE rig = 'left' AND phase IN ('hold', 'load', 'approach') ORDER BY t_ns";
    let told = ask(&lab, sql);
    let run = recorded(&lab, "20260325-120000-image");
    let seen = [Phase::Hold, Phase::Load, Phase::Approach];
    let run: Vec<Row> = run.into_iter().filter(|row| seen.contains(&row.phase)).collect();
    assert_eq!(told.len(), run.len());
    let forward = Model::from_toml(MODEL).unwrap().forward().unwrap();
    for (told, row) in told.iter().zip(&run) {
        assert_eq!(told["t_ns"], row.t_ns);
        let predicted = numbers(&told["prediction"]);
        let depth_mm = -row.position_mm[2];
        // Above the surface everything is at its baseline; the first press is a reference press upon element 0.
        assert!((predicted[0] - (100.0 + 1000.0 * depth_mm.max(0.0))).abs() < 1e-6, "{told}");
        let contact = Contact {
            indenter: tactus_model::Indenter::Cylinder { diameter_mm: 1.0 },
            position_mm: [row.position_mm[0] - 20.0, row.position_mm[1] - 15.0],
            rotation_deg: 0.0,
            depth_mm,
        };
        let mut image = vec![0.0; 48];
        forward.image(&contact, Covering { thickness_mm: 1.016 }, &mut image);
        assert_close(&predicted, &image);
        let residual: Vec<f64> =
            row.counts.iter().zip(&image).map(|(counts, image)| f64::from(*counts) - image).collect();
        assert_close(&numbers(&told["residual"]), &residual);
        let squares: f64 = residual.iter().map(|counts| counts * counts).sum();
        assert_close(&[told["rms"].as_f64().unwrap()], &[(squares / 48.0).sqrt()]);
    }
}

#[test]
fn a_run_that_an_older_fleet_has_under_two_dates_is_predicted_once_a_frame() {
    let lab = Lab::new();
    let recording = lab.record("left", "press", NOON_NS, 1);
    lab.export(&[recording], "press.parquet");
    for (fleet, date) in [("fleet", "2026-03-30"), ("second", "2026-03-31")] {
        let said = lab.fleet(&["ingest", "press.parquet", "--to", fleet, "--date", date]);
        assert_eq!(said.code, Some(0), "{said:?}");
    }
    let second = "rig=left/date=2026-03-31";
    fs::rename(lab.path("second").join(second), lab.path("fleet").join(second)).unwrap();
    fs::write(lab.path("model.toml"), MODEL).unwrap();
    let number = |table: &str| ask(&lab, &format!("SELECT count(*) AS frames FROM {table}"));
    assert_eq!(number("predicted('model.toml')"), number("frames"));
}

/// An effect in a model file: the surface stands higher by 0.1 mm.
const OFFSET: &str = "\n[[effect]]\nname = \"surface-offset\"\nparameters = { offset_mm = 0.1 }\n";

#[test]
fn effects_that_do_not_act_in_time_are_predicted() {
    let lab = Lab::with_three_runs();
    lab.ingest();
    fs::write(lab.path("effect.toml"), format!("{MODEL}{OFFSET}")).unwrap();
    let sql = "SELECT -z_mm AS depth_mm, prediction[1] AS counts FROM predicted('effect.toml')
               WHERE rig = 'left' AND phase IN ('hold', 'load', 'approach')";
    let told = ask(&lab, sql);
    assert!(!told.is_empty());
    for told in told {
        let depth_mm = told["depth_mm"].as_f64().unwrap() + 0.1;
        let expected = 100.0 + 1000.0 * depth_mm.max(0.0);
        assert!((told["counts"].as_f64().unwrap() - expected).abs() < 1e-6, "{told}");
    }
}

#[test]
fn models_that_do_not_fit_are_refused() {
    let lab = Lab::with_three_runs();
    lab.ingest();
    let of = |path: &str| format!("SELECT rms(residual) FROM predicted('{path}')");
    assert!(refused(&lab, &of("nowhere.toml")).contains("nowhere.toml: No such file"));
    fs::write(lab.path("wrong.toml"), "schema = 1").unwrap();
    assert!(refused(&lab, &of("wrong.toml")).contains("wrong.toml: "));
    let effect = "\n[[effect]]\nname = \"time-lag\"\nparameters = { lag_s = 0.01 }\n";
    fs::write(lab.path("effect.toml"), format!("{MODEL}{OFFSET}{effect}")).unwrap();
    assert!(refused(&lab, &of("effect.toml")).contains("has the effect time-lag, which acts in time"));
    let small = MODEL.replace("rows = 6", "rows = 1").replace(ROWS, "row_centres_mm = [0.9]");
    fs::write(lab.path("small.toml"), small).unwrap();
    assert!(refused(&lab, &of("small.toml")).contains("has 6 rows, the model small.toml has 1 row:"));
    // As many elements, but eight rows of six.
    let turned = MODEL
        .replace("rows = 6", "rows = 8")
        .replace("cols = 8", "cols = 6")
        .replace(ROWS, "row_centres_mm = [0.9, 2.9, 4.9, 6.9, 8.9, 10.9, 12.9, 14.9]")
        .replace(COLS, "col_centres_mm = [0.9, 2.9, 5.1, 7.1, 9.1, 11.1]");
    fs::write(lab.path("turned.toml"), turned).unwrap();
    assert!(refused(&lab, &of("turned.toml")).contains("has 6 rows, the model turned.toml has 8 rows"));
    let moved = MODEL.replace(COLS, "col_centres_mm = [0.9, 2.9, 5.1, 7.2, 9.1, 11.1, 13.3, 15.3]");
    fs::write(lab.path("moved.toml"), moved).unwrap();
    let told = refused(&lab, &of("moved.toml"));
    assert!(told.contains("has column 3 at 7.1 mm, the model moved.toml has column 3 at 7.2 mm"), "{told}");
    let told = refused(&lab, "SELECT residual FROM predicted()");
    assert!(told.contains("predicted('model.toml')"), "{told}");
}

#[test]
fn an_error_says_where_and_what_there_is() {
    let lab = Lab::with_three_runs();
    lab.ingest();
    let told = refused(&lab, "SELECT rig,\n  x_mm FORM frames");
    let lines: Vec<&str> = told.lines().collect();
    assert!(lines[0].starts_with("error: Expected: end of statement"), "{told}");
    assert_eq!(lines[1..], ["    x_mm FORM frames", "              ^"]);
    assert!(refused(&lab, "SELECT rig FROM frames WHERE x_mm >").contains("Expected: an expression"));
    let told = refused(&lab, "SELECT rig, phas FROM frames");
    assert!(told.contains("no column phas") && told.contains("frames.phase"), "{told}");
    let lines: Vec<&str> = told.lines().collect();
    assert_eq!(lines[1], "  SELECT rig, phas FROM frames");
    assert_eq!(lines[2], "              ^");
    let told = refused(&lab, "SELECT rig FROM frame");
    assert!(told.contains("no table frame") && told.contains("dwells, frames, presses, runs"), "{told}");
    let told = refused(&lab, "SELECT imag(counts) FROM frames");
    assert!(told.contains("image"), "{told}");
    let told = refused(&lab, "SELECT image(rig) FROM frames");
    assert!(told.contains("image() takes one list of numbers"), "{told}");
    for changes in ["DROP TABLE frames", "CREATE TABLE t AS SELECT 1", "COPY frames TO 'x.csv'"] {
        assert!(refused(&lab, changes).contains("not supported"), "{changes}");
    }
    fs::create_dir(lab.path("empty")).unwrap();
    let said = lab.fleet(&["query", "SELECT 1", "--at", "empty"]);
    assert!(said.code == Some(1) && said.err.contains("tactus fleet ingest"), "{said:?}");
}

#[test]
fn people_get_a_table_and_files_get_all_rows() {
    let lab = Lab::with_three_runs();
    lab.ingest();
    let said = lab.fleet(&["query", "SELECT rig, count(*) AS frames FROM frames GROUP BY rig ORDER BY rig"]);
    let counted = ask(&lab, "SELECT count(*) AS frames FROM frames WHERE rig = 'left'");
    let lines: Vec<&str> = said.out.lines().collect();
    assert_eq!(lines[0], "rig    frames");
    assert_eq!(lines[1], format!("left   {:>6}", counted[0]["frames"].as_u64().unwrap()));

    let said = lab.fleet(&["query", "SELECT t_ns, counts FROM frames"]);
    assert!(said.out.lines().count() == 103 && said.out.contains("next: "), "{said:?}");

    let all = "SELECT rig, t_ns, counts FROM frames WHERE phase = 'hold' ORDER BY rig, run, t_ns";
    let number = ask(&lab, all).len();
    for file in ["held.parquet", "held.csv"] {
        let said = lab.fleet(&["--json", "query", all, "--out", file]);
        assert_eq!(said.json()["rows"], number, "{said:?}");
    }
    let csv = fs::read_to_string(lab.path("held.csv")).unwrap();
    assert!(csv.starts_with("rig,t_ns,counts\nleft,"), "{}", &csv[..80]);
    assert_eq!(csv.lines().count(), number + 1);
    let told = lab.fleet(&["query", all, "--out", "held.txt"]);
    assert!(told.code == Some(1) && told.err.contains(".parquet or .csv"), "{told:?}");
    assert_eq!(listed(&lab.path("")), ["exported.parquet", "fleet", "held.csv", "held.parquet", "runs"][1..]);
}

/// Names in a folder, in order.
fn listed(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<String> =
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// Several runs of all elements: some 7 MB in memory.
fn large() -> Lab {
    let lab = Lab::new();
    for day in 0..6 {
        lab.record("left", &format!("2026032{}-120000-image", 2 + day), NOON_NS + day * DAY_NS, 48);
    }
    lab.ingest();
    lab
}

#[test]
fn what_does_not_fit_in_memory_goes_to_the_disk() {
    let lab = large();
    fs::create_dir(lab.path("spill")).unwrap();
    let sql = "SELECT sum(t) AS t, sum(at * counts[18]) AS counts FROM
        (SELECT t_ns AS t, counts, row_number() OVER (ORDER BY counts[18], t_ns, date) AS at FROM frames)";
    let little = ["--threads", "1", "--json", "query", "--memory", "0.004", "--spill", "spill"];
    let spilled = rows(&lab.fleet(&[&little[..], &[sql]].concat()));
    assert_eq!(spilled, ask(&lab, sql));
    let told = lab.fleet(&[&little[..], &[&format!("EXPLAIN ANALYZE {sql}")]].concat()).out;
    let spills = told.split("spill_count=").skip(1).filter(|rest| !rest.starts_with('0')).count();
    assert!(spills > 0, "{told}");
    assert_eq!(listed(&lab.path("spill")), [""; 0]);

    let said = lab.fleet(&["query", "--memory", "0.000001", sql]);
    assert!(said.code == Some(1) && said.err.contains("--memory"), "{said:?}");
}

#[test]
fn ctrl_c_ends_a_query_and_leaves_nothing() {
    let lab = Lab::with_three_runs();
    lab.ingest();
    fs::create_dir(lab.path("out")).unwrap();
    let endless = "SELECT a.t_ns FROM frames a, frames b, frames c, frames d WHERE a.x_mm + b.y_mm + c.z_mm + d.t_ns = 0.1";
    let mut child = lab.command(&["query", endless, "--out", "out/rows.parquet"]).spawn().unwrap();
    while listed(&lab.path("out")).is_empty() {
        assert_eq!(child.try_wait().unwrap(), None);
        thread::yield_now();
    }
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(1));
    assert_eq!(listed(&lab.path("out")), [""; 0]);
}
