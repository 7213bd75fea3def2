//! Rigs with different true parameters.

use anyhow::{Context, Result};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use toml::{Table, Value};

/// The shipped simulated rig.
const SIM: &str = include_str!("../../../config/rigs/sim.toml");
/// Its elements.
const ELEMENTS: i64 = 48;
/// Elements in a row.
const COLS: i64 = 8;

/// The shipped simulated rig with other parameters. Its file declares the true spread; registration and surface are off.
pub(super) fn varied(seed: u64) -> Result<String> {
    let mut rig: Table = toml::from_str(SIM)?;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut within = |low: f64, high: f64| rng.random_range(low..high);
    let mut put = |path: &[&str], value: Value| {
        let (last, tables) = path.split_last().context("a path has an end")?;
        let mut table = &mut rig;
        for name in tables {
            table = table.get_mut(*name).and_then(Value::as_table_mut).with_context(|| (*name).to_owned())?;
        }
        table.insert((*last).into(), value);
        anyhow::Ok(())
    };
    put(&["sensitivity_counts_per_mm"], within(500.0, 850.0).into())?;
    put(&["psf", "sigma_intercept_mm"], within(2.0, 2.5).into())?;
    put(&["psf", "sigma_per_mm"], within(0.4, 0.6).into())?;
    put(&["simulation", "seed"], i64::try_from(seed + 1)?.into())?;
    put(&["simulation", "noise_rms_counts"], within(1.0, 4.0).into())?;
    put(&["simulation", "gain_spread"], within(0.02, 0.12).into())?;
    // Either no curvature, or one that is large enough to be estimated.
    let curved = within(0.0, 1.0) > 0.2;
    put(&["simulation", "quadratic_per_mm"], if curved { within(0.05, 0.3) } else { 0.0 }.into())?;
    put(&["simulation", "surface_mm"], within(-0.05, 0.05).into())?;
    let origin = Value::Array(vec![within(-0.15, 0.15).into(), within(-0.15, 0.15).into()]);
    put(&["simulation", "registration_error", "origin_mm"], origin)?;
    put(&["simulation", "registration_error", "rotation_deg"], within(-0.5, 0.5).into())?;
    let Faults { dead, stuck, noisy, miswired } = Faults::draw(&mut rng);
    // A stuck reading lies far from the baseline, so the rig file has to say that it is faulty.
    put(&["envelope", "unwatched_elements"], list(stuck.iter().copied()))?;
    put(&["simulation", "dead"], list(dead))?;
    let stuck = stuck.into_iter().map(|element| entry(element, "counts", (40 * (element + 1)).into()));
    put(&["simulation", "stuck"], list(stuck))?;
    let noisy =
        noisy.into_iter().map(|element| entry(element, "noise_rms_counts", (20.0 + element as f64).into()));
    put(&["simulation", "noisy"], list(noisy))?;
    let crossed =
        miswired.into_iter().map(|element| entry(element, "answers_for", neighbour(element).into()));
    put(&["simulation", "miswired"], list(crossed))?;
    Ok(toml::to_string(&rig)?)
}

/// Up to two elements of each kind of fault, and up to one stuck element, all different.
struct Faults {
    dead: Vec<i64>,
    stuck: Vec<i64>,
    noisy: Vec<i64>,
    miswired: Vec<i64>,
}

impl Faults {
    fn draw(rng: &mut impl Rng) -> Self {
        let mut left: Vec<i64> = (0..ELEMENTS).collect();
        let mut draw = |most: u32| {
            let count = rng.random_range(0..=most);
            (0..count).map(|_| left.swap_remove(rng.random_range(0..left.len()))).collect()
        };
        Self { dead: draw(2), stuck: draw(1), noisy: draw(2), miswired: draw(2) }
    }
}

fn list(values: impl IntoIterator<Item = impl Into<Value>>) -> Value {
    Value::Array(values.into_iter().map(Into::into).collect())
}

fn entry(element: i64, name: &str, value: Value) -> Value {
    Value::Table([("element".to_owned(), element.into()), (name.to_owned(), value)].into_iter().collect())
}

fn neighbour(element: i64) -> i64 {
    if element % COLS < COLS - 1 { element + 1 } else { element - 1 }
}
