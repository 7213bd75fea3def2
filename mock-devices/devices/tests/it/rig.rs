//! The virtual rig through the production drivers, in virtual time.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::sync::Arc;
use std::time::Duration;

use tactus_device::{
    ArrayExpectation, Clock, DrivenStage, SensorCodec, SensorDriver, SensorEvent, Stage, StageError,
    StageOptions, Target,
};
use tactus_model::{Contact, ForwardModel, Response};
use tactus_schema::{Frame, Rig, pb};
use tactus_virtual::faults::{FaultError, FaultScript};
use tactus_virtual::{RigControl, Truth, VirtualRig, twin_of};
use tactus_wire::declared::RawFormat;
use tactus_wire::weiss::Checksum;
use tokio::time::{sleep, timeout};

use crate::permits::{homing, permit};

/// A rig with its drivers connected.
struct ConnectedRig {
    rig: Rig,
    control: RigControl,
    sensor: SensorDriver,
    stage: Arc<dyn Stage>,
}

fn sim_rig() -> Rig {
    Rig::from_toml(include_str!("../../../../config/rigs/sim.toml")).unwrap()
}

/// The rig's twin: it hides only the kinematics, so the declared model holds.
fn ideal_rig() -> Rig {
    twin_of(&sim_rig())
}

async fn lab(rig: Rig, seed: u64) -> ConnectedRig {
    lab_speaking(SensorCodec::default(), rig, seed).await
}

async fn lab_speaking(codec: SensorCodec, rig: Rig, seed: u64) -> ConnectedRig {
    let clock = Clock::paused();
    let mut devices = VirtualRig::of(Truth::of_rig(&rig, seed), rig.covering, &codec);
    let sensor = SensorDriver::start(codec, devices.sensor_connector(), ArrayExpectation::of(&rig), clock);
    let options = StageOptions { tolerance_mm: 0.005, simulated: true };
    let protocol = &rig.service.as_ref().unwrap().stage.protocol;
    let (stage, mut reports) = DrivenStage::start(devices.stage_connector(), protocol, options, clock);
    // The reports must be drained for the stage to go on.
    tokio::spawn(async move { while reports.recv().await.is_some() {} });
    let mut state = stage.state();
    state.wait_for(|state| state.status() != pb::StageStatus::Disconnected).await.unwrap();
    if state.borrow().status() == pb::StageStatus::Alarm {
        stage.clear_alarm().await.unwrap();
    }
    stage.home(homing()).await.unwrap();
    ConnectedRig { rig, control: devices.control(), sensor, stage }
}

impl ConnectedRig {
    /// Moves up, above the place, and down to a depth.
    async fn press(&self, [x, y]: [f64; 2], depth_mm: f64) -> Result<[f64; 3], StageError> {
        for z in [2.0, -depth_mm] {
            self.go([x, y, z]).await?;
        }
        Ok([x, y, -depth_mm])
    }

    async fn go(&self, position_mm: [f64; 3]) -> Result<[f64; 3], StageError> {
        self.stage.move_to(permit(Target { position_mm, speed_mm_per_s: 20.0 })).await
    }

    /// The next frames, and the gaps among them.
    async fn read(&mut self, frames: usize) -> (Vec<Frame>, Vec<pb::Gap>) {
        let (mut read, mut gaps) = (Vec::new(), Vec::new());
        while read.len() < frames {
            match self.sensor.next().await {
                SensorEvent::Frame(frame) => read.push(frame),
                SensorEvent::Gap(gap) => gaps.push(gap),
                SensorEvent::Connected(_) | SensorEvent::Lost(_) => {}
            }
        }
        (read, gaps)
    }

    /// Skips frames that were read before now. Returns the first one after them.
    async fn fresh(&mut self) -> Frame {
        while timeout(Duration::from_millis(1), self.sensor.next()).await.is_ok() {}
        self.read(1).await.0.remove(0)
    }

