//! `design`: recommends a covering for a pitch and a force resolution.

use std::fs;
use std::path::Path;

use anyhow::Context;
use serde_json::json;
use tactus_calibrate::acuity::NYQUIST_SIGMA;
use tactus_calibrate::design::{Acuity, Covered, Design, Reason, Wanted};
use tactus_model::{DIGITACTS_PITCH_MM, Psf};
use tactus_report::figures::trade_off;
use tactus_schema::model::Model;

use crate::cli::{Common, DesignArgs};
use crate::exit::{Exit, Failure};
use crate::output::{self, print_fields, print_table, say};

pub(crate) fn design(common: &Common, args: &DesignArgs) -> anyhow::Result<Exit> {
    let form = args.out.as_deref().map(Form::of).transpose()?;
    let (psf, own_pitch_mm) = match &args.model {
        Some(path) => measured(path)?,
        None => (Psf::PAPER, DIGITACTS_PITCH_MM),
    };
    let wanted = Wanted {
        pitch_mm: args.pitch_mm.unwrap_or(own_pitch_mm),
        force_steps: args.force_steps,
        min_sigma: args.min_sigma.unwrap_or(NYQUIST_SIGMA),
        psf,
    };
    let design = wanted.design().map_err(|error| Failure::new(Exit::Usage, error))?;
    if let Some((out, form)) = args.out.as_ref().zip(form) {
        fs::write(out, form.text(&design)).with_context(|| format!("{} cannot be written", out.display()))?;
    }
    let notes = notes(&design, &wanted, own_pitch_mm);
    if common.json {
        let mut said = serde_json::to_value(&design)?;
        said["force_resolution"] = json!(1.0 / f64::from(design.force_steps));
        said["notes"] = json!(notes);
        said["out"] = json!(args.out);
        output::write(&format!("{said}\n"))?;
    } else {
        print(&design, &notes);
        if let Some(out) = &args.out {
            say(&format!("\n{}", out.display()));
        }
    }
    Ok(Exit::Done)
}

/// File format of the curve.
#[derive(Clone, Copy)]
enum Form {
    Svg,
    Html,
}

impl Form {
    fn of(out: &Path) -> Result<Self, Failure> {
        match out.extension().and_then(|extension| extension.to_str()) {
            Some("svg") => Ok(Self::Svg),
            Some("html") => Ok(Self::Html),
            _ => {
                let problem = format!("--out {}: write the curve to a .svg or .html file", out.display());
                Err(Failure::new(Exit::Usage, problem))
            }
        }
    }

    fn text(self, design: &Design) -> String {
        let sheet = trade_off(design);
        match self {
            Self::Svg => sheet.to_string(),
            Self::Html => format!(
                "<!DOCTYPE html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n<title>Which covering</title>\n{sheet}\n</html>\n"
            ),
        }
    }
}

/// Spread and pitch of a calibrated sensor.
fn measured(path: &Path) -> anyhow::Result<(Psf, f64)> {
    let text = fs::read_to_string(path).with_context(|| format!("{} cannot be read", path.display()))?;
    let model = Model::from_toml(&text)
        .map_err(|error| Failure::new(Exit::Usage, format!("{}: {error}", path.display())))?;
    Ok((model.base.psf, model.base.array.pitch_mm()))
}

