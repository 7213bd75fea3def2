#![expect(clippy::float_cmp, reason = "these values are exact")]

use super::*;
use crate::Trajectory;
use crate::effect::bench::{THIN, effect, simulator, still, upon};
use crate::effect::{Definition, Effect, Knots, REGISTRY};

/// A press with a slide, on both sides of the surface.
fn way(simulator: &Simulator) -> Trajectory {
    Trajectory::new([
        (0.0, upon(simulator, 20, -1.0)),
        (1.0, upon(simulator, 20, 0.5)),
        (2.0, upon(simulator, 22, 0.3)),
        (2.5, upon(simulator, 22, -2.0)),
    ])
    .unwrap()
}

#[test]
fn without_effects_counts_are_the_base_models_to_the_bit() {
    let plain = simulator([]);
    let (way, mut pipeline) = (way(&plain), Pipeline::new(&plain).unwrap());
    for k in 0..80 {
        let t_s = f64::from(k) / 30.0;
        let [x, y, z] = way.at(t_s);
        let contact = Contact {
            indenter: plain.indenter.clone(),
            position_mm: plain.registration.to_sensor([x, y]),
            rotation_deg: -3.0,
            depth_mm: 0.25 - z,
        };
        let mut want = vec![0.0; 48];
        plain.model.image(&contact, THIN, &mut want);
        assert_eq!(pipeline.step(Moment::at(t_s), &way), want, "at {t_s} s");
        assert_eq!(*pipeline.contact(), contact);
    }
}

#[test]
fn a_pipeline_with_a_press_table_reads_the_same_but_for_its_error() {
    for effects in [
        vec![],
        vec![effect(
            "relaxation",
            [
                ("relaxed_share", 0.3),
                ("time_constant_s", 0.5),
                ("spread_ratio", 1.0),
                ("after_release", 0.0),
                ("recovery_ratio", 1.0),
            ],
        )],
    ] {
        let simulator = simulator(effects);
        let way = way(&simulator);
        let (mut exact, mut sampled) =
            (Pipeline::new(&simulator).unwrap(), Pipeline::new(&simulator).unwrap());
        // The way goes 0.75 mm deep: the deepest part is computed exactly.
        sampled.use_press_table(0.6).unwrap();
        for k in 0..80 {
            let moment = Moment::at(f64::from(k) / 30.0);
            let (want, got) = (exact.step(moment, &way), sampled.step(moment, &way));
            assert!(want.iter().zip(got).all(|(want, got)| (want - got).abs() < 0.05), "{want:?} {got:?}");
        }
    }
}

#[test]
fn neutral_effects_change_nothing_to_the_bit() {
    let plain = simulator([]);
    let way = way(&plain);
    let mut without = Pipeline::new(&plain).unwrap();
    let neutral = REGISTRY
        .iter()
        .map(|definition| Effect::neutral(definition))
        .chain(REGISTRY.iter().filter_map(|definition| flat(definition)));
    let mut pipelines: Vec<Pipeline> =
        neutral.clone().map(|effect| Pipeline::new(&simulator([effect])).unwrap()).collect();
    pipelines.push(Pipeline::new(&simulator(neutral)).unwrap());
    for k in 0..80 {
        let moment = Moment::at(f64::from(k) / 30.0);
        let want = without.step(moment, &way).to_vec();
        for pipeline in &mut pipelines {
            let counts = pipeline.step(moment, &way).to_vec();
            assert!(counts.iter().zip(&want).all(|(a, b)| a.to_bits() == b.to_bits()), "{pipeline:?}");
            for (noisy, noise) in counts.iter().zip([0.4, -0.7, 1e4].into_iter().cycle()) {
                assert_eq!(
                    pipeline.read(*noisy, noise),
                    Readout::of(plain.model.array()).read(*noisy, noise)
                );
            }
        }
    }
}

