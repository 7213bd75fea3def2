//! `study`: repeats the paper on one rig.
//!
//! It makes the runs, each of which an interrupted study need not repeat; then calibration, mechanics, acuity and
//! images; then one report.

mod images;
mod quantities;
mod steps;

use std::fs;
use std::path::Path;
use std::time::Instant;

use anyhow::Context;
use serde_json::json;
use tactus_report::figures;
use tactus_report::study::{ComparedQuantity, StudyFigure, StudyReport, StudyRun, study_html};

use super::calibrate::{self, Calibrated};
use crate::cli::{Common, StudyArgs};
use crate::exit::Exit;
use crate::output::{self, duration, say, say_next};
use crate::progress::Busy;
use steps::{CompletedStep, StudySteps};

/// Figures computed from the model alone. Figures 2 and 5 come from the calibration, Figure 8 from the rig's images.
const FIGURES: [&str; 7] = ["3", "4", "6a", "6b", "9b", "10a", "10b"];

pub(crate) fn study(common: &Common, args: &StudyArgs) -> anyhow::Result<Exit> {
    let start = Instant::now();
    fs::create_dir_all(&args.out).with_context(|| args.out.display().to_string())?;
    let mut steps = StudySteps::resume(common, args)?;
    let taken = steps.measure(common, args)?;
    let busy = Busy::with("calibration", common.json);
    let recordings: Vec<_> = taken.iter().map(|taken| taken.recording.clone()).collect();
    let calibrated = busy.reads(|| calibrate::from_files(&recordings))?;
    calibrate::write(&calibrated, &args.out.join("calibration"))?;
    drop(busy);
    let truth = quantities::truth(&recordings[0])?;
    let mut missing = calibrated.calibration.missing.clone();
    let images = if taken.iter().all(|taken| taken.embedded) {
        images::take(common, args, &mut steps, &calibrated)?
    } else {
        missing.push(
            "Figure 8: the images of an H need an H on the stage. Put it on, name it in the rig file, run `image`, and compare \
             with `tactus simulate --scene h --model calibration/model.toml`."
                .into(),
        );
        None
    };
    let busy = Busy::with("figures", common.json);
    let mut figures = figures::finished(&FIGURES, |drawn| {
        busy.shows_step(drawn.title, drawn.finished as f64 / (drawn.figures + 1) as f64);
    })?;
    busy.shows_step("mechanics and acuity", FIGURES.len() as f64 / (FIGURES.len() + 1) as f64);
    let quantities = quantities::quantities(&calibrated, truth.as_ref(), images.as_ref())?;
    drop(busy);
    figures.extend(images.into_iter().flat_map(|images| images.figures));
    let mut warnings: Vec<String> = taken.iter().filter_map(|taken| taken.degraded.clone()).collect();
    let is_lossy = calibrated.is_lossy || !warnings.is_empty();
    warnings.extend(calibrated.notes.iter().chain(&calibrated.calibration.warnings).cloned());
    let findings = Findings { quantities, missing, warnings, is_lossy };
    write_report(args, &calibrated, &taken, &findings, &figures)?;
    finish(common, args, &calibrated, &findings, start)
}

/// Results of a study.
struct Findings {
    quantities: Vec<ComparedQuantity>,
    /// Parts that could not be done.
    missing: Vec<String>,
    /// Reservations about the numbers.
    warnings: Vec<String>,
    /// True if something of the runs was lost.
    is_lossy: bool,
}

fn write_report(
    args: &StudyArgs,
    calibrated: &Calibrated,
    taken: &[CompletedStep],
    findings: &Findings,
    figures: &[StudyFigure],
) -> anyhow::Result<()> {
    let runs: Vec<StudyRun> = taken.iter().map(CompletedStep::run).collect();
    let page = study_html(&StudyReport {
        rig: &calibrated.rig.name,
        simulated: calibrated.simulated,
        runs: &runs,
        quantities: &findings.quantities,
        calibration: Some(calibrated.report()),
        figures,
        missing: &findings.missing,
        warnings: &findings.warnings,
    });
    put(&args.out.join("report.html"), &page)?;
    for StudyFigure { number, svg, .. } in figures {
        put(&args.out.join(format!("figure-{number}.svg")), svg)?;
    }
    Ok(())
}

fn put(path: &Path, text: &str) -> anyhow::Result<()> {
    fs::write(path, text).with_context(|| path.display().to_string())
}

fn finish(
    common: &Common,
    args: &StudyArgs,
    calibrated: &Calibrated,
    Findings { quantities, missing, warnings, is_lossy }: &Findings,
    start: Instant,
) -> anyhow::Result<Exit> {
    let report = std::path::absolute(args.out.join("report.html"))?;
    let known = quantities.iter().filter(|one| one.truth.is_some() && one.inside.is_some());
    let (inside, known) = (known.clone().filter(|one| one.inside == Some(true)).count(), known.count());
    if common.json {
        let rows: Vec<_> = quantities.iter().map(quantities::to_json).collect();
        let found = json!({
            "schema": "tactus.study/1",
            "rig": calibrated.rig.name,
            "simulated": calibrated.simulated,
            "rows": rows,
            "truths": known,
            "truths_inside": inside,
            "missing": missing,
            "warnings": warnings,
            "report": report,
            "seconds": start.elapsed().as_secs_f64(),
        });
        output::write(&format!("{found}\n"))?;
    } else {
        quantities::print(quantities);
        say("");
        if known > 0 {
            say(&format!("{inside} of {known} known truths inside their 95 % intervals"));
        }
        for warning in warnings {
            say(&format!("warning: {warning}"));
        }
        for missing in missing {
            say(&format!("missing: {missing}"));
        }
        say(&format!("{}\ndone in {}", report.display(), duration(start.elapsed().as_secs_f64())));
        let model = args.out.join("calibration/model.toml");
        if model.is_file() {
            let model = model.display();
            say_next(&format!("`tactus simulate --model {model}` shows an image of this sensor"));
        }
    }
    Ok(if missing.is_empty() && !is_lossy { Exit::Done } else { Exit::Degraded })
}