fn print(design: &Design, notes: &[String]) {
    let Design { pitch_mm, force_steps, recommended, .. } = design;
    let acuity = |acuity: &Acuity| {
        format!(
            "spread {:.2} pitches: {} locations in an element, two points {}",
            acuity.sigma,
            acuity.locations,
            apart(acuity)
        )
    };
    print_fields(&[
        ("for", format!("elements {pitch_mm} mm apart, {force_steps} force steps in a press")),
        ("best to locate", acuity(&design.best_for_locating)),
        ("best for two points", acuity(&design.best_for_two_points)),
        ("no aliasing from", format!("spread {:.3} pitches (3/pi)", design.nyquist_sigma)),
        ("least spread wanted", format!("{:.3} pitches", design.min_sigma)),
        (
            "thickness for that",
            match design.wanted_thickness_mm {
                Some(t) if t < 0.0 => format!("none: Eq. 4 gives {t:.2} mm"),
                Some(t) => format!("{t:.2} mm by Eq. 4"),
                None => "any: the spread does not depend on it".into(),
            },
        ),
        (
            "recommended",
            format!(
                "{:.3} mm: {}; at the Nyquist frequency {} passes",
                recommended.thickness_mm,
                acuity(&recommended.acuity),
                percent(recommended.nyquist_passed)
            ),
        ),
    ]);
    say("");
    for note in notes {
        say(note);
    }
    say("");
    let row = |covered: &Covered| {
        let mut marks = Vec::new();
        if covered.of_the_paper {
            marks.push("the paper's");
        }
        if covered == recommended {
            marks.push("recommended");
        }
        vec![
            format!("{:.3}", covered.thickness_mm),
            format!("{:.3}", covered.acuity.sigma),
            covered.acuity.locations.to_string(),
            apart(&covered.acuity),
            percent(covered.nyquist_passed),
            marks.join(", "),
        ]
    };
    let rows: Vec<_> = design.curve.iter().map(row).collect();
    print_table(
        &["thickness mm", "spread pitches", "locations", "two points", "passes at Nyquist", ""],
        &rows,
    );
}

/// The reason for the recommendation, and its limits.
fn notes(design: &Design, wanted: &Wanted, measured_pitch_mm: f64) -> Vec<String> {
    let Design { pitch_mm, min_sigma, recommended, .. } = design;
    let Covered { thickness_mm, acuity, .. } = recommended;
    let without = wanted.psf.sigma_intercept_mm / pitch_mm;
    let why = match design.reason {
        Reason::GivesWanted => {
            let sold = design
                .curve
                .iter()
                .find(|covered| covered.of_the_paper && covered.acuity.sigma >= *min_sigma);
            let sold = sold.map_or(String::new(), |covered| {
                format!(
                    " Of the paper's coverings, {:.3} mm comes next: spread {:.2}.",
                    covered.thickness_mm, covered.acuity.sigma
                )
            });
            format!(
                "{thickness_mm:.2} mm is the thinnest covering that gives the wanted spread; a thicker one costs acuity.{sold}"
            )
        }
        Reason::BeyondMeasured => format!(
            "{thickness_mm:.2} mm gives the wanted spread by Eq. 4, but the thickest covering measured had 5.08 mm: measure \
             before you order."
        ),
        Reason::SensorAlreadyWider => format!(
            "No covering gives a spread as small as {min_sigma:.3} pitches: the sensor alone has {without:.2}. So the thinnest \
             available covering (0.04 inch) is recommended; it comes nearest, with {:.2}.",
            acuity.sigma
        ),
        Reason::ThinnerThanAvailable => format!(
            "The wanted spread needs only {:.2} mm; the thinnest available covering (0.04 inch) is recommended.",
            design.wanted_thickness_mm.unwrap_or_default()
        ),
    };
    let mut notes = vec![why];
    if *min_sigma < design.nyquist_sigma && acuity.sigma < design.nyquist_sigma {
        notes.push(format!(
            "With this spread {} of the amplitude at the Nyquist frequency passes: the image of a tool depends on its position relative to the elements.",
            percent(recommended.nyquist_passed)
        ));
    }
    if (pitch_mm / measured_pitch_mm - 1.0).abs() > 0.05 {
        notes.push(format!(
            "The spread was measured at a pitch of {measured_pitch_mm} mm. Its {:.2} mm without covering belong to that sensor; yours \
             may have others.",
            wanted.psf.sigma_intercept_mm
        ));
    }
    notes.push(
        "Locations and separations are bounds for five elements in a row without noise, where a press has all force steps; \
         a real sensor does worse. Separations vary irregularly, because they depend on how readings round."
            .into(),
    );
    notes
}

fn apart(acuity: &Acuity) -> String {
    acuity.separation_mm.map_or("never".into(), |mm| format!("{mm:.3} mm"))
}

fn percent(share: f64) -> String {
    if share < 1e-4 { "< 0.01 %".into() } else { format!("{:.2} %", 100.0 * share) }
}