#[test]
fn every_effect_that_is_not_neutral_changes_something() {
    let plain = simulator([]);
    let way = way(&plain);
    for definition in REGISTRY {
        let images = |effects: Vec<Effect>| -> Vec<_> {
            simulator(effects).run(&way, 30.0, 80, || 0.0).unwrap().map(|image| image.counts).collect()
        };
        assert_ne!(images(vec![strong(definition)]), images(vec![]), "{}", definition.name);
        if let Some(free) = with_knots(definition, |at| 0.5 * at) {
            assert_ne!(images(vec![free]), images(vec![]), "{} with knots", definition.name);
        }
    }
}

/// An effect with knots that are all 0, if it may have knots.
fn flat(definition: &'static Definition) -> Option<Effect> {
    with_knots(definition, |_| 0.0)
}

/// An effect at the neutral values of its parameters with knots, if it may have knots.
fn with_knots(definition: &'static Definition, value: impl Fn(f64) -> f64) -> Option<Effect> {
    let curve = definition.curve.as_ref()?;
    let at = vec![0.05, 0.2, 0.4];
    let values = at.iter().map(|at| value(*at)).collect();
    let kept = definition.parameters.iter().filter(|one| !curve.replaces.contains(&one.name));
    let parameters = kept.map(|one| (one.name, one.neutral));
    Some(Effect::of_knots(definition, parameters, Knots { at, values }).unwrap())
}

/// An effect at a tenth of its range; 100 counts.
fn strong(definition: &'static Definition) -> Effect {
    definition.parameters.iter().fold(Effect::neutral(definition), |effect, parameter| {
        let [least, most] = parameter.range;
        let most = if parameter.is_counts() { 1000.0 } else { most };
        let value = if parameter.name == "element" { 20.0 } else { 0.9 * parameter.neutral + 0.1 * most };
        // One that starts later is not seen yet.
        if ["answers_for", "start_s"].contains(&parameter.name) {
            effect
        } else {
            effect.with(parameter.name, value.max(least)).unwrap()
        }
    })
}

#[test]
fn a_step_on_what_another_pipeline_reached_is_the_whole_step_to_the_bit() {
    let shared = || [effect("surface-offset", [("offset_mm", 0.02)]), strong(find("relaxation"))];
    for definition in REGISTRY {
        let added = strong(definition);
        if added.acts_before_signal() {
            continue;
        }
        let after = [added, strong(find("saturation")), strong(find("low-pass"))];
        let trunk = simulator(shared());
        let way = way(&trunk);
        let mut trunk = Pipeline::new(&trunk).unwrap();
        let mut branch = Pipeline::new(&simulator(after.clone())).unwrap();
        let mut whole = Pipeline::new(&simulator(shared().into_iter().chain(after))).unwrap();
        for k in 0..60 {
            let moment = Moment::at(f64::from(k) / 20.0);
            let mut signals_mm = Vec::new();
            trunk.reach(moment, &way, &mut signals_mm);
            assert_eq!(signals_mm.len(), 2 * 48, "before and after relaxation");
            let counts = branch.step_on(moment, trunk.contact(), &signals_mm[48..]);
            assert_eq!(counts, whole.step(moment, &way), "{} at moment {k}", definition.name);
        }
    }
    assert!(strong(find("heavy-tail")).acts_before_signal());
}

/// Every effect of the library, and with a free curve those that may have one.
fn all_strong() -> impl Iterator<Item = Effect> {
    let both = |definition| [Some(strong(definition)), with_knots(definition, |at| 0.1 * at)];
    REGISTRY.iter().copied().flat_map(both).flatten()
}

/// Moments of which every third is wanted, while the sensor warms up.
fn moments() -> impl Iterator<Item = (Moment, bool)> {
    let moment = |k| Moment { t_s: f64::from(k) / 20.0, temperature_c: Some(20.0 + 0.1 * f64::from(k)) };
    (0..60).map(move |k| (moment(k), k % 3 == 2))
}

