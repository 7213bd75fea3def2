//! Frames along a path.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use anyhow::{Context, bail};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde_json::json;
use tactus_model::{Contact, Simulator, Trajectory};

use super::drafts;
use super::scene::Scene;
use crate::cli::{Common, SimulateArgs};
use crate::exit::{Exit, Failure, in_words};
use crate::progress::Busy;

/// Limit of frames in one series: ten hours at 30 Hz.
const FRAMES_MAX: f64 = 1_080_000.0;

/// Writes the frames along the path of a CSV file, as CSV or as one JSON object a line.
pub(super) fn write(
    common: &Common,
    args: &SimulateArgs,
    scene: &Scene,
    path: &Path,
) -> anyhow::Result<Exit> {
    let trajectory = read(path)?;
    let rate_hz = rate_hz(args, scene)?;
    let frames = ((trajectory.end_s() - trajectory.start_s()) * rate_hz).floor() + 1.0;
    if frames > FRAMES_MAX {
        bail!("{frames} frames are more than {FRAMES_MAX}: take a shorter path or a lower rate");
    }
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 1 and FRAMES_MAX")]
    let frames = frames as u32;
    let mut rng = ChaCha8Rng::seed_from_u64(args.seed);
    let noise_rms_counts = if args.noise { scene.simulator.noise_rms_counts } else { 0.0 };
    let simulator = Simulator { noise_rms_counts, ..scene.simulator.clone() };
    let images = simulator.run(&trajectory, rate_hz, frames, move || StandardNormal.sample(&mut rng))?;

    let mut out: Box<dyn Write> = match &args.out {
        Some(path) => Box::new(BufWriter::new(
            File::create(path).with_context(|| format!("{} cannot be written", path.display()))?,
        )),
        None => Box::new(BufWriter::new(std::io::stdout().lock())),
    };
    if !common.json {
        let names: Vec<_> = (0..scene.array().elements()).map(|element| format!("e{element}")).collect();
        writeln!(out, "t_s,x_mm,y_mm,z_mm,{}", names.join(","))?;
    }
    // A terminal that gets the frames shows how far they are.
    let busy = Busy::with("simulating", common.json || args.out.is_none());
    let mut deepest: Option<(Contact, Vec<f64>)> = None;
    for (done, image) in images.enumerate() {
        busy.shows(done as f64 / f64::from(frames));
        let [x_mm, y_mm, z_mm] = trajectory.at(image.t_s);
        let counts = if args.noise { image.counts } else { image.clean_counts };
        if deepest.as_ref().is_none_or(|(contact, _)| -z_mm > contact.depth_mm) {
            let contact = Contact { position_mm: [x_mm, y_mm], depth_mm: -z_mm, ..scene.contact.clone() };
            deepest = Some((contact, counts.clone()));
        }
        if common.json {
            let line = json!({
                "t_s": image.t_s, "x_mm": x_mm, "y_mm": y_mm, "z_mm": z_mm, "counts": counts, "simulated": true,
            });
            writeln!(out, "{line}")?;
        } else {
            let counts: Vec<_> = counts.iter().map(f64::to_string).collect();
            writeln!(out, "{},{x_mm},{y_mm},{z_mm},{}", image.t_s, counts.join(","))?;
        }
    }
    out.flush()?;
    drop(busy);
    let notes = deepest.map_or_else(Vec::new, |(contact, counts)| drafts::notes(scene, &contact, &counts));
    for note in notes {
        eprintln!("note: where the tip is deepest: {note}");
    }
    if let Some(path) = &args.out {
        eprintln!("{frames} frames of the simulated sensor in {}", path.display());
    }
    Ok(Exit::Done)
}

/// Frames per second from `--rate-hz`, or the rate of the array.
pub(super) fn rate_hz(args: &SimulateArgs, scene: &Scene) -> anyhow::Result<f64> {
    let rate_hz = args.rate_hz.unwrap_or(scene.array().rate_hz());
    if !(rate_hz.is_finite() && rate_hz > 0.0 && rate_hz <= 1000.0) {
        return Err(Failure::new(
            Exit::Usage,
            format!("--rate-hz must be above 0 and at most 1000, not {rate_hz}"),
        )
        .into());
    }
    Ok(rate_hz)
}

/// Reads a path: a header line `t_s,x_mm,y_mm,z_mm`, then lines of numbers.
pub(super) fn read(path: &Path) -> anyhow::Result<Trajectory> {
    let text = std::fs::read_to_string(path).with_context(|| format!("{} cannot be read", path.display()))?;
    parse(&text).map_err(|error| {
        Failure::new(Exit::Usage, format!("{}: {}", path.display(), in_words(&error))).into()
    })
}

fn parse(text: &str) -> anyhow::Result<Trajectory> {
    let mut lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    match lines.next() {
        Some((_, header)) if header.trim() == "t_s,x_mm,y_mm,z_mm" => {}
        _ => bail!("the first line must be t_s,x_mm,y_mm,z_mm"),
    }
    let points = lines.map(|(index, line)| {
        let numbers: Vec<f64> = line
            .split(',')
            .map(|cell| {
                cell.trim().parse().with_context(|| format!("line {}: {cell:?} is not a number", index + 1))
            })
            .collect::<anyhow::Result<_>>()?;
        match numbers[..] {
            [t_s, x_mm, y_mm, z_mm] => Ok((t_s, [x_mm, y_mm, z_mm])),
            _ => bail!("line {}: {} numbers instead of 4", index + 1, numbers.len()),
        }
    });
    Ok(Trajectory::new(points.collect::<anyhow::Result<Vec<_>>>()?)?)
}

#[cfg(test)]
#[path = "series_tests.rs"]
mod tests;