    fn inject(&self, line: &str) {
        self.control.inject(line.parse().unwrap()).unwrap();
    }
}

fn mean(frames: &[Frame]) -> Vec<f64> {
    let elements = frames[0].counts.len();
    let of = |element: usize| frames.iter().map(|frame| f64::from(frame.counts[element])).sum::<f64>();
    (0..elements).map(|element| of(element) / frames.len() as f64).collect()
}

#[tokio::test(start_paused = true)]
async fn a_press_reads_what_the_declared_model_says() {
    let rig = ideal_rig();
    let model = ForwardModel::new(
        rig.array.clone(),
        rig.psf,
        Response {
            sensitivity_counts_per_mm: rig.sensitivity_counts_per_mm.clone(),
            baseline_counts: rig.baseline_counts.clone(),
            quadratic_per_mm: vec![0.0; 48],
            reference_indenter: rig.mounted().unwrap(),
            reference_covering: rig.sensitivity_reference.covering,
        },
    )
    .unwrap();
    let centre = rig.array.centre_mm(27).unwrap();
    let mut want = vec![0.0; 48];
    let contact =
        Contact { indenter: rig.mounted().unwrap(), position_mm: centre, rotation_deg: 0.0, depth_mm: 0.5 };
    model.image(&contact, rig.covering, &mut want);
    let place = rig.registration.to_robot(centre);
    let mut lab = lab(rig, 1).await;
    lab.press(place, 0.5).await.unwrap();
    assert!(lab.control.is_in_contact());
    assert!((lab.control.deepest_mm() - 0.5).abs() < 1e-9);
    lab.fresh().await;
    let (frames, gaps) = lab.read(3).await;
    assert!(gaps.is_empty());
    for frame in &frames {
        for (got, want) in frame.counts.iter().zip(&want) {
            // Half a count of rounding, plus the effect of half a step of 3 um at 80 counts/mm.
            assert!((f64::from(*got) - want).abs() < 0.65, "{got} {want}");
        }
    }
    assert!((want[27] - 600.0).abs() < 1e-9);
}

#[tokio::test(start_paused = true)]
async fn the_rig_hides_what_its_file_says_and_noise_averages_out() {
    let mut lab = lab(sim_rig(), 5).await;
    let centre = lab.rig.array.centre_mm(27).unwrap();
    lab.press(lab.rig.registration.to_robot(centre), 0.5).await.unwrap();
    lab.fresh().await;
    let (frames, _) = lab.read(90).await;
    let want = lab.control.image_counts();
    for (element, (got, want)) in mean(&frames).into_iter().zip(want).enumerate() {
        // Noise of 2 counts over 90 frames: 0.21; five of them.
        assert!((got - want).abs() < 1.1, "element {element}: {got} {want}");
    }
    let truth = lab.control.truth();
    let want = 100.0 + truth.model.response().sensitivity_counts_per_mm[27] * (0.5 + 0.15 * 0.25);
    let got = mean(&frames)[27];
    // The true centre is 0.1 mm away, which reduces the signal by a thousandth.
    assert!((got - want).abs() < 3.0, "{got} {want}");
}

#[tokio::test(start_paused = true)]
async fn one_seed_gives_identical_frames() {
    async fn counts(seed: u64) -> Vec<Frame> {
        let mut lab = lab(sim_rig(), seed).await;
        lab.press([30.0, 20.0], 0.4).await.unwrap();
        lab.read(100).await.0
    }
    let bare = |frames: Vec<Frame>| -> Vec<_> {
        frames
            .into_iter()
            .map(|frame| (frame.seq, frame.device_tick, frame.received.mono, frame.counts))
            .collect()
    };
    assert_eq!(bare(counts(3).await), bare(counts(3).await));
    assert_ne!(bare(counts(3).await), bare(counts(4).await));
}

