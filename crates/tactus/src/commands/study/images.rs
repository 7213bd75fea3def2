//! Figure 8: the H on the rig and in the calibrated model.
//!
//! The simulated rig presses the H at several angles and under each covering, and its devices read the images as in any
//! press. The model images the same presses.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::Context;
use tactus_calibrate::Readings;
use tactus_model::{Covering, Indenter, Mesh, Trajectory};
use tactus_record::rows;
use tactus_report::figures::{COVERINGS, SideBySide, inches, side_by_side};
use tactus_report::study::StudyFigure;
use tactus_runner::embedded::SIMULATED_RIG;
use tactus_scene::shapes::Scene;
use toml::{Table, Value};

use super::steps::{CompletedStep, StudyStep, StudySteps};
use crate::cli::{Common, StudyArgs};
use crate::commands::calibrate::Calibrated;

const ANGLES_DEG: [f64; 6] = [0.0, 15.0, 30.0, 45.0, 60.0, 90.0];
/// Light enough for the envelope, although the H is wide.
const DEPTH_MM: f64 = 0.04;

/// The two parts of Figure 8.
#[derive(Debug)]
pub(super) struct Images {
    pub(super) figures: [StudyFigure; 2],
    /// Largest difference of an image to the model's, in percent of its range.
    pub(super) worst_percent: f64,
}

/// Takes the images; `None` if the data gave no model.
pub(super) fn take(
    common: &Common,
    args: &StudyArgs,
    steps: &mut StudySteps,
    calibrated: &Calibrated,
) -> anyhow::Result<Option<Images>> {
    if calibrated.model().is_none() {
        return Ok(None);
    }
    let images: Vec<HImage> =
        ANGLES_DEG.map(HImage::under_the_thinnest).into_iter().chain([HImage::UPRIGHT]).collect();
    let wanted: Vec<_> = images.iter().map(|image| image.step(args)).collect::<Result<_, _>>()?;
    let taken = steps.take(common, args, &wanted)?;
    let mut compared = images.iter().zip(&taken).map(|(image, taken)| image.compare(calibrated, taken));
    let angles = compared.by_ref().take(ANGLES_DEG.len()).collect::<Result<Vec<_>, _>>()?.concat();
    let coverings = compared.collect::<Result<Vec<_>, _>>()?.concat();
    let all = angles.iter().chain(&coverings);
    let worst_percent = all.map(SideBySide::difference_percent).fold(0.0, f64::max);
    let figure = |number: &str, title: &str, contacts: &[SideBySide], caption: &str| StudyFigure {
        number: number.into(),
        title: title.into(),
        caption: format!(
            "{caption} Above, what the rig's virtual sensor read, through its devices: simulated, with everything that the rig \
             hides. Below, the model that calibration made of this rig, faulty elements included. Every image is scaled from \
             zero to one by itself; at the foot, the largest difference of the two."
        ),
        svg: side_by_side(title, contacts).to_string(),
    };
    Ok(Some(Images {
        figures: [
            figure(
                "8a",
                "The H at several angles",
                &angles,
                "The H in the middle of the array under the thinnest covering.",
            ),
            figure(
                "8b",
                "The H under each covering",
                &coverings,
                "The H upright under each of the four coverings.",
            ),
        ],
        worst_percent,
    }))
}

/// The H at one angle, pressed under some coverings.
struct HImage {
    angle_deg: f64,
    coverings: &'static [Covering],
}

impl HImage {
    const UPRIGHT: Self = Self { angle_deg: 0.0, coverings: &COVERINGS };

    fn under_the_thinnest(angle_deg: f64) -> Self {
        Self { angle_deg, coverings: &COVERINGS[..1] }
    }

    fn is_of_each_covering(&self) -> bool {
        self.coverings.len() > 1
    }

    /// The run that takes the images.
    fn step(&self, args: &StudyArgs) -> anyhow::Result<StudyStep> {
        let Self { angle_deg, coverings } = self;
        let of =
            if self.is_of_each_covering() { "each covering".into() } else { format!("{angle_deg} degrees") };
        let thicknesses_mm: Vec<f64> = coverings.iter().map(|covering| covering.thickness_mm).collect();
        Ok(StudyStep {
            name: format!("image of the H, {of}"),
            experiment: "image",
            parameters: vec![format!("depth_mm={DEPTH_MM}"), format!("coverings_mm={thicknesses_mm:?}")],
            rig_file: Some(rig_with(args, &self.mesh()?, *angle_deg)?),
        })
    }

