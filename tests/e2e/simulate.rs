//! The simulator on the command line: images, frames along a path, live frames on the bus, and bad input.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on fails")]

use std::fs;
use std::path::Path;

use serde_json::Value;
use tactus_e2e::{Process, free_endpoint, repository, tactus};
use tempfile::TempDir;

fn simulate(folder: &Path, args: &[&str]) -> Value {
    let said = tactus(folder, &[&["--json", "simulate"], args].concat());
    assert_eq!(said.code, Some(0), "{said:?}");
    said.json()
}

/// Rows of counts.
fn image(value: &Value) -> Vec<Vec<f64>> {
    let row = |row: &Value| row.as_array().unwrap().iter().map(|count| count.as_f64().unwrap()).collect();
    value.as_array().unwrap().iter().map(row).collect()
}

fn assert_close(one: &[Vec<f64>], other: &[Vec<f64>], within: f64) {
    let pairs = one.iter().flatten().zip(other.iter().flatten());
    let worst = pairs.map(|(one, other)| (one - other).abs()).fold(0.0, f64::max);
    assert!(worst <= within, "{worst} apart");
}

#[test]
fn the_h_gives_an_image_and_a_picture() {
    let folder = TempDir::new().unwrap();
    let args = ["--scene", "h", "--array", "digitacts", "--angle-deg", "30", "--covering-mm", "1.016"];
    let args = [&args[..], &["--depth-mm", "0.3", "--out", "h.png"]].concat();
    let told = simulate(folder.path(), &args);
    assert_eq!(
        (&told["simulated"], &told["array"]["rows"], &told["array"]["cols"]),
        (&true.into(), &6.into(), &8.into())
    );
    assert!((told["sigma_mm"].as_f64().unwrap() / 2.0 - 1.36).abs() < 0.005, "Eq. 4 in pitches of 2.0 mm");
    let counts = image(&told["image"]);
    assert_eq!((counts.len(), counts[0].len()), (6, 8));
    // The H and the array are symmetric under a half turn.
    let turned: Vec<Vec<f64>> = counts.iter().rev().map(|row| row.iter().rev().copied().collect()).collect();
    assert_close(&counts, &turned, 1e-6);
    assert!(fs::read(folder.path().join("h.png")).unwrap().starts_with(b"\x89PNG\r\n\x1a\n"));
}

#[test]
fn the_shipped_mesh_files_are_the_scenes() {
    let folder = TempDir::new().unwrap();
    for scene in ["h", "wrench", "spaceship"] {
        let file = repository(&format!("assets/{scene}.stl")).display().to_string();
        let made = simulate(folder.path(), &["--scene", scene, "--angle-deg", "20"]);
        let loaded = simulate(folder.path(), &["--scene", &file, "--angle-deg", "20"]);
        assert_close(&image(&made["image"]), &image(&loaded["image"]), 1e-6);
    }
}

#[test]
fn a_reference_press_reads_sensitivity_times_depth() {
    let folder = TempDir::new().unwrap();
    let told = simulate(
        folder.path(),
        &["--scene", "cylinder", "--x-mm", "2.9", "--y-mm", "4.9", "--depth-mm", "0.4"],
    );
    let counts = image(&told["image"]);
    assert!((counts[2][1] - (100.0 + 1000.0 * 0.4)).abs() < 1e-6, "{}", counts[2][1]);
}

#[test]
fn copies_have_the_same_characterisation_and_each_its_own_noise() {
    let folder = TempDir::new().unwrap();
    let clean = image(&simulate(folder.path(), &["--scene", "cylinder"])["image"]);
    let told =
        simulate(folder.path(), &["--scene", "cylinder", "--noise", "--copies", "3", "--out", "reading.csv"]);
    let copies: Vec<_> = told["copies"].as_array().unwrap().iter().map(image).collect();
    assert_eq!(copies.len(), 3);
    for copy in &copies {
        // Noise of 2 counts: nine standard deviations, plus half a step.
        assert_close(copy, &clean, 18.5);
        assert!(copy.iter().flatten().all(|counts| counts.fract() == 0.0), "whole steps");
    }
    assert!(copies[0] != copies[1] && copies[1] != copies[2]);
    let again = simulate(folder.path(), &["--scene", "cylinder", "--noise", "--copies", "3"]);
    assert_eq!(again["copies"], told["copies"], "a seed's noise is its own");
    let file = fs::read_to_string(folder.path().join("reading-3.csv")).unwrap();
    let read: Vec<Vec<f64>> =
        file.lines().map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect()).collect();
    assert_eq!(read, copies[2]);
}

