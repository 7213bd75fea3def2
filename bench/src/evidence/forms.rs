//! The forms of hidden physics beside the library's own.

use std::collections::BTreeMap;
use std::fmt;

use anyhow::{Context, Result};
use rayon::iter::{IntoParallelRefIterator, ParallelIterator};
use tactus_hidden::{CATALOGUE, Definition};
use tactus_sets::{Amount, Content, NoiseKind, Recipe};

/// A form of hidden physics, and how well the library's form of the same effect follows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Form {
    /// The hidden physics.
    pub physics: &'static str,
    /// The effect that it is an instance of.
    pub effect: &'static str,
    /// True if it is a point of that effect's own parameters.
    pub is_library_point: bool,
    /// Share of what the base model leaves that the effect's best fit explains, without noise.
    pub shrink: f64,
}

/// Strength of each form.
const STRENGTH: f64 = 0.7;
/// Of a set with a thermometer.
const SEED: u64 = 5;

impl Form {
    /// Every form of the library's effects.
    ///
    /// # Errors
    /// If a set cannot be made.
    pub fn all() -> Result<Vec<Self>> {
        let within: Vec<_> =
            CATALOGUE.iter().filter_map(|physics| Some((*physics, physics.effect?))).collect();
        within.par_iter().map(|&(physics, effect)| Self::of(physics, effect)).collect()
    }

    fn of(physics: &'static Definition, effect: &'static str) -> Result<Self> {
        let recipe = Recipe {
            noise: NoiseKind::White,
            content: Content { physics: vec![physics.id.into()], ..Content::default() },
            amount: Amount::Strength(STRENGTH),
            ..Recipe::new(SEED)
        };
        let label = recipe.make()?.label;
        let dosed = label.physics.first().context("the set has one physics")?;
        let shrink = recipe.class_fit(dosed, effect)?.shrink(effect).context("the effect was fitted")?;
        Ok(Self { physics: physics.id, effect, is_library_point: physics.is_library_point, shrink })
    }
}

/// The table of `docs/discovery-evidence.md`: a row for each effect.
pub fn forms_table(forms: &[Form]) -> String {
    let mut by_effect: BTreeMap<&str, [Vec<String>; 2]> = BTreeMap::new();
    for Form { physics, effect, is_library_point, shrink } in forms {
        let cells = by_effect.entry(effect).or_default();
        let shrink = (1000.0 * shrink).floor().max(0.0) / 1000.0;
        cells[usize::from(!is_library_point)].push(format!("{physics} {shrink:.3}"));
    }
    fmt::from_fn(|f| {
        writeln!(f, "| effect | points of its own parameters | other forms |\n|---|---|---|")?;
        for (effect, [points, others]) in &by_effect {
            let points = if points.is_empty() { "-".into() } else { points.join(", ") };
            writeln!(f, "| {effect} | {points} | {} |", others.join(", "))?;
        }
        Ok(())
    })
    .to_string()
}

#[cfg(test)]
#[path = "forms_tests.rs"]
mod tests;