#[tokio::test(start_paused = true)]
async fn lost_frames_are_missed_by_their_number() {
    let mut lab = lab(sim_rig(), 1).await;
    lab.fresh().await;
    lab.inject("sensor drop-frames 5");
    let (_, gaps) = lab.read(30).await;
    assert_eq!(gaps.iter().map(|gap| gap.frames_lost).collect::<Vec<_>>(), [5]);
    lab.inject("sensor wrong-checksum");
    let (_, gaps) = lab.read(30).await;
    assert_eq!(gaps.iter().map(|gap| gap.frames_lost).collect::<Vec<_>>(), [1]);
}

#[tokio::test(start_paused = true)]
async fn a_sensor_that_is_unplugged_comes_back_with_a_gap_of_the_right_length() {
    let mut lab = lab(sim_rig(), 1).await;
    let before = lab.fresh().await;
    lab.inject("sensor disconnect 2s");
    let (frames, gaps) = lab.read(60).await;
    let [gap] = &gaps[..] else { panic!("one gap: {gaps:?}") };
    assert_eq!(frames[0].epoch, before.epoch + 1);
    let away = frames[0].received.mono.since(before.received.mono).as_secs_f64();
    let missed = (away * 30.0).round() - 1.0;
    assert!(away > 2.0, "{away}");
    assert!((gap.frames_lost as f64 - missed).abs() < 0.1, "{gap:?} {missed}");
}

#[tokio::test(start_paused = true)]
async fn a_stop_leaves_the_tip_near_where_it_was() {
    let lab = lab(sim_rig(), 1).await;
    lab.go([20.0, 20.0, 20.0]).await.unwrap();
    let stage = Arc::clone(&lab.stage);
    let going = tokio::spawn(async move {
        stage.move_to(permit(Target { position_mm: [20.0, 20.0, -0.7], speed_mm_per_s: 20.0 })).await
    });
    sleep(Duration::from_millis(500)).await;
    let before_mm = lab.control.tip_mm()[2];
    lab.stage.stop();
    assert!(matches!(going.await.unwrap(), Err(StageError::Stopped { .. })));
    sleep(Duration::from_secs(5)).await;
    let after_mm = lab.control.tip_mm()[2];
    // Braking from 20 mm/s takes 0.4 mm; the byte goes out at once.
    assert!(before_mm - after_mm < 0.5 && !lab.control.is_moving(), "{before_mm} {after_mm}");
    lab.go([20.0, 20.0, 20.0]).await.unwrap();
}

