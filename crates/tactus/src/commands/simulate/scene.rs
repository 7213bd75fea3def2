//! The sensor, the tool and the tool's pose.

use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, anyhow, bail};
use tactus_model::{Array, Contact, Covering, Indenter, Mesh, Psf, Registration, Simulator, Trajectory};
use tactus_scene::{Attitude, FileError, shapes};
#[cfg(feature = "gpu")]
use tactus_scene::{GpuRenderer, Pose, Renderer};
use tactus_schema::model::Model;

use crate::cli::SimulateArgs;
use crate::commands::discover::declared;
use crate::exit::{Exit, Failure, in_words};

/// The characterisation of the paper's sensor.
const PAPER_MODEL: &str = include_str!("../../../../../config/models/digitacts.toml");

/// A sensor and the tool pressed into its covering.
#[derive(Debug, Clone)]
pub(super) struct Scene {
    /// The sensor; the robot's frame is its own.
    pub(super) simulator: Simulator,
    /// The tool in its pose.
    pub(super) contact: Contact,
}

impl Scene {
    pub(super) fn of(args: &SimulateArgs) -> anyhow::Result<Self> {
        let usage = |error: &dyn std::fmt::Display| Failure::new(Exit::Usage, error);
        let model = model(args)?;
        let indenter = indenter(args).map_err(|error| usage(&in_words(&error)))?;
        let [[x0, x1], [y0, y1]] = model.base.array.extent_mm();
        let position_mm =
            [args.x_mm.unwrap_or(f64::midpoint(x0, x1)), args.y_mm.unwrap_or(f64::midpoint(y0, y1))];
        let [x_mm, y_mm] = position_mm;
        if ![x_mm, y_mm, args.angle_deg, args.depth_mm].iter().all(|value| value.is_finite()) {
            return Err(usage(&"the tool's place, angle and depth must be finite numbers").into());
        }
        if !(args.covering_mm.is_finite() && args.covering_mm > 0.0) {
            return Err(usage(&format!("--covering-mm must be positive, not {}", args.covering_mm)).into());
        }
        let covering = Covering { thickness_mm: args.covering_mm };
        // The robot's frame is the sensor's.
        let registration = Registration { origin_mm: [0.0; 2], rotation_deg: 0.0 };
        let simulator = model.simulator(registration, 0.0, covering, yawed(&indenter, args.angle_deg)?)?;
        let contact =
            Contact { indenter, position_mm, rotation_deg: args.angle_deg, depth_mm: args.depth_mm };
        Ok(Self { simulator, contact })
    }

    pub(super) fn array(&self) -> &Array {
        self.simulator.model.array()
    }

    pub(super) fn sigma_mm(&self) -> f64 {
        self.simulator.model.psf().sigma_mm(self.simulator.covering)
    }

    /// Counts before noise and converter, rendered on the GPU, and the GPU's name.
    #[cfg(feature = "gpu")]
    pub(super) fn gpu_image(&self) -> anyhow::Result<(Vec<f64>, String)> {
        let Indenter::Mesh(mesh) = &self.contact.indenter else {
            bail!("the GPU renders meshes: h, wrench, spaceship or a file");
        };
        if !self.simulator.effects.is_empty() {
            bail!("the GPU renders the base model; this model has effects: leave --gpu out");
        }
        let Simulator { model, covering, .. } = &self.simulator;
        let mut renderer = GpuRenderer::new(Renderer::new(model.clone(), *covering, Arc::clone(mesh))?)?;
        let Contact { position_mm, rotation_deg, depth_mm, .. } = self.contact;
        let pose = Pose { position_mm, attitude: Attitude::upright(rotation_deg), depth_mm };
        let mut counts = vec![0.0; self.array().elements()];
        renderer.images(&[pose], &mut counts)?;
        Ok((counts.into_iter().map(f64::from).collect(), renderer.adapter().to_owned()))
    }

    /// This build has no GPU renderer.
    #[cfg(not(feature = "gpu"))]
    #[expect(clippy::unused_self, reason = "as the other build's")]
    pub(super) fn gpu_image(&self) -> anyhow::Result<(Vec<f64>, String)> {
        bail!(
            "this tactus was built without its GPU path: build it with `--features gpu`, or leave --gpu out"
        )
    }

    /// Counts before noise and converter, by the exact model and its effects, at the moment of contact.
    pub(super) fn image(&self) -> anyhow::Result<Vec<f64>> {
        if self.simulator.effects.is_empty() {
            let mut counts = vec![0.0; self.array().elements()];
            self.simulator.model.image(&self.contact, self.simulator.covering, &mut counts);
            return Ok(counts);
        }
        let [x_mm, y_mm] = self.contact.position_mm;
        let there = Trajectory::new([(0.0, [x_mm, y_mm, -self.contact.depth_mm])])?;
        let image = self.simulator.run(&there, 1.0, 1, || 0.0)?.next();
        Ok(image.context("a run of one image gave none")?.clean_counts)
    }
}

