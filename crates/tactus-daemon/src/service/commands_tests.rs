use std::path::Path;
use std::sync::mpsc;
use std::thread;
use std::time::Duration;

use tactus_bus::{Bus, BusConfig, Calls, Client, Endpoint, Hold};
use tactus_device::Clock;
use tactus_engine::Unpublished;
use tactus_runner::config::{RigFiles, ServiceConfig};
use tactus_runner::devices;
use tactus_runner::embedded::Truth;
use tactus_schema::key::Keys;
use tokio::runtime::Handle;
use tokio::sync::Barrier;
use tokio::task::JoinHandle;

use crate::service::stops::{self, Desks};

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

/// A bus at these endpoints, and the desk of the shipped simulated rig, which nobody has reset.
async fn lab(listen: Vec<Endpoint>) -> (Bus, Calls, CommandDesk) {
    let config = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../config/tactusd.toml"));
    let config = ServiceConfig::load(config).unwrap();
    let files = Arc::new(config.rigs.served[0].clone());
    let RigFiles { rig, codec, .. } = RigFiles::clone(&files);
    let bus_config = BusConfig { listen, ..BusConfig::default() };
    let (bus, calls) = Bus::open(&bus_config, Keys::new(rig.name.clone())).await.unwrap();
    let clock = Clock::real();
    let service = rig.service.clone().unwrap();
    let opened = devices::open(&rig, &service, codec, || Truth::of_rig(&rig, 1), clock);
    let engine = Engine::start(rig, opened.devices, clock, Arc::new(Unpublished)).unwrap();
    let places = Places { files, recordings: config.recordings, experiments: config.experiments };
    // The test's program has no main function that evaluates scripts.
    let desk = CommandDesk::new(engine, places, bus.publisher(), Arc::new(tactus_plan::InThisProcess));
    (bus, calls, desk)
}

/// Answers the commands of a desk.
fn answer(
    desk: &Arc<CommandDesk>,
    mut commands: tokio::sync::mpsc::Receiver<Box<CommandCall>>,
) -> JoinHandle<()> {
    let desk = Arc::clone(desk);
    tokio::spawn(async move { desk.answer_commands(&mut commands).await })
}

/// A client, and what it got when it asked for the lease.
async fn racer(endpoint: &Endpoint, number: usize, start: Arc<Barrier>) -> (Client, Hold) {
    let client = Client::connect(endpoint, Some("sim")).await.unwrap();
    start.wait().await;
    let hold = client.hold(&format!("client {number}"), None).await.unwrap();
    (client, hold)
}

