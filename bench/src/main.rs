//! `tactus-bench`: measurements of the models of discovery and of calibration, which the `bench`, `discovery` and `truth` recipes of `just` run.
#![expect(clippy::print_stdout, reason = "standard output is this program's interface")]

mod evidence_command;
mod rigs_command;
mod truth_command;
mod worker_args;

use std::{path::PathBuf, time::Duration};

use anyhow::Result;
use clap::{Parser, Subcommand};
use evidence_command::EvidenceArgs;
use rigs_command::RigsArgs;
use serde_json::json;
use tactus_bench::{
    Acuity, COVERING, Calibration, Fem, Forward, Growth, Kernel, MachineLimits, Method, Painter, Pose, Sweep,
    Tool, latency, model, poses, serve_devices,
};
use tactus_bus::Endpoint;
use tactus_calibrate::acuity::Grid;
use tactus_model::Array;
use tactus_solid::fem::Bricks;
use truth_command::TruthArgs;

/// Measures speed, accuracy and growth of the models, and how well `tactus discover` works.
#[derive(Debug, Parser)]
#[command(version)]
struct Args {
    #[command(subcommand)]
    part: Part,
}

#[derive(Debug, Subcommand)]
enum Part {
    /// Images per second over many poses, and the greatest error against the exact method.
    Forward {
        /// Array: `digitacts`, `fingertip` or `tekscan-5027`.
        #[arg(long, value_parser = shipped, default_value = "digitacts")]
        array: Array,
        /// Tool.
        #[arg(long, value_enum, default_value = "h")]
        tool: Tool,
        /// Method from pose to image.
        #[arg(long = "path", value_enum, default_value = "press-table")]
        method: Method,
        /// Number of threads.
        #[arg(long, default_value_t = 1)]
        threads: usize,
        /// Time of the measurement in s.
        #[arg(long, default_value_t = 1.0)]
        seconds: f64,
        /// Number of images to compare with the exact method.
        #[arg(long, default_value_t = 200)]
        compared: u32,
        /// Print one JSON object instead of a line of text.
        #[arg(long)]
        json: bool,
    },
    /// An array, its model, 64 poses and their images, as JSON for the peers.
    Scene {
        /// Array: `digitacts`, `fingertip` or `tekscan-5027`.
        #[arg(long, value_parser = shipped, default_value = "digitacts")]
        array: Array,
        /// Tool.
        #[arg(long, value_enum, default_value = "h")]
        tool: Tool,
        /// Method from pose to image.
        #[arg(long = "path", value_enum, default_value = "press-table")]
        method: Method,
    },
    /// Time of both panels of Fig. 6 with 25 x 25 cells, and its growth.
    Acuity {
        /// Print the panels' values and times as one JSON object, without the growth.
        #[arg(long)]
        json: bool,
    },
    /// The finite element model of the covering under 1 N at the middle of its top: cubes of 1 mm, sides on rollers.
    Fem {
        /// Bricks along a side.
        #[arg(long, default_value_t = 100)]
        across: u32,
        /// Layers of bricks.
        #[arg(long, default_value_t = 10)]
        layers: u32,
        /// Poisson's ratio of the bricks.
        #[arg(long, default_value_t = 0.45)]
        poisson_ratio: f64,
        /// Integrate the bricks in full, without mean dilatation.
        #[arg(long)]
        full: bool,
        /// Print one JSON object, with the force at every node of the bottom, instead of a line of text.
        #[arg(long)]
        json: bool,
    },
    /// Time of a calibration from recordings: reading, the whole, and without the sweeps that the spreads are fitted to.
    Calibrate {
        /// Recordings to read.
        #[arg(required = true)]
        files: Vec<PathBuf>,
        /// Print one JSON object, with the images of the sweeps, instead of a line of text.
        #[arg(long)]
        json: bool,
    },
    /// Growth of the time of an image with elements and triangles, and of the finite elements with bricks.
    Growth,
    /// Share of this machine's arithmetic and bandwidth that the kernels use.
    Limits,
    /// Prints a line when it is ready, hears so many frames of a service, and prints each one's number and when it was heard.
    Hear {
        /// The service, or the relay.
        endpoint: Endpoint,
        /// Number of frames.
        frames: usize,
        /// Hear what `relay` publishes, with zenoh alone.
        #[arg(long)]
        bare: bool,
        /// Hear from a subscription's queue instead of in a callback.
        #[arg(long, conflicts_with = "bare")]
        queued: bool,
    },
    /// Publishes the frames that come from a terminal with zenoh alone, until the terminal closes.
    Relay {
        /// The terminal.
        device: PathBuf,
        /// Where to listen.
        endpoint: Endpoint,
    },
    /// How many rigs one service carries: memory of a rig, processor time of a frame, frames lost.
    Rigs(RigsArgs),
    /// Serves the devices of so many rigs at sockets of loopback, for `peers/capacity.py`: prints the sensors' addresses as JSON, and ends with its
    /// standard input.
    Devices {
        /// Number of rigs.
        rigs: usize,
    },
    /// How well `tactus discover` finds and names hidden physics.
    Evidence(EvidenceArgs),
    /// How well `tactus calibrate` recovers the parameters of simulated rigs; continues an interrupted run. Workers that have the same folder
    /// share the rigs.
    Truth(TruthArgs),
}

