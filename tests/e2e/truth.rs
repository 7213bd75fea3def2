//! Calibration recovers the truth: simulated rigs with different true parameters are measured with the paper's
//! experiments and calibrated by the program `tactus`. The results are compared with the true parameters.
//!
//! `just truth` takes 200 rigs and the paper's sweep, and prints the table of `docs/calibration-evidence.md`. By default
//! the test takes two rigs and a coarse sweep, which show that nothing is broken, not that the intervals are right.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on fails")]
#![expect(clippy::print_stdout, reason = "the table is what `just truth` is for")]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::thread;

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use tactus_e2e::{repository, tactus};
use tactus_runner::embedded::truth;
use tactus_schema::Rig;
use tactus_schema::rig::ElementFault;
use tempfile::TempDir;
use toml::Table;

/// 0.975 quantile of the standard normal distribution.
const Z_95: f64 = 1.96;

/// Number of rigs, and of points along a side of the sweep.
fn extent() -> (u64, u64) {
    let of = |name: &str, default| std::env::var(name).map_or(default, |text| text.parse().unwrap());
    (of("TACTUS_TRUTH_RIGS", 2), of("TACTUS_TRUTH_POINTS", 5))
}

#[test]
fn calibration_recovers_the_true_parameters_of_simulated_rigs() {
    let (rigs, points) = extent();
    let workers = thread::available_parallelism().map_or(1, usize::from) as u64;
    let found: Vec<Found> = thread::scope(|scope| {
        let workers: Vec<_> = (0..workers)
            .map(|first| {
                let seeds = (first..rigs).step_by(usize::try_from(workers).unwrap());
                scope.spawn(move || seeds.map(|seed| measured(seed, points)).collect::<Vec<_>>())
            })
            .collect();
        workers.into_iter().flat_map(|worker| worker.join().unwrap()).collect()
    });
    let tally = Tally::of(&found);
    tally.print(rigs, points);
    assert_eq!((tally.missed, tally.accused), (0, 0), "faults missed, sound elements called faulty");
    for (name, row) in &tally.quantities {
        assert!(row.worst < 5.5, "{name}: {} standard errors off", row.worst);
        if rigs >= 100 {
            assert!((0.90..=0.98).contains(&row.share()), "{name}: {:.3}", row.share());
        }
    }
}

/// Results for one rig: errors of quantities, in units of their standard errors, and counts of faults.
struct Found {
    errors: Vec<(String, f64)>,
    missed: usize,
    accused: usize,
    planted: usize,
}

/// Makes the rig of a seed, runs the experiments, calibrates and compares.
fn measured(seed: u64, points: u64) -> Found {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("rig.toml");
    fs::write(&path, varied(seed)).unwrap();
    let rig = Rig::from_toml(&fs::read_to_string(&path).unwrap()).unwrap();
    let sweep = [format!("points={points}"), format!("spacing_mm={}", 1.4 / (points - 1) as f64)];
    let recordings = [
        run(folder.path(), seed, "corners", &[]),
        run(folder.path(), seed, "element-centres", &[]),
        run(folder.path(), seed, "grid-sweep", &sweep),
    ];
    let mut args = vec!["--json".into(), "calibrate".into()];
    args.extend(recordings.iter().map(|path| path.display().to_string()));
    let said = tactus(folder.path(), &args.iter().map(String::as_str).collect::<Vec<_>>());
    assert!(matches!(said.code, Some(0 | 3)), "rig {seed}: {said:?}");
    compare(&rig, &said.json())
}

fn run(folder: &Path, seed: u64, experiment: &str, parameters: &[String]) -> PathBuf {
    let seed = seed.to_string();
    let mut args = vec![
        "--json",
        "run",
        experiment,
        "--embedded",
        "--no-report",
        "--rig-file",
        "rig.toml",
        "--seed",
        &seed,
    ];
    for parameter in parameters {
        args.extend(["-p", parameter]);
    }
    let said = tactus(folder, &args);
    assert_eq!(said.code, Some(0), "rig {seed}: {said:?}");
    folder.join(said.json()["recording"].as_str().unwrap())
}