#[tokio::test(start_paused = true)]
async fn a_move_that_did_not_happen_is_never_done() {
    for fault in [
        "stage lie 0.05",
        "stage ignore-moves",
        "stage never-idle",
        "stage refuse",
        "stage alarm 1",
        "stage reset",
        "stage stall 10s",
        "stage disconnect 10s",
    ] {
        let lab = lab(sim_rig(), 1).await;
        lab.go([20.0, 20.0, 20.0]).await.unwrap();
        lab.inject(fault);
        let result = timeout(Duration::from_mins(1), lab.go([25.0, 20.0, 20.0])).await;
        assert!(matches!(result, Ok(Err(_))), "{fault}: {result:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn lost_steps_show_in_the_truth_only() {
    let lab = lab(sim_rig(), 1).await;
    lab.go([20.0, 20.0, 2.0]).await.unwrap();
    lab.inject("stage lost-steps 0.05");
    lab.go([20.0, 20.0, 20.0]).await.unwrap();
    let reached = lab.go([20.0, 20.0, 2.0]).await.unwrap();
    assert!((reached[2] - 2.0).abs() < 0.005);
    assert!((lab.control.tip_mm()[2] - 1.95).abs() < 0.005);
}

#[tokio::test(start_paused = true)]
async fn a_fault_script_strikes_at_its_times() {
    let lab = lab(sim_rig(), 1).await;
    let script = "[[fault]]\nat_s = 100.0\ncommand = \"rig covering 2.54\"\n[[fault]]\nat_s = 101.0\ncommand = \"sensor stuck 48\"";
    let outcome = lab.control.play(&FaultScript::from_toml(script).unwrap()).await;
    assert_eq!(outcome, Err(FaultError::Element { element: 48, last: 47 }));
    assert!((lab.control.covering_mm() - 2.54).abs() < 1e-12);
}

#[tokio::test(start_paused = true)]
async fn garbage_on_every_link_harms_no_frame_and_no_move() {
    let mut lab = lab(sim_rig(), 1).await;
    lab.fresh().await;
    for line in ["stage echo-garbage", "sensor drip 1s", "sensor garbage 200"] {
        lab.inject(line);
    }
    lab.go([20.0, 20.0, 20.0]).await.unwrap();
    let (frames, gaps) = lab.read(60).await;
    assert!(gaps.is_empty(), "{gaps:?}");
    assert!(frames.windows(2).all(|pair| pair[1].seq == pair[0].seq + 1));
}

/// The shipped declared format.
fn declared() -> SensorCodec {
    let toml = include_str!("../../../../config/links/digitacts.toml");
    let format = toml::from_str::<RawFormat>(toml).unwrap().check().unwrap();
    SensorCodec::Declared { format: Arc::new(format) }
}

/// The simulated rig with another number of rows and columns, and no faulty elements.
fn rig_of(rows: usize, cols: usize) -> Rig {
    let centres = |count: usize| (0..count).map(|place| 0.9 + 2.0 * place as f64).collect::<Vec<_>>();
    let toml = include_str!("../../../../config/rigs/sim.toml")
        .replace("rows = 6", &format!("rows = {rows}"))
        .replace("cols = 8", &format!("cols = {cols}"))
        .replace("[0.9, 2.9, 5.1, 7.1, 9.1, 11.1, 13.3, 15.3]", &format!("{:?}", centres(cols)))
        .replace("[0.9, 2.9, 4.9, 6.9, 8.9, 10.9]", &format!("{:?}", centres(rows)))
        .replace("miswired = ", "# ");
    Rig::from_toml(&toml).unwrap()
}

#[tokio::test(start_paused = true)]
async fn every_protocol_reads_the_same_world() {
    let singletact = SensorCodec::SingleTact { addresses: vec![10, 11, 12] };
    for (codec, rig) in [
        (SensorCodec::WeissDsa { checksum: Checksum::Sum8 }, sim_rig()),
        (declared(), sim_rig()),
        (SensorCodec::AnySkin, rig_of(5, 3)),
        (singletact, rig_of(1, 3)),
        (SensorCodec::SingleTact { addresses: vec![4] }, rig_of(1, 1)),
    ] {
        let mut lab = lab_speaking(codec.clone(), rig, 1).await;
        let centre = lab.rig.array.centre_mm(0).unwrap();
        lab.press(lab.rig.registration.to_robot(centre), 0.5).await.unwrap();
        lab.fresh().await;
        let (frames, gaps) = lab.read(60).await;
        assert!(gaps.is_empty(), "{codec:?}: {gaps:?}");
        let told_c = matches!(codec, SensorCodec::AnySkin).then_some(25.0);
        assert!(frames.iter().all(|frame| frame.temperature_c == told_c), "{codec:?}: {:?}", frames[0]);
        assert!(
            frames.windows(2).all(|pair| pair[1].seq == pair[0].seq + 1 && pair[1].epoch == pair[0].epoch)
        );
        let want = lab.control.image_counts();
        assert!(want[0] > 400.0);
        for (got, want) in mean(&frames).into_iter().zip(want) {
            assert!((got - want).abs() < 1.5, "{codec:?}: {got} {want}");
        }
        lab.inject("sensor disconnect 2s");
        let (after, gaps) = lab.read(30).await;
        let epoch = frames[0].epoch + 1;
        assert!(after.iter().any(|frame| frame.epoch == epoch) && gaps.len() == 1, "{codec:?}: {gaps:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn described_frames_that_are_lost_are_missed_by_their_number() {
    for (fault, lost) in [
        ("sensor drop-frames 5", &[5][..]),
        ("sensor drop-frames 1", &[1]),
        ("sensor wrong-checksum", &[1]),
        ("sensor truncate", &[1]),
        ("sensor drop 7", &[1]),
        ("sensor wrong-count 47", &[1]),
        ("sensor stall 500ms", &[15]),
        ("sensor duplicate", &[]),
        ("sensor garbage 300", &[]),
        ("sensor drip 1s", &[]),
        ("sensor burst 4", &[]),
    ] {
        let mut lab = lab_speaking(declared(), sim_rig(), 1).await;
        lab.fresh().await;
        lab.inject(fault);
        let (frames, gaps) = lab.read(60).await;
        assert_eq!(gaps.iter().map(|gap| gap.frames_lost).collect::<Vec<_>>(), lost, "{fault}");
        assert!(frames.iter().all(|frame| frame.epoch == frames[0].epoch), "{fault}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_described_clock_wraps_unnoticed_and_jumps_into_a_new_epoch() {
    let mut lab = lab_speaking(declared(), sim_rig(), 1).await;
    let before = lab.fresh().await;
    lab.inject("sensor clock-wrap");
    let (frames, gaps) = lab.read(90).await;
    assert!(
        gaps.is_empty() && frames[89].epoch == before.epoch + 1,
        "set forward once, then wrapped: {gaps:?}"
    );
    lab.inject("sensor clock-jump -500ms");
    let (frames, gaps) = lab.read(10).await;
    assert!(gaps.is_empty() && frames[9].epoch == before.epoch + 2, "{gaps:?}");
}

#[tokio::test(start_paused = true)]
async fn without_count_and_clock_the_frame_after_it_tells_a_loss() {
    for (fault, lost) in [
        ("sensor drop-frames 5", &[5][..]),
        ("sensor drop-frames 1", &[1]),
        ("sensor burst 4", &[]),
        ("sensor wrong-checksum", &[1]),
        ("sensor drop 7", &[1]),
        ("sensor garbage 300", &[]),
    ] {
        let mut lab = lab_speaking(SensorCodec::AnySkin, rig_of(5, 3), 1).await;
        lab.fresh().await;
        lab.inject(fault);
        let (_, gaps) = lab.read(60).await;
        assert_eq!(gaps.iter().map(|gap| gap.frames_lost).collect::<Vec<_>>(), lost, "{fault}");
    }
}

#[tokio::test(start_paused = true)]
async fn polls_that_are_not_answered_are_counted() {
    let codec = SensorCodec::SingleTact { addresses: vec![4] };
    for (fault, least, most) in
        [("sensor drop-frames 1", 6, 8), ("sensor stall 500ms", 13, 24), ("sensor garbage 100", 0, 0)]
    {
        let mut lab = lab_speaking(codec.clone(), rig_of(1, 1), 1).await;
        lab.fresh().await;
        lab.inject(fault);
        let (_, gaps) = lab.read(60).await;
        // The driver waits 250 ms for an answer; that is the time of 7 frames.
        let lost: u64 = gaps.iter().map(|gap| gap.frames_lost).sum();
        assert!((least..=most).contains(&lost), "{fault}: {gaps:?}");
    }
}

#[test]
fn every_shipped_rig_is_one_that_can_be_simulated() {
    for text in [
        include_str!("../../../../config/rigs/sim.toml"),
        include_str!("../../../../config/rigs/pty.toml"),
        include_str!("../../../../config/rigs/pty-declared.toml"),
    ] {
        let rig = Rig::from_toml(text).unwrap();
        assert!(rig.simulated && rig.simulation.is_some() && rig.service.is_some());
    }
}