fn main() -> Result<()> {
    match Args::parse().part {
        Part::Forward { array, tool, method, threads, seconds, compared, json } => {
            let time = Duration::try_from_secs_f64(seconds)?;
            forward(&Forward::measure(&array, tool, method, threads, time, compared)?, json);
        }
        Part::Scene { array, tool, method } => scene(array, tool, method)?,
        Part::Calibrate { files, json } => calibrate(&Calibration::measure(&files, 5)?, json),
        Part::Acuity { json } => acuity(json)?,
        Part::Fem { across, layers, poisson_ratio, full, json } => {
            let bricks = Bricks::cubes(across, layers, 1.0, poisson_ratio)?;
            fem(&Fem::measure(if full { bricks.integrated_in_full() } else { bricks }), json);
        }
        Part::Growth => growth(&Growth::measure()?),
        Part::Limits => limits(&MachineLimits::measure()?),
        Part::Hear { endpoint, frames, bare, queued } => {
            let hear = match (bare, queued) {
                (true, _) => latency::hear_bare,
                (false, true) => latency::hear_queued,
                (false, false) => latency::hear,
            };
            println!("{}", serde_json::to_string(&hear(&endpoint, frames, ready)?)?);
        }
        Part::Relay { device, endpoint } => latency::relay(&device, &endpoint, ready)?,
        Part::Devices { rigs } => {
            let devices = serve_devices(rigs)?;
            println!("{}", json!(devices.sensors()));
            std::io::copy(&mut std::io::stdin(), &mut std::io::sink())?;
        }
        Part::Rigs(args) => args.run()?,
        Part::Evidence(args) => args.run()?,
        Part::Truth(args) => args.run()?,
    }
    Ok(())
}

fn ready() {
    println!("ready");
}

fn shipped(name: &str) -> Result<Array, String> {
    let named = Array::shipped().into_iter().find(|array| array.name() == name);
    named.ok_or_else(|| "expected digitacts, fingertip or tekscan-5027".into())
}

fn forward(measured: &Forward, as_json: bool) {
    let Forward { array, tool, method, threads, ready_s, images_per_s, error } = measured;
    let (rows, cols) = (array.rows(), array.cols());
    let [tool, method] = [format!("{tool:?}"), format!("{method:?}")].map(|name| name.to_lowercase());
    if as_json {
        let line = json!({
            "array": array.name(), "rows": rows, "cols": cols, "tool": tool, "path": method, "threads": threads,
            "ready_s": ready_s, "images_per_s": images_per_s, "error": error,
            "version": env!("CARGO_PKG_VERSION"),
        });
        println!("{line}");
    } else {
        let within = error.map(|error| format!(", within {error:.1e} of the peak")).unwrap_or_default();
        println!(
            "{} ({rows} x {cols}), {tool}, {method}, {threads} threads: {images_per_s:.0} images/s, ready in {:.1} ms{within}",
            array.name(),
            ready_s * 1e3
        );
    }
}

fn scene(array: Array, tool: Tool, method: Method) -> Result<()> {
    const POSES: u32 = 64;
    let model = model(array)?;
    let array = model.array();
    let mut painter = Painter::new(method, &model, &tool.indenter())?;
    let mut images = Vec::new();
    let mut image = vec![0.0; array.elements()];
    let poses = poses(array, POSES);
    for pose in &poses {
        painter.image(pose, &mut image)?;
        images.push(image.clone());
    }
    let poses = poses.iter().map(|Pose { position_mm, rotation_deg, depth_mm }| {
        json!({ "position_mm": position_mm, "rotation_deg": rotation_deg, "depth_mm": depth_mm })
    });
    let scene = json!({
        "col_centres_mm": array.col_centres_mm(),
        "row_centres_mm": array.row_centres_mm(),
        "element_mm": array.element_mm(),
        "sigma_mm": model.psf().sigma_mm(COVERING),
        "sensitivity_counts_per_mm": model.response().sensitivity_counts_per_mm.first(),
        "quadratic_per_mm": model.response().quadratic_per_mm.first(),
        "poses": poses.collect::<Vec<_>>(),
        "images": images,
    });
    println!("{scene}");
    Ok(())
}