/// The shipped simulated rig with other parameters. Its file declares the true spread; registration and surface are off.
fn varied(seed: u64) -> String {
    let text = fs::read_to_string(repository("config/rigs/sim.toml")).unwrap();
    let mut rig: Table = toml::from_str(&text).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut within = |low: f64, high: f64| rng.random_range(low..high);
    let mut put = |path: &[&str], value: toml::Value| {
        let (last, tables) = path.split_last().unwrap();
        let table = tables.iter().fold(&mut rig, |table, name| table[*name].as_table_mut().unwrap());
        table.insert((*last).into(), value);
    };
    put(&["sensitivity_counts_per_mm"], within(500.0, 850.0).into());
    put(&["psf", "sigma_intercept_mm"], within(2.0, 2.5).into());
    put(&["psf", "sigma_per_mm"], within(0.4, 0.6).into());
    put(&["simulation", "seed"], i64::try_from(seed + 1).unwrap().into());
    put(&["simulation", "noise_rms_counts"], within(1.0, 4.0).into());
    put(&["simulation", "gain_spread"], within(0.02, 0.12).into());
    // Either no curvature, or one that is large enough to be estimated.
    let curved = within(0.0, 1.0) > 0.2;
    put(&["simulation", "quadratic_per_mm"], if curved { within(0.05, 0.3) } else { 0.0 }.into());
    put(&["simulation", "surface_mm"], within(-0.05, 0.05).into());
    let origin = toml::Value::Array(vec![within(-0.15, 0.15).into(), within(-0.15, 0.15).into()]);
    put(&["simulation", "registration_error", "origin_mm"], origin);
    put(&["simulation", "registration_error", "rotation_deg"], within(-0.5, 0.5).into());
    for (kind, value) in faults(&mut rng) {
        if kind == "stuck" {
            // Its reading lies far from the baseline, so the rig file has to say that it is faulty.
            let stuck = value.as_array().unwrap().iter().map(|entry| entry["element"].clone()).collect();
            rig["envelope"]
                .as_table_mut()
                .unwrap()
                .insert("unwatched_elements".into(), toml::Value::Array(stuck));
        }
        rig["simulation"].as_table_mut().unwrap().insert(kind.into(), value);
    }
    toml::to_string(&rig).unwrap()
}