/// The model from `--model`, or the paper's, on the array from `--array`.
fn model(args: &SimulateArgs) -> anyhow::Result<Model> {
    let array = args.array.as_deref().map(array).transpose()?;
    if let Some(path) = &args.model {
        let model = declared(path)?;
        return Ok(match array {
            Some(array) if array != model.base.array => model.on(array),
            _ => model,
        });
    }
    let paper = Model::from_toml(PAPER_MODEL)?;
    Ok(match array {
        Some(array) if array != paper.base.array => {
            // In the paper's Fig. 10, uncharacterised sensors have a spread of one element width.
            let psf = Psf { sigma_intercept_mm: array.pitch_mm(), sigma_per_mm: 0.0 };
            let mut model = paper.on(array);
            model.base.psf = psf;
            model
        }
        _ => paper,
    })
}

fn array(name: &str) -> Result<Array, Failure> {
    let shipped = Array::shipped();
    let names: Vec<_> = shipped.iter().map(|array| array.name().to_owned()).collect();
    shipped.into_iter().find(|array| array.name() == name).ok_or_else(|| {
        Failure::new(
            Exit::Usage,
            format!("no array {name:?}: there are {}; others come in a model file", names.join(", ")),
        )
    })
}

/// A generated tool, a simple shape, or a mesh from a file.
fn indenter(args: &SimulateArgs) -> anyhow::Result<Indenter> {
    let diameter_mm = args.diameter_mm;
    if !(diameter_mm.is_finite() && diameter_mm > 0.0) {
        bail!("--diameter-mm must be positive, not {diameter_mm}");
    }
    let attitude = Attitude { yaw_deg: 0.0, pitch_deg: args.pitch_deg, roll_deg: args.roll_deg };
    let simple = ["cylinder", "sphere", "cone", "box"].contains(&args.scene.as_str());
    if simple && attitude != Attitude::default() {
        bail!("only a mesh can be tilted, not a {}", args.scene);
    }
    let mesh = match args.scene.as_str() {
        "cylinder" => return Ok(Indenter::Cylinder { diameter_mm }),
        "sphere" => return Ok(Indenter::Sphere { diameter_mm }),
        "box" if args.size_mm.iter().all(|side| side.is_finite() && *side > 0.0) => {
            let [x_mm, y_mm] =
                <[f64; 2]>::try_from(&*args.size_mm).context("--size-mm takes two sides, as 3,1")?;
            return Ok(Indenter::Box { size_mm: [x_mm, y_mm] });
        }
        "box" => bail!("--size-mm takes two positive sides, as 3,1"),
        "cone" if args.apex_deg > 0.0 && args.apex_deg < 180.0 => {
            return Ok(Indenter::Cone { diameter_mm, apex_deg: args.apex_deg });
        }
        "cone" => bail!("--apex-deg is the full angle at the tip, between 0 and 180"),
        scene => match shapes::Scene::named(scene) {
            Some(scene) => scene.mesh(),
            None if Path::new(scene).exists() => load(Path::new(scene))?,
            None => bail!(
                "no scene {scene:?}: there are h, wrench, spaceship, cylinder, sphere, cone, box, and files \
                 .stl, .obj, .ply"
            ),
        },
    };
    let tilted = if attitude == Attitude::default() { mesh } else { mesh.turned(attitude.matrix())? };
    Ok(Indenter::Mesh(Arc::new(tilted)))
}

/// Reads a mesh. Errors name the file.
fn load(path: &Path) -> anyhow::Result<Mesh> {
    use FileError::{Broken, Io, Mesh, NoFaces, TooLarge, UnknownFormat};
    tactus_scene::load(path).map_err(|error| match error {
        Io { .. } | UnknownFormat { .. } => error.into(),
        TooLarge { .. } | Broken { .. } | NoFaces { .. } | Mesh(_) => anyhow!("{}: {error}", path.display()),
    })
}

/// The tool turned about its axis.
fn yawed(indenter: &Indenter, angle_deg: f64) -> anyhow::Result<Indenter> {
    let turned = |mesh: &Mesh| mesh.turned(Attitude::upright(angle_deg).matrix());
    Ok(match indenter {
        Indenter::Mesh(mesh) if angle_deg != 0.0 => Indenter::Mesh(Arc::new(turned(mesh)?)),
        Indenter::Box { size_mm } if angle_deg != 0.0 => {
            let [x, y] = size_mm.map(|side| side / 2.0);
            let corners = [[-x, -y, 0.0], [x, -y, 0.0], [x, y, 0.0], [-x, y, 0.0]];
            Indenter::Mesh(Arc::new(turned(&Mesh::new(&corners, &[[0, 1, 2], [0, 2, 3]])?)?))
        }
        Indenter::Mesh(_)
        | Indenter::Box { .. }
        | Indenter::Cylinder { .. }
        | Indenter::Sphere { .. }
        | Indenter::Cone { .. } => indenter.clone(),
    })
}