    /// What the rig has read beside what the model says.
    fn compare(&self, calibrated: &Calibrated, taken: &CompletedStep) -> anyhow::Result<Vec<SideBySide>> {
        let heading = |covering| {
            if self.is_of_each_covering() { inches(covering) } else { format!("{}\u{b0}", self.angle_deg) }
        };
        let (_, readings) = rows::readings(&[&taken.recording])?;
        compare(calibrated, &readings, self.mesh()?, heading)
    }

    fn mesh(&self) -> anyhow::Result<Mesh> {
        turned(&Scene::H.mesh(), self.angle_deg)
    }
}

fn compare(
    calibrated: &Calibrated,
    readings: &Readings,
    mesh: Mesh,
    heading: impl Fn(Covering) -> String,
) -> anyhow::Result<Vec<SideBySide>> {
    let model = calibrated.model().context("no model was made")?;
    let (declared, fitted) = (calibrated.rig.registration, calibrated.calibration.registration.as_ref());
    let registration = fitted.map_or(declared, |fit| fit.registration(declared));
    let surface_mm = fitted.and_then(|fit| fit.surface_mm).map_or(0.0, |surface| surface.value);
    let tool = Indenter::Mesh(Arc::new(mesh));
    let mut compared = Vec::new();
    for press in &readings.presses {
        let Some((dwell, rest)) = press.deepest().zip(press.rest.as_ref()) else { continue };
        let measured: Vec<f64> =
            dwell.counts.iter().zip(&rest.counts).map(|(read, rest)| read - rest).collect();
        let covering = Covering { thickness_mm: press.covering_mm };
        let simulator = model.simulator(registration, surface_mm, covering, tool.clone())?;
        let [x_mm, y_mm] = press.place_mm;
        let there = Trajectory::new([(0.0, [x_mm, y_mm, dwell.height_mm])])?;
        let image = simulator.run(&there, 1.0, 1, || 0.0)?.next().context("no image")?;
        let baselines = &model.base.response.baseline_counts;
        let modelled: Vec<f64> =
            image.clean_counts.iter().zip(baselines).map(|(read, rest)| read - rest).collect();
        compared.push(SideBySide::scaled(heading(covering), &measured, &modelled));
    }
    Ok(compared)
}

fn turned(mesh: &Mesh, angle_deg: f64) -> anyhow::Result<Mesh> {
    let (sin, cos) = angle_deg.to_radians().sin_cos();
    Ok(mesh.turned([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])?)
}

/// Writes a file of the same rig with the H as its indenter.
fn rig_with(args: &StudyArgs, mesh: &Mesh, angle_deg: f64) -> anyhow::Result<PathBuf> {
    let text = match &args.rig_file {
        Some(path) => fs::read_to_string(path).with_context(|| path.display().to_string())?,
        None => SIMULATED_RIG.to_owned(),
    };
    let mut rig: Table = toml::from_str(&text)?;
    let vertices: Vec<Value> = mesh.vertices_mm().iter().map(|vertex| Value::from(vertex.to_vec())).collect();
    let triangle = |triangle: &[u32; 3]| Value::from(triangle.map(i64::from).to_vec());
    let triangles: Vec<Value> = mesh.triangles().iter().map(triangle).collect();
    let mut tool = Table::new();
    tool.insert("shape".into(), "mesh".into());
    tool.insert("vertices_mm".into(), vertices.into());
    tool.insert("triangles".into(), triangles.into());
    rig.insert("indenter".into(), "h".into());
    let tools =
        rig.get_mut("indenters").and_then(Value::as_table_mut).context("the rig file has no tools")?;
    tools.insert("h".into(), tool.into());
    describe_from_anywhere(&mut rig, args.rig_file.as_deref())?;
    let path = args.out.join(format!("rig-with-h-{angle_deg}.toml"));
    fs::write(&path, toml::to_string(&rig)?).with_context(|| path.display().to_string())?;
    Ok(path)
}

/// Makes the path of the frame description absolute, because the new rig file is in another folder.
fn describe_from_anywhere(rig: &mut Table, rig_file: Option<&Path>) -> anyhow::Result<()> {
    let format =
        rig.get_mut("sensor").and_then(Value::as_table_mut).and_then(|sensor| sensor.get_mut("format"));
    if let (Some(format), Some(folder)) = (format, rig_file.and_then(Path::parent))
        && let Some(path) = format.as_str()
    {
        *format = std::path::absolute(folder.join(path))?.display().to_string().into();
    }
    Ok(())
}
