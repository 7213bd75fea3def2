//! Writes measurement tables of synthetic rigs, for measurements and for tests of programs in other languages:
//! `cargo run --example synthetic_tables -- DIR RIGS RUNS FRAMES` makes one table for each rig, with so many runs of so many frames.

use std::{env, error::Error, fs, path::Path};

use rand_chacha::{
    ChaCha8Rng,
    rand_core::{Rng as _, SeedableRng as _},
};
use tactus_record::table::TableWriter;
use tactus_schema::{
    Rig,
    table::{Phase, RowView},
};

/// The phases of a press, and how many frames each has.
const PHASES: [(Phase, usize); 6] = [
    (Phase::Idle, 12),
    (Phase::Approach, 6),
    (Phase::Load, 12),
    (Phase::Hold, 18),
    (Phase::Unload, 8),
    (Phase::Retract, 4),
];
const PRESS_FRAMES: usize = 60;
const DEPTH_MM: f64 = 0.5;

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = env::args().skip(1).collect();
    let [folder, rigs, runs, frames] = args.as_slice() else {
        return Err("synthetic_tables DIR RIGS RUNS FRAMES".into());
    };
    fs::create_dir_all(folder)?;
    for rig in 0..rigs.parse()? {
        table(Path::new(folder), rig, runs.parse()?, frames.parse()?)?;
    }
    Ok(())
}

fn table(folder: &Path, nth: u64, runs: usize, frames: usize) -> Result<(), Box<dyn Error>> {
    let mut rig = Rig::from_toml(include_str!("../../config/rigs/sim.toml"))?;
    rig.name = format!("rig-{nth}");
    let mut table = TableWriter::create(folder.join(format!("{}.parquet", rig.name)), &rig.to_json())?;
    let mut random = ChaCha8Rng::seed_from_u64(nth);
    for run in 0..runs {
        let id = format!("202603{:02}-{:06}-rig-{nth}", 1 + run % 28, run / 28);
        let mut counts = vec![0.0; rig.array.elements()];
        for frame in 0..frames {
            let (press, phase, depth_mm) = of_frame(frame);
            let element = press % rig.array.elements();
            let centre_mm = rig.array.centre_mm(element).ok_or("an element has a centre")?;
            for (at, counts) in counts.iter_mut().enumerate() {
                let of = rig.array.centre_mm(at).ok_or("an element has a centre")?;
                let apart_mm2 = (of[0] - centre_mm[0]).powi(2) + (of[1] - centre_mm[1]).powi(2);
                let noise = f64::from(random.next_u32() % 9) - 4.0;
                let rise = 1000.0 * depth_mm * (-apart_mm2 / 15.0).exp();
                #[expect(clippy::cast_possible_truncation, reason = "counts are of single precision")]
                let read = (100.0 + rise + noise).round() as f32;
                *counts = read;
            }
            let [x_mm, y_mm] = rig.registration.to_robot(centre_mm);
            table.push(RowView {
                run: &id,
                press: if phase == Phase::Idle { -1 } else { i32::try_from(press)? },
                phase,
                t_ns: i64::try_from(frame)? * 33_333_333,
                position_mm: [x_mm, y_mm, if depth_mm > 0.0 { -depth_mm } else { 2.0 }],
                covering_mm: rig.covering.thickness_mm,
                indenter: &rig.indenter,
                temperature_c: None,
                counts: &counts,
            })?;
        }
    }
    table.finish()?;
    Ok(())
}

/// Press, phase and depth of a frame.
fn of_frame(frame: usize) -> (usize, Phase, f64) {
    let mut within = frame % PRESS_FRAMES;
    for (phase, frames) in PHASES {
        if within < frames {
            let share = (within + 1) as f64 / frames as f64;
            let depth_mm = match phase {
                Phase::Idle | Phase::Approach | Phase::Retract => 0.0,
                Phase::Load => DEPTH_MM * share,
                Phase::Hold => DEPTH_MM,
                Phase::Unload => DEPTH_MM * (1.0 - share),
            };
            return (frame / PRESS_FRAMES, phase, depth_mm);
        }
        within -= frames;
    }
    (frame / PRESS_FRAMES, Phase::Idle, 0.0)
}
