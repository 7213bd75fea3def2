//! `simulate`: simulates what a sensor reads from a tool: an image, frames along a path, or live frames on the bus.

mod drafts;
mod live;
mod picture;
mod scene;
mod series;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde_json::json;
use tactus_model::{Array, Contact, Readout};

use crate::cli::{Common, SimulateArgs};
use crate::exit::Exit;
use crate::output::{self, print_fields};
use scene::Scene;

pub(crate) fn simulate(common: &Common, args: &SimulateArgs) -> anyhow::Result<Exit> {
    let scene = Scene::of(args)?;
    match (&args.trajectory, args.live) {
        (trajectory, true) => live::publish(common, args, &scene, trajectory.as_deref()),
        (Some(trajectory), false) => series::write(common, args, &scene, trajectory),
        (None, false) => image(common, args, &scene),
    }
}

/// One image of the tool at rest.
fn image(common: &Common, args: &SimulateArgs, scene: &Scene) -> anyhow::Result<Exit> {
    let (clean_counts, computed_by) =
        if args.gpu { scene.gpu_image()? } else { (scene.image()?, "cpu".into()) };
    let array = scene.array();
    let copies: Vec<Vec<f64>> = (0..args.copies)
        .map(|copy| {
            if args.noise {
                read(scene, &clean_counts, args.seed.wrapping_add(u64::from(copy)))
            } else {
                clean_counts.clone()
            }
        })
        .collect();
    if let Some(out) = &args.out {
        picture::write(out, array, &copies)?;
    }
    if common.json {
        output::write(&format!("{}\n", to_json(args, scene, &copies, &computed_by)))?;
    } else {
        print(args, scene, &copies, &computed_by)?;
    }
    Ok(Exit::Done)
}

/// Adds the sensor's noise and applies the converter.
fn read(scene: &Scene, clean_counts: &[f64], seed: u64) -> Vec<f64> {
    let readout = Readout::of(scene.array());
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut noise = || {
        let deviate: f64 = StandardNormal.sample(&mut rng);
        scene.simulator.noise_rms_counts * deviate
    };
    clean_counts.iter().map(|counts| readout.read(*counts, noise())).collect()
}

fn rows<'a>(array: &Array, image: &'a [f64]) -> Vec<&'a [f64]> {
    image.chunks(array.cols()).collect()
}

fn to_json(args: &SimulateArgs, scene: &Scene, copies: &[Vec<f64>], computed_by: &str) -> serde_json::Value {
    let array = scene.array();
    let Contact { position_mm: [x_mm, y_mm], rotation_deg, depth_mm, .. } = scene.contact;
    json!({
        "simulated": true,
        "scene": args.scene,
        "array": { "name": array.name(), "rows": array.rows(), "cols": array.cols() },
        "x_mm": x_mm,
        "y_mm": y_mm,
        "angle_deg": rotation_deg,
        "depth_mm": depth_mm,
        "covering_mm": scene.simulator.covering.thickness_mm,
        "sigma_mm": scene.sigma_mm(),
        "noise": args.noise,
        "computed_by": computed_by,
        "effects": drafts::effects(scene),
        "notes": notes(scene, copies),
        "unit": "counts",
        "image": copies.first().map(|image| rows(array, image)),
        "copies": (copies.len() > 1).then(|| copies.iter().map(|image| rows(array, image)).collect::<Vec<_>>()),
        "out": args.out,
    })
}

/// Where the scene leaves what the model's drafts were drafted from.
fn notes(scene: &Scene, copies: &[Vec<f64>]) -> Vec<String> {
    copies.first().map_or_else(Vec::new, |counts| drafts::notes(scene, &scene.contact, counts))
}

fn print(args: &SimulateArgs, scene: &Scene, copies: &[Vec<f64>], computed_by: &str) -> anyhow::Result<()> {
    let array = scene.array();
    let Contact { position_mm: [x_mm, y_mm], rotation_deg, depth_mm, .. } = scene.contact;
    let thickness_mm = scene.simulator.covering.thickness_mm;
    let mut fields = vec![
        ("scene", format!("{} (simulated, {computed_by})", args.scene)),
        ("array", format!("{}, {} rows of {}", array.name(), array.rows(), array.cols())),
        ("tool", format!("at {x_mm:.2}, {y_mm:.2} mm, {rotation_deg} degrees, {depth_mm} mm deep")),
        ("covering", format!("{thickness_mm} mm, sigma {:.3} mm", scene.sigma_mm())),
    ];
    let effects = drafts::effects(scene);
    if !effects.is_empty() {
        fields.push(("effects", effects.join(", ")));
    }
    fields.extend(notes(scene, copies).into_iter().map(|note| ("note", note)));
    if depth_mm > thickness_mm {
        let note = format!("deeper than the covering: what is below it presses as if {thickness_mm} mm deep");
        fields.push(("note", note));
    }
    let range_counts = array.least_counts()..=array.full_scale_counts();
    let beyond = copies.iter().flatten().filter(|counts| !range_counts.contains(counts)).count();
    if beyond > 0 {
        fields.push((
            "note",
            format!(
                "{beyond} values are beyond the converter's {} to {}; --noise reads them",
                range_counts.start(),
                range_counts.end()
            ),
        ));
    }
    if let Some(out) = &args.out {
        fields.push(("written", out.display().to_string()));
    }
    print_fields(&fields);
    let images: Vec<_> = copies.iter().map(|image| format!("\n{}", in_numbers(array, image))).collect();
    let widest = images.iter().flat_map(|image| image.lines()).map(str::len).max().unwrap_or(0);
    match output::terminal_columns() {
        Some(columns) if widest > columns => {
            let images = copies.iter().map(|image| format!("\n{}", in_shades(array, image)));
            output::write(&images.collect::<String>())?;
            output::say("\nThe counts of a row do not fit here; --out FILE.csv or --json has them.");
            Ok(())
        }
        _ => output::write(&images.concat()),
    }
}

/// The counts, row 0 last, because y points up.
fn in_numbers(array: &Array, image: &[f64]) -> String {
    let line = |row: &&[f64]| {
        let cells: Vec<_> = row.iter().map(|counts| format!("{counts:5.0}")).collect();
        format!("{}\n", cells.join(" "))
    };
    rows(array, image).iter().rev().map(line).collect()
}

/// Shades from the least to the greatest counts, row 0 last.
fn in_shades(array: &Array, image: &[f64]) -> String {
    let [least, most] = image.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], counts| {
        [least.min(*counts), most.max(*counts)]
    });
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 0 and 4")]
    let shade = |counts: &f64| {
        let share = if most > least { (counts - least) / (most - least) } else { 0.0 };
        ["  ", "░░", "▒▒", "▓▓", "██"][(4.0 * share).round() as usize]
    };
    let line = |row: &&[f64]| format!("{}\n", row.iter().map(shade).collect::<String>().trim_end());
    rows(array, image).iter().rev().map(line).collect()
}