#[test]
fn moments_that_nobody_wants_change_nothing_of_the_others() {
    for effect in all_strong() {
        for effects in [vec![effect.clone()], vec![strong(find("relaxation")), effect.clone()]] {
            let simulator = simulator(effects);
            let way = way(&simulator);
            let [mut all, mut some] = [(); 2].map(|()| Pipeline::new(&simulator).unwrap());
            for (moment, is_wanted) in moments() {
                let want = all.step(moment, &way);
                if is_wanted {
                    assert_eq!(some.step(moment, &way), want, "{} at {} s", effect.name(), moment.t_s);
                } else {
                    some.pass(moment, &way);
                }
            }
        }
    }
}

#[test]
fn nor_do_they_on_what_another_pipeline_reached() {
    let trunk = simulator([]);
    let way = way(&trunk);
    for effect in all_strong() {
        let mut trunk = Pipeline::new(&trunk).unwrap();
        let branch = simulator([effect.clone()]);
        let [mut all, mut some] = [(); 2].map(|()| Pipeline::new(&branch).unwrap());
        for (moment, is_wanted) in moments() {
            let mut signals_mm = Vec::new();
            trunk.reach(moment, &way, &mut signals_mm);
            let want = all.step_on(moment, trunk.contact(), &signals_mm);
            if is_wanted {
                let counts = some.step_on(moment, trunk.contact(), &signals_mm);
                assert_eq!(counts, want, "{} at {} s", effect.name(), moment.t_s);
            } else {
                some.pass_on(moment, trunk.contact(), &signals_mm);
            }
        }
    }
}

#[test]
fn what_does_not_act_in_time_does_the_same_to_a_frame_whatever_was_before() {
    for effect in all_strong() {
        let simulator = simulator([effect.clone()]);
        let way = way(&simulator);
        let mut in_time = Pipeline::new(&simulator).unwrap();
        let differs = moments().fold(false, |differs, (moment, _)| {
            differs | (in_time.step(moment, &way) != still(&simulator, way.at(moment.t_s)))
        });
        assert_eq!(differs, effect.acts_in_time(), "{}", effect.name());
    }
}

fn find(name: &str) -> &'static Definition {
    Definition::find(name).unwrap()
}

#[test]
fn changes_of_covering_surface_and_stiffness_show_under_a_resting_tip() {
    let plain = simulator([]);
    let tip_mm = upon(&plain, 21, 0.5);
    let mut pipeline = Pipeline::new(&plain).unwrap();
    let mut read = |change: &dyn Fn(&mut Pipeline)| {
        change(&mut pipeline);
        pipeline.step(Moment::at(1.0), &tip_mm).to_vec()
    };
    let first = read(&|_| {});
    assert_eq!(first, still(&plain, tip_mm));
    let thick = Simulator { covering: Covering { thickness_mm: 5.08 }, ..plain.clone() };
    assert_eq!(read(&|one| one.set_covering(thick.covering)), still(&thick, tip_mm));
    let high = Simulator { surface_mm: 0.35, ..thick.clone() };
    assert_eq!(read(&|one| one.set_surface_mm(0.35)), still(&high, tip_mm));
    let soft = read(&|one| one.set_stiffness(0.5))[21] - 100.0;
    let hard = still(&high, tip_mm)[21] - 100.0;
    assert!(soft < 0.5 * hard && soft > 0.4 * hard, "the quadratic term loses more than half: {soft} {hard}");
}

#[test]
fn a_path_that_is_late_is_asked_for_an_earlier_instant() {
    #[derive(Debug)]
    struct Late(f64);
    impl OnMotion for Late {
        fn instant_s(&self, t_s: f64) -> f64 {
            t_s - self.0
        }
    }
    static LATE: Definition = Definition {
        name: "late",
        summary: "a lab's own effect",
        parameters: &[crate::effect::Parameter::real("lag_s", 0.0, [-1.0, 1.0])],
        near_twins: &[],
        acts_by: &[],
        shown_by: &[],
        curve: None,
        make: Make::Motion(|values| Box::new(Late(values[0]))),
    };
    let plain = simulator([]);
    let way = way(&plain);
    for lag_s in [-0.4, 0.3] {
        let late = simulator([Effect::of(&LATE, [("lag_s", lag_s)]).unwrap()]);
        let got = Pipeline::new(&late).unwrap().step(Moment::at(1.5), &way).to_vec();
        assert_eq!(got, still(&plain, way.at(1.5 - lag_s)));
    }
}