fn calibrate(measured: &Calibration, as_json: bool) {
    let Calibration { presses, read_s, whole_s, without_sweeps_s, sweeps } = measured;
    if as_json {
        let sweeps = sweeps.iter().map(|sweep| {
            let Sweep { covering_mm, depth_mm, sigma_mm, centres_mm, places_mm, images_mm } = sweep;
            json!({
                "covering_mm": covering_mm, "depth_mm": depth_mm, "sigma_mm": sigma_mm, "centres_mm": centres_mm,
                "places_mm": places_mm, "images_mm": images_mm,
            })
        });
        let line = json!({
            "presses": presses, "read_s": read_s, "whole_s": whole_s, "without_sweeps_s": without_sweeps_s,
            "sweeps": sweeps.collect::<Vec<_>>(), "version": env!("CARGO_PKG_VERSION"),
        });
        println!("{line}");
    } else {
        println!(
            "{presses} presses: read in {read_s:.2} s, calibrated in {whole_s:.3} s, without the sweeps in {without_sweeps_s:.3} s"
        );
    }
}

fn acuity(as_json: bool) -> Result<()> {
    const TIMES: usize = 5;
    let Acuity { grid, locations, separations, panels_s: [one_s, other_s] } =
        Acuity::measure(Grid::whole(), TIMES)?;
    if as_json {
        let panels = json!({
            "sigmas": grid.sigmas, "force_resolutions": grid.force_resolutions, "locations": locations,
            "separations": separations, "panels_s": [one_s, other_s], "version": env!("CARGO_PKG_VERSION"),
        });
        println!("{panels}");
    } else {
        println!("Fig. 6, 25 x 25: locations {:.1} ms, separations {:.1} ms", one_s * 1e3, other_s * 1e3);
        growth(&Acuity::growth(TIMES)?);
    }
    Ok(())
}

fn fem(measured: &Fem, as_json: bool) {
    let Fem { bricks, solve_s, reaction } = measured;
    let sigma_mm = reaction.gaussian_sigma_mm();
    if as_json {
        let line = json!({
            "solve_s": solve_s, "sigma_mm": sigma_mm, "forces": reaction.forces(), "version": env!("CARGO_PKG_VERSION"),
        });
        println!("{line}");
    } else {
        let (across, layers) = (bricks.across(), bricks.layers());
        println!(
            "{across} x {across} x {layers} bricks: {:.2} ms, sigma = {sigma_mm:.4} bricks",
            solve_s * 1e3
        );
    }
}

fn growth(growths: &[Growth]) {
    for growth in growths {
        println!("{}: time ~ {}^{:.2}", growth.what, growth.size_of, growth.exponent());
        for [size, time_s] in &growth.points {
            println!("  {size:>6.0} {:>12.3} us", time_s * 1e6);
        }
    }
}

fn limits(limits: &MachineLimits) {
    let MachineLimits { flops_per_s, bytes_per_s: [first, second, memory], kernels } = limits;
    println!("one core, as compiled: {:.1} Gflop/s single precision", flops_per_s / 1e9);
    println!(
        "reading: {:.0} GB/s first cache, {:.0} second, {:.1} memory",
        first / 1e9,
        second / 1e9,
        memory / 1e9
    );
    println!(
        "press table, an image: flops = n (44 C + 41), bytes = n (64 C + 24), n elements reached, C = 3 (h), 1 (cylinder)"
    );
    println!(
        "{:<14}{:<10}{:>10}{:>10}{:>9}{:>12}{:>14}",
        "array", "tool", "flops", "bytes", "us", "of flops", "of 2nd cache"
    );
    for Kernel { array, tool, flops, bytes, image_s } in kernels {
        println!(
            "{array:<14}{:<10}{flops:>10.0}{bytes:>10.0}{:>9.2}{:>11.0}%{:>13.0}%",
            format!("{tool:?}").to_lowercase(),
            image_s * 1e6,
            100.0 * flops / image_s / flops_per_s,
            100.0 * bytes / image_s / second
        );
    }
}
