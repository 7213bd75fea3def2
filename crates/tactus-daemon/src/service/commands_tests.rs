use std::path::Path;
use std::sync::mpsc;
use std::time::Duration;

use tactus_bus::{Bus, BusConfig};
use tactus_device::Clock;
use tactus_engine::Unpublished;
use tactus_runner::config::RigFiles;
use tactus_runner::devices;
use tactus_runner::embedded::Truth;
use tactus_schema::key::Keys;

use super::*;

/// A guard held across a second look at the stage would block for good as soon as a report of the stage comes in between.
#[test]
fn answers_and_reports_of_the_stage_never_wait_for_each_other() {
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build().unwrap();
    let waited = runtime.block_on(ask_while_homing());
    // What hangs would be waited for otherwise.
    runtime.shutdown_background();
    assert!(waited.is_ok_and(|homed| homed > 0), "homing or an answer hangs: {waited:?}");
}

/// Asks as often as can be while the stage homes and tells all the time: how many answers saw it homed; an error if that takes
/// a minute.
async fn ask_while_homing() -> Result<u32, mpsc::RecvTimeoutError> {
    let config = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../config/tactusd.toml"));
    let config = Config::load(config).unwrap();
    let RigFiles { rig, codec, .. } = config.rig.clone();
    let nowhere = BusConfig { listen: Vec::new(), connect: Vec::new() };
    let (bus, _calls) = Bus::open(&nowhere, Keys::new(rig.name.clone())).await.unwrap();
    let clock = Clock::real();
    let service = rig.service.clone().unwrap();
    let opened = devices::open(&rig, &service, codec, || Truth::of_rig(&rig, 1), clock);
    let engine = Engine::start(rig.clone(), opened.devices, clock, Arc::new(Unpublished)).unwrap();
    let desk = CommandDesk::new(engine.clone(), config, bus.publisher());

    let homing = tokio::spawn(async move { engine.reset().await });
    let (done, ended) = mpsc::channel();
    std::thread::spawn(move || {
        let mut homed = 0;
        while !homing.is_finished() {
            let stage = desk.reply(Ok(())).stage.unwrap();
            homed += u32::from(stage.status() == pb::StageStatus::Idle);
        }
        // Nobody listens if the test has failed.
        let _told = done.send(homed);
    });
    tokio::task::spawn_blocking(move || ended.recv_timeout(Duration::from_mins(1))).await.unwrap()
}