async fn ask(client: &Client, command: Command, lease: Vec<u8>) -> pb::CommandReply {
    let request = pb::CommandRequest { who: "racer".into(), lease, ..Default::default() };
    client.command(command, &request, Duration::from_mins(1)).await.unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn of_twenty_clients_one_gets_the_lease_and_only_its_commands_move_anything() {
    let endpoint: Endpoint = free_endpoint();
    let (bus, Calls { stops, commands }, desk) = lab(vec![endpoint.clone()]).await;
    let desk = Arc::new(desk);
    let stopping = thread::spawn({
        let (desks, runtime) = (Desks::default(), Handle::current());
        desks.add(&"sim".into(), &desk);
        move || {
            let _entered = runtime.enter();
            stops::answer(&desks, stops);
        }
    });
    let answering = answer(&desk, commands);

    let start = Arc::new(Barrier::new(20));
    let racers = (0..20).map(|number| {
        let (endpoint, start) = (endpoint.clone(), Arc::clone(&start));
        tokio::spawn(async move { racer(&endpoint, number, start).await })
    });
    let racers: Vec<_> = racers.collect();
    let (mut winners, mut losers) = (Vec::new(), Vec::new());
    for racer in racers {
        match racer.await.unwrap() {
            (client, Hold::Held(held)) => winners.push((client, held)),
            (client, Hold::Refused(reply)) => {
                // The second if too many ask at once.
                assert!(matches!(reply.exit_code, exit::NOT_NOW | exit::FAILED), "{}", reply.error);
                losers.push(client);
            }
        }
    }
    assert_eq!(winners.len(), 1);
    let (winner, held) = winners.pop().unwrap();

    // Nobody has homed the stage, and nobody but the holder can.
    let is_homed = || {
        let status = desk.engine.stage_state().status();
        // It may connect meanwhile.
        !matches!(status, pb::StageStatus::Disconnected | pb::StageStatus::Unhomed)
    };
    for (number, loser) in losers.iter().enumerate() {
        for command in [Command::Reset, Command::Pause, Command::Resume] {
            for lease in [Vec::new(), vec![0; 16], held.secret()[..15].to_vec()] {
                let reply = ask(loser, command, lease).await;
                assert_eq!(reply.exit_code, exit::NOT_NOW, "{number}: {command:?} {}", reply.error);
            }
        }
        let run = pb::RunRequest { experiment: "corners".into(), who: "racer".into(), ..Default::default() };
        let reply = loser.command(Command::Run, &run, Duration::from_mins(1)).await.unwrap();
        assert_eq!(reply.exit_code, exit::NOT_NOW, "{}", reply.error);
        let reply = ask(loser, Command::Status, Vec::new()).await;
        assert!(reply.ok && reply.lease.as_ref().is_some_and(|lease| lease.lease.is_empty()), "{reply:?}");
    }
    assert!(!is_homed());

    // A takeover wants a reason, and makes the first lease stale.
    assert!(
        matches!(losers[0].hold("loser", Some(" ")).await, Ok(Hold::Refused(reply)) if reply.exit_code == exit::USAGE)
    );
    let Ok(Hold::Held(taken)) = losers[0].hold("loser", Some("smoke")).await else {
        panic!("not taken over")
    };
    let reply = ask(&winner, Command::Reset, held.secret()).await;
    assert_eq!(reply.exit_code, exit::NOT_NOW, "{}", reply.error);
    assert!(reply.error.contains("loser holds the lease"), "{}", reply.error);
    assert!(!is_homed());
    let reply = ask(&losers[0], Command::Reset, taken.secret()).await;
    assert!(reply.ok, "{}", reply.error);
    assert_eq!(desk.engine.stage_state().status(), pb::StageStatus::Idle);

    // A stop wants nothing.
    let stop = pb::CommandRequest::default();
    assert!(losers[1].stop(&stop, Duration::from_mins(1)).await.unwrap().ok);
    answering.abort();
    bus.close().await.unwrap();
    tokio::task::spawn_blocking(|| stopping.join()).await.unwrap().unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn of_two_clients_that_race_for_the_lease_one_gets_it_each_time() {
    let endpoint: Endpoint = free_endpoint();
    let (bus, calls, desk) = lab(vec![endpoint.clone()]).await;
    let answering = answer(&Arc::new(desk), calls.commands);
    let clients = [
        Client::connect(&endpoint, Some("sim")).await.unwrap(),
        Client::connect(&endpoint, Some("sim")).await.unwrap(),
    ];
    let mut wins = [0, 0];
    for _ in 0..200 {
        let (one, other) = tokio::join!(clients[0].hold("one", None), clients[1].hold("other", None));
        match (one.unwrap(), other.unwrap()) {
            (Hold::Held(held), Hold::Refused(_)) => {
                wins[0] += 1;
                held.release().await.unwrap();
            }
            (Hold::Refused(_), Hold::Held(held)) => {
                wins[1] += 1;
                held.release().await.unwrap();
            }
            both_or_none => panic!("{both_or_none:?}"),
        }
    }
    println!("races of two clients for the lease: {wins:?} wins");
    answering.abort();
    bus.close().await.unwrap();
}

/// A request that the shipped simulated rig can or cannot do: one press this deep.
fn press_of(depth_mm: f64) -> pb::RunRequest {
    let parameters_json = format!(r#"{{"depth_mm": {depth_mm}, "coverings_mm": [1.016]}}"#);
    pb::RunRequest { experiment: "image".into(), parameters_json, who: "test".into(), ..Default::default() }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_plan_says_what_the_rig_can_do_without_a_lease_and_moves_nothing() {
    let (_bus, _calls, desk) = lab(Vec::new()).await;
    let plan = desk.plan(press_of(0.1)).await.map_err(|refusal| refusal.error).unwrap();
    assert_eq!((plan.exit_status(), plan.presses, plan.dwells), (pb::ExitStatus::Done, 1, 1), "{plan:?}");
    assert!(
        plan.duration_s > 0.5 && (plan.deepest_mm - 0.1).abs() < 1e-9 && plan.travel_mm.len() == 6,
        "{plan:?}"
    );
    let plan = desk.plan(press_of(0.9)).await.map_err(|refusal| refusal.error).unwrap();
    assert_eq!(plan.exit_status(), pb::ExitStatus::Refused, "{plan:?}");
    assert!(!plan.message.is_empty(), "{plan:?}");
    let refusal = desk.plan(press_of(-1.0)).await.unwrap_err();
    assert_eq!(refusal.exit_code, exit::USAGE, "{}", refusal.error);
    assert_eq!(desk.engine.run_state().run_id, "", "no run has begun");
    assert_eq!(desk.holder(), "");
}

#[tokio::test(flavor = "multi_thread")]
async fn the_experiments_are_listed_with_their_parameters_one_list_at_a_time() {
    let (_bus, _calls, mut desk) = lab(Vec::new()).await;
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("broken.star"), "def run(rig):\n    pass\nparam(1)\n").unwrap();
    desk.places.experiments = Some(folder.path().to_owned());
    let listed = desk.experiments().await.map_err(|refusal| refusal.error).unwrap();
    let image = listed.iter().find(|each| each.name == "image").unwrap();
    let depth = image.parameters.iter().find(|each| each.name == "depth_mm").unwrap();
    assert_eq!((depth.kind.as_str(), depth.unit.as_deref()), ("float", Some("mm")));
    assert!(image.error.is_empty() && !image.doc.is_empty());
    let broken = listed.iter().find(|each| each.name == "broken").unwrap();
    assert!(!broken.error.is_empty() && broken.parameters.is_empty(), "{broken:?}");

    let taken = Arc::clone(&desk.listing).try_acquire_owned().unwrap();
    assert_eq!(desk.experiments().await.unwrap_err().exit_code, exit::NOT_NOW);
    drop(taken);
    assert!(desk.experiments().await.is_ok());
}

#[tokio::test(flavor = "multi_thread")]
async fn the_rig_is_described_as_it_is_now() {
    let (_bus, _calls, desk) = lab(Vec::new()).await;
    let rig = desk.engine.rig();
    let described = describe(&rig).unwrap();
    assert_eq!((described.col_centres_mm.len(), described.row_centres_mm.len()), (8, 6));
    assert_eq!(described.baseline_counts.len(), 48);
    assert_eq!(Some(described.depth_max_mm), rig.depth_max_mm());
    assert_eq!(described.indenter_shape, "cylinder");
    assert!((described.indenter_width_mm - 1.0).abs() < 1e-9);
    let data = Rig { service: None, ..rig };
    assert!(describe(&data).is_none());
}

fn free_endpoint() -> Endpoint {
    let port = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    format!("tcp/127.0.0.1:{port}").parse().unwrap()
}

/// Asks as often as can be while the stage homes and tells all the time: how many answers saw it homed; an error if that takes
/// a minute.
async fn ask_while_homing() -> Result<u32, mpsc::RecvTimeoutError> {
    let (_bus, _calls, desk) = lab(Vec::new()).await;
    let engine = desk.engine.clone();

    let homing = tokio::spawn(async move { engine.reset().await });
    let (done, ended) = mpsc::channel();
    thread::spawn(move || {
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