/// Up to two of each kind of fault, and up to one stuck element, each on a different element.
fn faults(rng: &mut impl Rng) -> [(&'static str, toml::Value); 4] {
    let mut left: Vec<i64> = (0..48).collect();
    let mut draw = |rng: &mut dyn Rng, most: u32| {
        let count = rng.random_range(0..=most);
        (0..count).map(|_| left.swap_remove(rng.random_range(0..left.len()))).collect::<Vec<_>>()
    };
    let list = |entries: Vec<toml::Value>| toml::Value::Array(entries);
    let entry = |pairs: [(&str, toml::Value); 2]| {
        toml::Value::Table(pairs.into_iter().map(|(name, value)| (name.to_owned(), value)).collect())
    };
    let dead = draw(rng, 2).into_iter().map(toml::Value::from).collect();
    let stuck =
        draw(rng, 1).into_iter().map(|e| entry([("element", e.into()), ("counts", (40 * (e + 1)).into())]));
    let stuck = list(stuck.collect());
    let noisy = draw(rng, 2);
    let noisy = noisy
        .into_iter()
        .map(|e| entry([("element", e.into()), ("noise_rms_counts", (20.0 + e as f64).into())]));
    let noisy = list(noisy.collect());
    let neighbour = |element: i64| if element % 8 < 7 { element + 1 } else { element - 1 };
    let crossed = draw(rng, 2).into_iter();
    let crossed = crossed.map(|e| entry([("element", e.into()), ("answers_for", neighbour(e).into())]));
    [("dead", list(dead)), ("stuck", stuck), ("noisy", noisy), ("miswired", list(crossed.collect()))]
}

fn compare(rig: &Rig, found: &Value) -> Found {
    let truth = truth(rig).unwrap();
    let mut errors = Vec::new();
    let mut hold = |name: &str, estimate: &Value, truth: f64| {
        let [value, error] = ["value", "standard_error"].map(|part| estimate[part].as_f64().unwrap());
        errors.push((name.to_owned(), (value - truth) / error));
    };
    let place = &found["registration"];
    hold("origin x", &place["origin_mm"][0], truth.registration.origin_mm[0]);
    hold("origin y", &place["origin_mm"][1], truth.registration.origin_mm[1]);
    hold("rotation", &place["rotation_deg"], truth.registration.rotation_deg);
    hold("surface", &place["surface_mm"], truth.surface_mm);
    hold("scale", &place["scale"], 1.0);
    let response = truth.model.response();
    for one in found["response"]["elements"].as_array().unwrap() {
        let element = usize::try_from(one["element"].as_u64().unwrap()).unwrap();
        let sensitivity = response.sensitivity_counts_per_mm[element];
        hold("gains", &one["sensitivity_counts_per_mm"], sensitivity);
    }
    hold("curvature", &found["response"]["shared_quadratic_per_mm"], response.quadratic_per_mm[0]);
    let psf = truth.model.psf();
    for covering in found["thickness"]["coverings"].as_array().unwrap() {
        let thickness_mm = covering["covering_mm"].as_f64().unwrap();
        let name = format!("sigma, {thickness_mm:.3} mm");
        hold(&name, &covering["sigma_mm"], psf.sigma_intercept_mm + psf.sigma_per_mm * thickness_mm);
    }
    let line = &found["thickness"]["linear"]["coefficients"];
    hold("intercept", &line[0], psf.sigma_intercept_mm);
    hold("slope", &line[1], psf.sigma_per_mm);

    let accusations: BTreeMap<u64, &Value> = found["health"]["faults"]
        .as_array()
        .unwrap()
        .iter()
        .map(|fault| (fault["element"].as_u64().unwrap(), &fault["kind"]))
        .collect();
    let right = |element: usize, fault: &ElementFault| {
        let Some(kind) = accusations.get(&(element as u64)) else { return false };
        match fault {
            ElementFault::Dead => kind["kind"] == "dead",
            ElementFault::Stuck { counts } => kind["kind"] == "stuck" && kind["counts"] == f64::from(*counts),
            ElementFault::Noisy { .. } => kind["kind"] == "noisy",
            ElementFault::Miswired { answers_for } => {
                kind["kind"] == "cross-wired" && kind["answers_for"] == *answers_for as u64
            }
        }
    };
    let planted = truth.faults.len();
    Found {
        errors,
        missed: truth.faults.iter().filter(|(element, fault)| !right(**element, fault)).count(),
        accused: accusations
            .keys()
            .filter(|element| truth.faults.keys().all(|planted| *planted as u64 != **element))
            .count(),
        planted,
    }
}

/// Results over all rigs.
struct Tally {
    quantities: BTreeMap<String, Coverage>,
    missed: usize,
    accused: usize,
    planted: usize,
}

#[derive(Default)]
struct Coverage {
    intervals: u32,
    covering: u32,
    sum: f64,
    squares: f64,
    worst: f64,
}

impl Coverage {
    fn share(&self) -> f64 {
        f64::from(self.covering) / f64::from(self.intervals)
    }
}

impl Tally {
    fn of(found: &[Found]) -> Self {
        let mut quantities: BTreeMap<String, Coverage> = BTreeMap::new();
        for (name, error) in found.iter().flat_map(|found| &found.errors) {
            let row = quantities.entry(name.clone()).or_default();
            row.intervals += 1;
            row.covering += u32::from(error.abs() <= Z_95);
            row.sum += error;
            row.squares += error * error;
            row.worst = row.worst.max(error.abs());
        }
        let sum = |of: fn(&Found) -> usize| found.iter().map(of).sum();
        Self {
            quantities,
            missed: sum(|found| found.missed),
            accused: sum(|found| found.accused),
            planted: sum(|found| found.planted),
        }
    }

    fn print(&self, rigs: u64, points: u64) {
        println!("{rigs} rigs, sweep of {points} x {points} points, 4 coverings, 3 depths");
        println!(
            "{:<18}{:>10}{:>10}{:>10}{:>10}{:>10}",
            "quantity", "intervals", "covered", "bias", "scatter", "worst"
        );
        for (name, row) in &self.quantities {
            let count = f64::from(row.intervals);
            println!(
                "{name:<18}{:>10}{:>9.1}%{:>10.2}{:>10.2}{:>10.2}",
                row.intervals,
                100.0 * row.share(),
                row.sum / count,
                (row.squares / count).sqrt(),
                row.worst
            );
        }
        println!("bias, scatter and worst are in units of the standard error");
        let Self { planted, missed, accused, .. } = self;
        println!("{planted} faults: {missed} missed or misnamed; {accused} sound elements called faulty");
    }
}