#[test]
fn time_that_goes_back_stands_still() {
    let creeping = simulator([effect(
        "relaxation",
        [
            ("relaxed_share", 0.3),
            ("time_constant_s", 1.0),
            ("spread_ratio", 1.0),
            ("after_release", 0.0),
            ("recovery_ratio", 1.0),
        ],
    )]);
    let tip_mm = upon(&creeping, 21, 0.5);
    let (mut straight, mut back) = (Pipeline::new(&creeping).unwrap(), Pipeline::new(&creeping).unwrap());
    for t_s in [0.0, 1.0, 2.0] {
        straight.step(Moment::at(t_s), &tip_mm);
    }
    for t_s in [0.0, 1.0, 0.2, 2.0] {
        back.step(Moment::at(t_s), &tip_mm);
    }
    assert_eq!(straight.step(Moment::at(2.0), &tip_mm), back.step(Moment::at(2.0), &tip_mm));
}

#[test]
fn a_place_that_is_no_number_does_not_panic() {
    let neutral = simulator(REGISTRY.iter().map(|definition| Effect::neutral(definition)));
    let strong = simulator(REGISTRY.iter().map(|definition| strong(definition)));
    let free = simulator(REGISTRY.iter().filter_map(|definition| with_knots(definition, |at| 0.5 * at)));
    for everything in [neutral, strong, free] {
        let mut pipeline = Pipeline::new(&everything).unwrap();
        for tip_mm in [[f64::NAN; 3], [f64::INFINITY; 3], [1e300, -1e300, -1e300]] {
            pipeline.step(Moment::at(f64::NAN), &tip_mm);
            pipeline.step(Moment::at(1.0), &tip_mm);
        }
    }
}

#[test]
fn remembered_images_are_those_that_would_be_computed() {
    let tilt =
        || effect("indenter-tilt", [("tilt_x_deg", 3.0), ("tilt_y_deg", -2.0), ("touched_share", 0.5)]);
    let tail = || effect("heavy-tail", [("tail_share", 0.2), ("width_ratio", 2.0)]);
    for indenter in [
        Indenter::Cylinder { diameter_mm: 1.0 },
        Indenter::Box { size_mm: [2.0, 1.0] },
        Indenter::Sphere { diameter_mm: 3.0 },
    ] {
        for effects in [vec![], vec![tail()], vec![tilt()]] {
            let simulator = Simulator { indenter: indenter.clone(), ..simulator(effects) };
            // The second press is deeper than the covering is thick.
            let way = Trajectory::new([
                (0.0, upon(&simulator, 20, -0.2)),
                (1.0, upon(&simulator, 20, 0.8)),
                (2.0, upon(&simulator, 20, 1.4)),
                (3.0, upon(&simulator, 21, 0.3)),
            ])
            .unwrap();
            let mut computed = Pipeline::new(&simulator).unwrap();
            let images = Arc::new(Images::new(50));
            for _ in 0..2 {
                let mut remembering = Pipeline::new(&simulator).unwrap();
                remembering.share(Arc::clone(&images));
                computed.reset();
                for k in 0..90 {
                    let moment = Moment::at(f64::from(k) / 30.0);
                    let want = computed.step(moment, &way).to_vec();
                    let got = remembering.step(moment, &way);
                    let worst = got.iter().zip(&want).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                    assert!(worst < 1e-10, "{indenter:?} {k}: {worst} counts");
                }
            }
        }
    }
}