#[test]
fn a_models_characterisation_goes_to_another_array() {
    let folder = TempDir::new().unwrap();
    let model = repository("config/models/digitacts.toml").display().to_string();
    let args = ["--model", model.as_str(), "--scene", "cylinder", "--depth-mm", "0.2"];
    let own = simulate(folder.path(), &args);
    let finer = simulate(folder.path(), &[&args[..], &["--array", "tekscan-5027"]].concat());
    assert_eq!(own["sigma_mm"], finer["sigma_mm"], "the covering spreads as it did");
    assert_eq!((image(&own["image"]).len(), image(&finer["image"]).len()), (6, 26));
    // A sensor that the paper did not characterise has a spread of one element width, as in its Fig. 10.
    let bare = simulate(folder.path(), &["--scene", "cylinder", "--array", "tekscan-5027"]);
    assert!((bare["sigma_mm"].as_f64().unwrap() - 10.0 / 248_f64.sqrt()).abs() < 1e-12);
}

#[test]
fn frames_follow_a_path() {
    let folder = TempDir::new().unwrap();
    // Down onto the centre of element 17 within a second.
    fs::write(folder.path().join("path.csv"), "t_s,x_mm,y_mm,z_mm\n0,2.9,4.9,0.1\n1,2.9,4.9,-0.4\n").unwrap();
    let args = ["simulate", "--scene", "cylinder", "--trajectory", "path.csv", "--rate-hz", "10"];
    let said = tactus(folder.path(), &args);
    assert_eq!(said.code, Some(0), "{said:?}");
    let lines: Vec<_> = said.out.lines().collect();
    assert_eq!(lines.len(), 1 + 11);
    assert!(lines[0].starts_with("t_s,x_mm,y_mm,z_mm,e0,"));
    for (frame, line) in lines[1..].iter().enumerate() {
        let numbers: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        let depth = (0.05 * frame as f64 - 0.1).max(0.0);
        assert!((numbers[0] - 0.1 * frame as f64).abs() < 1e-9);
        assert!(
            (numbers[4 + 17] - (100.0 + 1000.0 * depth)).abs() < 1e-6,
            "frame {frame}: {}",
            numbers[4 + 17]
        );
    }
}

#[test]
fn a_model_with_knots_gives_what_they_say_along_a_path() {
    let folder = TempDir::new().unwrap();
    let effect = "\n[[effect]]\nname = \"hardening\"\nparameters = { own_share = 0.0 }\n\
                  knots = { at_mm = [0.2, 0.4], growth = [0.0, 0.3] }\n";
    let shipped = fs::read_to_string(repository("config/models/digitacts.toml")).unwrap();
    fs::write(folder.path().join("model.toml"), shipped + effect).unwrap();
    fs::write(folder.path().join("path.csv"), "t_s,x_mm,y_mm,z_mm\n0,2.9,4.9,0.1\n1,2.9,4.9,-0.5\n").unwrap();
    let args = ["simulate", "--model", "model.toml", "--scene", "cylinder", "--trajectory", "path.csv"];
    let said = tactus(folder.path(), &[&args[..], &["--rate-hz", "10"]].concat());
    assert_eq!(said.code, Some(0), "{said:?}");
    for (frame, line) in said.out.lines().skip(1).enumerate() {
        let counts: f64 = line.split(',').nth(4 + 17).unwrap().parse().unwrap();
        let depth_mm = (0.06 * frame as f64 - 0.1).max(0.0);
        // Nothing up to 0.2 mm, and from 0.4 mm on three tenths more.
        let growth = (1.5 * (depth_mm - 0.2)).clamp(0.0, 0.3);
        let want = 100.0 + 1000.0 * depth_mm * (1.0 + growth);
        assert!((counts - want).abs() < 1e-6, "frame {frame}: {counts} {want}");
    }
    assert_eq!(said.out.lines().count(), 1 + 11);
    let falling =
        fs::read_to_string(folder.path().join("model.toml")).unwrap().replace("[0.0, 0.3]", "[0.3, 0.0]");
    fs::write(folder.path().join("falling.toml"), falling).unwrap();
    let said = tactus(folder.path(), &["simulate", "--model", "falling.toml", "--scene", "cylinder"]);
    let error = "falling.toml: effect[0]: hardening: knots.growth[1] must be at least 0.15, so that it times the place does not fall, not 0";
    assert!(said.code != Some(0) && said.err.contains(error), "{said:?}");
}

#[test]
fn live_frames_come_like_a_real_sensors() {
    let folder = TempDir::new().unwrap();
    let endpoint = free_endpoint();
    let args = ["--endpoint", &endpoint, "simulate", "--live", "--scene", "h", "--rate-hz", "200"];
    let mut sensor = Process::start("tactus", folder.path(), &args);
    sensor.wait_for("simulated sensor");
    let mut viewer = Process::start("tactus", folder.path(), &["--endpoint", &endpoint, "watch", "--json"]);
    let mut seqs = Vec::new();
    let mut pressed = false;
    while seqs.len() < 300 || !pressed {
        let frame: Value = serde_json::from_str(&viewer.wait_until(|line| line.starts_with('{'))).unwrap();
        assert_eq!(frame["simulated"], true);
        let counts = frame["counts"].as_array().unwrap();
        assert_eq!(counts.len(), 48);
        pressed |= counts.iter().any(|count| count.as_f64().unwrap() > 500.0);
        seqs.push((frame["seq"].as_u64().unwrap(), frame["lost_before"].as_u64().unwrap()));
    }
    for pair in seqs.windows(2) {
        assert_eq!(pair[1].0, pair[0].0 + 1 + pair[1].1, "what is missing is told");
    }
    // It is a sensor, not a service.
    let said = tactus(folder.path(), &["--endpoint", &endpoint, "run", "element-centres"]);
    assert_eq!(said.code, Some(1), "{said:?}");
    assert!(said.err.contains("simulate --live"), "{}", said.err);
    sensor.signal(rustix::process::Signal::INT);
    let (code, text) = sensor.wait();
    assert_eq!(code, Some(0), "{text}");
}

