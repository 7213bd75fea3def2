//! The dry run: the same engine on a simulated twin of the rig, in virtual time.
//!
//! The twin's devices have no wires ([`UnwiredRig`]): the engine is the one that moves the rig, with its supervisor, permits and
//! procedures, but nothing is encoded, sent and decoded.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread;
use std::time::Duration;

use tactus_device::{Clock, SensorCodec};
use tactus_engine::{
    Devices, Engine, Planned, Record, RunOrder, RunOutcome, StopOrder, Unpublished, Unrecorded,
};
use tactus_schema::rig::Transport;
use tactus_schema::{Rig, pb};
use tactus_virtual::{Truth, UnwiredRig, twin_of};
use tokio::time::timeout;
use tracing::subscriber::NoSubscriber;

use crate::devices;
use crate::outline::Outline;
use crate::virtual_time;

/// No run lasts longer.
const LONGEST: Duration = Duration::from_hours(72);

/// How often who waits for a dry run is asked.
const POLL: Duration = Duration::from_millis(20);

/// After so many of these times, a second, somebody may want to know how much is left. Most dry runs are over before.
const OUTLINED_AFTER: u32 = 50;

/// Who waits for a dry run. Asked every 20 ms.
pub trait Attend {
    /// True ends the dry run.
    fn stops(&self) -> bool;

    /// How far the twin's run is.
    fn sees(&self, _so_far: SoFar) {}
}

/// How far a dry run is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SoFar {
    /// Presses that are done.
    pub presses: u32,
    /// About what share of all steps is done, 0 to 1, in rig time. `None` within the first second, and if nobody knows.
    pub share: Option<f64>,
}

impl<F: Fn() -> bool> Attend for F {
    fn stops(&self) -> bool {
        self()
    }
}

/// What an experiment will do, as found by a dry run.
#[derive(Debug, Clone, PartialEq)]
pub struct DryRun {
    /// How the dry run ended. If it is not done, the experiment cannot be done either.
    pub outcome: RunOutcome,
}

