//! One run in this process, without a service: the embedded simulated rig.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use tactus_device::Clock;
use tactus_engine::{Engine, EngineError, Record, RunOrder, RunOutcome, Unpublished};
use tactus_plan::ScriptError;
use tactus_record::RecordError;
use tactus_schema::rig::Transport;
use tactus_schema::{Rig, RigError};

use crate::config::{ConfigError, RigFiles};
use crate::order::{self, RunRequest};
use crate::recorder::{DirectRecorder, ThreadRecorder};
use crate::twin::{self, Attend, DryRun, TwinError};
use crate::{devices, virtual_time};

pub use tactus_virtual::{HIDDEN_SCHEMA, Truth, TruthError, TruthFile};

/// The text of `config/rigs/sim.toml`: the simulated rig that needs no hardware.
pub const SIMULATED_RIG: &str = include_str!("../../../config/rigs/sim.toml");

/// [`SIMULATED_RIG`], read.
///
/// # Errors
/// None, unless the shipped file is wrong.
pub fn simulated_rig() -> Result<RigFiles, ConfigError> {
    RigFiles::of(SIMULATED_RIG, Path::new("sim.toml"))
}

/// How time passes in an embedded run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pace {
    /// Virtual time: as fast as it computes.
    Virtual,
    /// Real time, as on a real rig.
    Real,
}

/// A run that ended, successfully or not.
#[derive(Debug, Clone)]
pub struct Finished {
    /// Exit status, message and totals.
    pub outcome: RunOutcome,
    /// Path of its recording.
    pub recording: PathBuf,
}

/// Why there was no run.
#[derive(Debug, thiserror::Error)]
pub enum EmbeddedError {
    /// The rig is invalid.
    #[error(transparent)]
    Rig(#[from] RigError),
    /// The engine refused the rig.
    #[error(transparent)]
    Engine(#[from] EngineError),
    /// Its devices are not in this process.
    #[error(
        "the devices of rig {rig:?} are not embedded (transport.kind): they are run by the service, `tactusd`"
    )]
    #[expect(missing_docs, reason = "the message says what each field is")]
    NotEmbedded { rig: String },
    /// The truth does not fit this rig.
    #[error(transparent)]
    Truth(#[from] TruthError),
    /// The script or its parameters are wrong.
    #[error(transparent)]
    Script(#[from] ScriptError),
    /// There was no dry run.
    #[error(transparent)]
    Twin(#[from] TwinError),
    /// The dry run found a step that cannot be done. Nothing was moved.
    #[error("{}", .0.outcome.message)]
    NotPossible(Box<DryRun>),
    /// The recording could not be opened.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// The system provided no thread or runtime.
    #[error("no run: {0}")]
    System(#[from] io::Error),
}

/// The truth that a simulated rig hides from the service, equal in all its runs, for comparison with results. The virtual
/// devices are made from it.
///
/// `None` for a rig that hides nothing: one with physical devices, or a description that came with data. A run with a
/// [`TruthFile`] hides that file's truth instead, and its recording does not contain the rig file.
pub fn truth(rig: &Rig) -> Option<Truth> {
    let simulation = rig.simulation.as_ref().filter(|_| rig.simulated)?;
    Some(Truth::of(rig, simulation, simulation.seed))
}

/// Dry-runs the experiment on the rig's twin and then runs it on the rig, whose devices must be embedded.
/// Blocks until it is over.
///
/// With `truth`, the devices use that file's sensor instead of the rig file's. It is hidden from the dry run and the
/// recording: the recording then contains the rig's description, but not its file.
///
/// `attendant` is asked every 20 ms until the dry run is over. `started` is called with the engine and
/// the order just before the run begins; from then on [`Engine::stop`] ends it.
///
/// # Errors
/// [`EmbeddedError`] if there was no run at all; how a run ended is in [`Finished`].
pub fn run(
    RigFiles { rig, codec, texts, .. }: &RigFiles,
    truth: Option<&TruthFile>,
    request: RunRequest,
    folder: &Path,
    pace: Pace,
    attendant: &dyn Attend,
    started: impl FnOnce(&Engine, &RunOrder),
) -> Result<Finished, EmbeddedError> {
    let Some(service) = rig.service.clone() else {
        return Err(EngineError::NoService { rig: rig.name.clone() }.into());
    };
    if service.sensor.transport != Transport::Embedded || service.stage.transport != Transport::Embedded {
        return Err(EmbeddedError::NotEmbedded { rig: rig.name.clone() });
    }
    let runtime = match pace {
        Pace::Virtual => virtual_time::runtime()?,
        Pace::Real => tokio::runtime::Builder::new_multi_thread().enable_all().build()?,
    };
    let clock = runtime.block_on(async {
        match pace {
            Pace::Virtual => Clock::paused(),
            Pace::Real => Clock::real(),
        }
    });
    let mut order = order::order(request, rig, clock.now().wall, &|| attendant.stops())?;
    let hidden = match truth {
        Some(truth) => truth.behind(rig, order.seed)?,
        None => Truth::of_rig(rig, order.seed),
    };
    let plan = twin::dry_run(rig, order.clone(), attendant)?;
    if !plan.is_possible() {
        return Err(EmbeddedError::NotPossible(Box::new(plan)));
    }
    order.planned = Some(plan.promise());
    // The devices exist for this run only: nobody has to look at them before a reset.
    order.resets = true;
    let texts = if truth.is_none() { texts.all() } else { texts.without_rig() };
    let (recording, path) = order::recording(&order, rig, texts, folder, clock.now().wall)?;
    order.recording = path.display().to_string();
    let record: Box<dyn Record> = match pace {
        Pace::Virtual => Box::new(DirectRecorder(recording)),
        Pace::Real => Box::new(ThreadRecorder::start(recording)?),
    };
    runtime.block_on(async {
        let opened = devices::open(rig, &service, codec.clone(), || hidden, clock);
        let engine = Engine::start(rig.clone(), opened.devices, clock, Arc::new(Unpublished))?;
        // Claimed before anybody can stop it: a stop of an engine without a run would not last.
        let claim = match engine.claim() {
            Ok(claim) => claim,
            Err(busy) => unreachable!("a new engine has no other run: {busy}"),
        };
        started(&engine, &order);
        Ok(Finished { outcome: claim.run(order, record).await, recording: path })
    })
}