#[test]
fn what_cannot_be_simulated_is_refused_with_what_to_do() {
    let folder = TempDir::new().unwrap();
    let write = |name: &str, bytes: &[u8]| fs::write(folder.path().join(name), bytes).unwrap();
    let mut endless = vec![b' '; 80];
    endless.extend(u32::MAX.to_le_bytes());
    write("endless.stl", &endless);
    write("empty.stl", b"");
    write("flat.obj", b"v 0 0 0\nv 0 0 1\nv 0 1 0\nf 1 2 3\n");
    write("metres.obj", b"v 0 0 0\nv 5000 0 0\nv 0 1 0\nf 1 2 3\n");
    write("nan.obj", b"v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n");
    write("path.csv", b"t_s,x_mm,y_mm,z_mm\n0,0,0,0\n0,1,1,1\n");
    write("model.toml", b"schema = \"tactus.model/1\"\n[base]\nnoise = 1\n");
    for (args, word) in [
        (&["--scene", "teapot"][..], "no scene \"teapot\""),
        (&["--scene", "endless.stl"], "endless.stl: the file is not a sound STL file"),
        (&["--scene", "empty.stl"], "empty.stl"),
        (&["--scene", "flat.obj"], "seen from below"),
        (&["--scene", "metres.obj"], "are its units millimetres?"),
        (&["--scene", "nan.obj"], "nan.obj"),
        (&["--array", "retina"], "digitacts, fingertip, tekscan-5027"),
        (&["--depth-mm", "nan"], "finite"),
        (&["--covering-mm", "0"], "--covering-mm"),
        (&["--scene", "cone", "--apex-deg", "180"], "--apex-deg"),
        (&["--scene", "box", "--size-mm", "3"], "--size-mm"),
        (&["--scene", "sphere", "--roll-deg", "3"], "only a mesh"),
        (&["--scene", "h", "--roll-deg", "nan"], "not finite"),
        (&["--model", "model.toml"], "noise"),
        (&["--model", "missing.toml"], "missing.toml"),
        (&["--trajectory", "path.csv"], "times must rise"),
        (&["--live", "--rate-hz", "2000"], "--rate-hz"),
        (&["--live", "--seconds", "nan"], "--seconds"),
        (&["--live", "--rig", "a/b"], "letters, digits"),
        (&["--scene", "."], "its name must end in .stl, .obj or .ply"),
        (&["--out", "image.jpeg"], ".png or .csv"),
        (&["--gpu"], "GPU"),
    ] {
        let said = tactus(folder.path(), &[&["simulate"], args].concat());
        assert!(matches!(said.code, Some(1 | 2)), "{args:?}: {said:?}");
        assert!(said.err.contains(word) && !said.err.contains("panicked"), "{args:?}: {}", said.err);
    }
}

/// No part of a tool is deeper in the covering than that is thick.
#[test]
fn a_tool_below_the_covering_is_said_to_be() {
    let folder = tempfile::tempdir().unwrap();
    for (depth_mm, is_below) in [("1.0", false), ("1.1", true)] {
        let args = ["simulate", "--scene", "sphere", "--covering-mm", "1.016", "--depth-mm", depth_mm];
        let said = tactus(folder.path(), &args);
        assert_eq!(said.code, Some(0), "{said:?}");
        let note = "deeper than the covering: what is below it presses as if 1.016 mm deep";
        assert_eq!(said.out.contains(note), is_below, "{depth_mm}: {}", said.out);
    }
}

#[test]
fn the_papers_figures_are_drawn() {
    let folder = TempDir::new().unwrap();
    let said = tactus(folder.path(), &["--json", "figures", "--out", "figures"]);
    assert_eq!(said.code, Some(0), "{said:?}");
    let files: Vec<_> = said.json()["files"]
        .as_array()
        .unwrap()
        .iter()
        .map(|file| file.as_str().unwrap().to_owned())
        .collect();
    assert_eq!(files.len(), 11);
    for file in files {
        let text = fs::read_to_string(folder.path().join(&file)).unwrap();
        assert!(text.contains("<svg") && text.contains("imulated") | !file.ends_with("html"), "{file}");
    }
}