/// Why there was no dry run.
#[derive(Debug, thiserror::Error)]
pub enum TwinError {
    /// The system provided no thread or no runtime.
    #[error("no dry run: {0}")]
    System(#[from] std::io::Error),
    /// The rig describes data, not a service.
    #[error(transparent)]
    Engine(#[from] tactus_engine::EngineError),
    /// The experiment would take longer than this one may.
    #[error("the experiment would take more than {:.0} min", .0.as_secs_f64() / 60.0)]
    TooLong(Duration),
    /// The dry run's thread panicked.
    #[error("the dry run panicked; this is a defect of Tactus")]
    Panicked,
}

impl DryRun {
    /// True if the twin did everything.
    pub fn is_possible(&self) -> bool {
        self.outcome.exit_status == pb::ExitStatus::Done
    }

    /// Totals for the run's progress display.
    pub fn promise(&self) -> Planned {
        Planned {
            presses: self.outcome.presses,
            dwells: self.outcome.dwells,
            duration_s: self.outcome.duration_s,
        }
    }

    /// Greatest commanded depth, mm; 0 without a press.
    pub fn deepest_mm(&self) -> f64 {
        (-self.outcome.travel_mm[2][0]).max(0.0)
    }
}

/// Runs an experiment on the rig's twin. Blocks until it is computed, or until `attendant` stops it: the [`DryRun`] is then
/// stopped, and so not possible.
///
/// # Errors
/// [`TwinError`] if there was no dry run. A refused step is no error: the [`DryRun`] is then not possible.
pub fn dry_run(rig: &Rig, order: RunOrder, attendant: &dyn Attend) -> Result<DryRun, TwinError> {
    let outcome = run_on(twin_of(rig), Links::None, order, LONGEST, Box::new(Unrecorded), attendant)?;
    Ok(DryRun { outcome })
}

/// What connects a twin's devices with the engine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Links {
    /// Nothing.
    None,
    /// Device bytes and drivers, as in a run.
    Bytes,
}

/// Runs an experiment on a twin in virtual time, for at most `longest` of it. As [`dry_run`] otherwise.
pub(crate) fn run_on(
    mut twin: Rig,
    links: Links,
    mut order: RunOrder,
    longest: Duration,
    record: Box<dyn Record>,
    attendant: &dyn Attend,
) -> Result<RunOutcome, TwinError> {
    order.resets = true;
    if let Some(service) = &mut twin.service {
        service.sensor.transport = Transport::Embedded;
        service.stage.transport = Transport::Embedded;
    }
    let outline = Outline::of(&twin, &order);
    if let Some(outline) = &outline {
        order.evaluator = outline.evaluator();
    }
    // One message: the twin's engine. The channel ends with the thread.
    let (started, engines) = sync_channel(1);
    // A separate runtime on a separate thread: the caller may be in another runtime.
    let thread = thread::Builder::new().name("twin".into()).spawn(move || {
        // The twin's log entries are no events of the service.
        tracing::subscriber::with_default(NoSubscriber::new(), || {
            virtual_time::runtime()?.block_on(run(twin, links, order, longest, record, &started))
        })
    })?;
    attend(&engines, outline.as_ref(), attendant);
    thread.join().map_err(|_| TwinError::Panicked)?
}

/// Returns when the twin's thread has ended. Once the attendant stops it, it stops the twin's engine, even while a script computes.
fn attend(engines: &Receiver<Engine>, outline: Option<&Outline>, attendant: &dyn Attend) {
    let mut twin: Option<Engine> = None;
    let mut not_begun = outline;
    for polls in 0_u32.. {
        match engines.recv_timeout(POLL) {
            Ok(engine) => twin = Some(engine),
            Err(RecvTimeoutError::Disconnected) => return,
            Err(RecvTimeoutError::Timeout) => {
                let Some(twin) = &twin else { continue };
                if polls >= OUTLINED_AFTER
                    && let Some(outline) = not_begun.take()
                {
                    // Without a thread nobody knows how much is left.
                    drop(outline.begin());
                }
                let share = outline.and_then(Outline::share);
                attendant.sees(SoFar { presses: twin.run_state().presses, share });
                if attendant.stops() {
                    let order = StopOrder { by: "request".into(), reason: String::new(), abort: false };
                    twin.stop(order);
                }
            }
        }
    }
}

async fn run(
    twin: Rig,
    links: Links,
    order: RunOrder,
    longest: Duration,
    record: Box<dyn Record>,
    started: &SyncSender<Engine>,
) -> Result<RunOutcome, TwinError> {
    let clock = Clock::paused();
    let Some(service) = twin.service.clone() else {
        return Err(tactus_engine::EngineError::NoService { rig: twin.name }.into());
    };
    let truth = Truth::of_rig(&twin, order.seed);
    let devices = match links {
        Links::None => unwired(UnwiredRig::start(&twin, truth, clock)),
        // Steps do not depend on the sensor's protocol: the twin uses one that needs no description.
        Links::Bytes => devices::open(&twin, &service, SensorCodec::default(), || truth, clock).devices,
    };
    let engine = Engine::start(twin, devices, clock, Arc::new(Unpublished))?;
    // There is room: this is the only message. The receiver waits for the thread's end.
    let _told = started.try_send(engine.clone());
    match timeout(longest, engine.run(order, record)).await {
        Ok(Ok(outcome)) => Ok(outcome),
        Ok(Err(busy)) => unreachable!("a new engine has no other run: {busy}"),
        Err(_) => Err(TwinError::TooLong(longest)),
    }
}

fn unwired(rig: UnwiredRig) -> Devices {
    let change_covering = Arc::new(rig.change_covering());
    Devices {
        sensor: Box::new(rig.sensor),
        stage: rig.stage,
        stage_reports: rig.reports,
        change_covering: Some(change_covering),
        covering_memory: None,
    }
}
