use tactus_model::{Contact, Trail};

use super::*;
use crate::{Definition, RandomRig};

#[test]
fn without_doses_it_is_the_base_model() {
    let base = RandomRig::new(5).unwrap();
    let mut sensor = HiddenSensor::new(&base.sensor, &[], Climate::new(5), 0);
    let mut exact = vec![0.0; 48];
    for (step, (position_mm, depth_mm)) in
        [([2.9, 4.9], 0.3), ([2.9, 4.9], 0.65), ([9.3, 1.2], 0.1), ([9.3, 1.2], 1.4), ([9.3, 1.2], -0.2)]
            .into_iter()
            .enumerate()
    {
        let [x, y] = base.rig.registration.to_robot(position_mm);
        let (indenter, rotation_deg) = (base.sensor.indenter.clone(), 0.0);
        let contact = Contact { indenter, position_mm, rotation_deg, depth_mm };
        base.sensor.model.image(&contact, base.sensor.covering, &mut exact);
        let counts = sensor.step(step as f64, &[x, y, -depth_mm]);
        let off = counts.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1e-9, "{position_mm:?} {depth_mm}: {off}");
    }
}

#[test]
fn the_quadrature_of_a_flat_face_agrees_with_the_base_model() {
    let base = RandomRig::new(5).unwrap();
    let sensor = HiddenSensor::new(&base.sensor, &[], Climate::new(5), 0);
    let (position_mm, depth_mm) = ([7.7, 6.1], 0.4);
    let (mut exact, mut ours) = (vec![0.0; 48], vec![0.0; 48]);
    let contact =
        Contact { indenter: base.sensor.indenter.clone(), position_mm, rotation_deg: 0.0, depth_mm };
    base.sensor.model.indentation(&contact, base.sensor.covering, &mut exact);
    Face::new(&base.sensor.model, position_mm, &sensor.tool()).indentation(depth_mm, &mut ours);
    let peak = exact.iter().copied().fold(0.0, f64::max);
    let off = exact.iter().zip(&ours).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(off < 1e-7 * peak, "{off} of {peak}");
}

#[test]
fn a_leaning_face_all_in_the_covering_presses_as_its_middle_does() {
    // The mean depth of a tilted disc is that of its middle, which lies R tan(a) above its lowest point.
    let base = RandomRig::new(5).unwrap();
    let sensor = HiddenSensor::new(&base.sensor, &[], Climate::new(5), 0);
    let tool = Tool { lean: [0.0, 0.1], ..sensor.tool() };
    // Far from the edges nothing is lost: compare the sums of all elements.
    let sum = |tool: &Tool, depth_mm: f64| {
        let mut counts = vec![0.0; 48];
        Face::new(&base.sensor.model, [8.1, 5.9], tool).indentation(depth_mm, &mut counts);
        counts.iter().sum::<f64>()
    };
    let (leaning, flat) = (sum(&tool, 0.5), sum(&sensor.tool(), 0.5 - 0.05));
    assert!((leaning / flat - 1.0).abs() < 1e-3, "{leaning} {flat}");
}

#[test]
fn another_covering_has_no_past_and_reads_as_the_model_says() {
    let base = RandomRig::new(5).unwrap();
    let physics = Definition::find("softening-exponential").unwrap();
    let doses = [Dose { physics, strength: 1.0, seed: 1 }];
    let [x, y] = base.rig.registration.to_robot([2.9, 4.9]);
    let covering = Covering { thickness_mm: 2.54 };
    let mut swapped = HiddenSensor::new(&base.sensor, &doses, Climate::new(5), 0);
    swapped.step(0.0, &[x, y, -0.6]);
    swapped.set_covering(covering);
    let fresh_base = Simulator { covering, ..base.sensor.clone() };
    let mut fresh = HiddenSensor::new(&fresh_base, &doses, Climate::new(5), 0);
    assert_eq!(swapped.step(1.0, &[x, y, -0.4]), fresh.step(1.0, &[x, y, -0.4]));
}

#[test]
fn the_converter_takes_noise_before_it_rounds() {
    let base = RandomRig::new(5).unwrap();
    let physics = Definition::find("coarse-steps").unwrap();
    let sensor =
        HiddenSensor::new(&base.sensor, &[Dose { physics, strength: 0.5, seed: 1 }], Climate::new(5), 0);
    // Steps of 8: 100.9 lies nearer to 104, 99.5 nearer to 96.
    assert_eq!(
        [sensor.read(100.0, 0.9), sensor.read(99.0, 0.5)].map(|count| format!("{count}")),
        ["104", "96"]
    );
    assert!((sensor.read(5000.0, 0.0) - 4095.0).abs() < 1e-9);
}

#[test]
fn a_virtual_device_can_hold_it_and_give_it_its_trail() {
    let base = RandomRig::new(5).unwrap();
    let doses = ["low-pass-second-order", "lost-motion", "drift-common-walk"].map(|id| Dose {
        physics: Definition::find(id).unwrap(),
        strength: 1.0,
        seed: 1,
    });
    let mut sensor = HiddenSensor::new(&base.sensor, &doses, Climate::new(5), 0);
    let [x, y] = base.rig.registration.to_robot([2.9, 4.9]);
    let mut trail = Trail::new(0.0, [x, y, 1.0]);
    // Devices look whenever they like, also twice at one time; another thread may do it.
    let counts = std::thread::spawn(move || {
        for t_s in [0.0, 0.01, 0.01, 0.2, 30.0] {
            trail.push(t_s, [x, y, 0.5 - 0.1 * f64::min(t_s, 10.0)]);
            sensor.step(t_s, &trail);
        }
        sensor.counts().to_vec()
    });
    assert!(counts.join().unwrap()[17] > 300.0);
}
