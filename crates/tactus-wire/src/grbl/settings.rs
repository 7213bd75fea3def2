//! The controller's settings (`$$`), and the check that they match the rig.

use std::collections::BTreeMap;

use super::{Config, SessionError};
use crate::stage::Setting;

const SOFT_LIMITS: u16 = 20;
const HOMING: u16 = 22;

/// Bit by axis: set if homing goes towards smaller coordinates.
const HOMING_DIRECTIONS: u16 = 23;

/// `$100` for x; y and z follow.
const STEPS_PER_MM: u16 = 100;

/// Steps per mm are printed with three decimals and stored with seven digits.
const STEPS_TOLERANCE: f64 = 0.0005;
const STEPS_TOLERANCE_SHARE: f64 = 1e-6;

/// Values as written, by number of the setting.
#[derive(Debug, Clone, Default)]
pub(super) struct Settings(BTreeMap<u16, String>);

impl Settings {
    pub(super) fn take(&mut self, number: u16, value: String) {
        self.0.insert(number, value);
    }

    pub(super) fn forget(&mut self) {
        self.0.clear();
    }

    /// Checks the settings against the requirements. Changes nothing.
    pub(super) fn check(&self, config: &Config) -> Result<(), SessionError> {
        // Higher bits are options of grblHAL's homing.
        self.need(HOMING, "1, homing on", |value| has_bits(value, 1))?;
        if config.needs_soft_limits {
            self.need(SOFT_LIMITS, "1, soft limits on", |value| value != 0.0)?;
        }
        for (name, axis) in config.named_axes() {
            let Some(home) = axis.home else { continue };
            let is_down = home.sign() * axis.direction.sign() < 0.0;
            let bit = axis.machine.of([1, 2, 4]);
            let (state, end) =
                (if is_down { "set" } else { "clear" }, if home.sign() < 0.0 { "low" } else { "high" });
            let needed =
                format!("{bit} {state} in it, so that homing takes the rig's {name} to its {end} end");
            self.need(HOMING_DIRECTIONS, &needed, |value| has_bits(value, bit) == is_down)?;
        }
        for (name, axis) in config.named_axes() {
            let Some(steps_per_mm) = axis.steps_per_mm else { continue };
            let number = STEPS_PER_MM + axis.machine.of([0, 1, 2]);
            let needed = format!("{steps_per_mm} steps/mm of its {} for the rig's {name}", axis.machine);
            let near = STEPS_TOLERANCE + STEPS_TOLERANCE_SHARE * steps_per_mm;
            self.need(number, &needed, |value| (value - steps_per_mm).abs() <= near)?;
        }
        Ok(())
    }

    /// The settings that are relevant to a stage.
    pub(super) fn list(&self) -> Vec<Setting> {
        let known = |(number, value): (&u16, &String)| {
            let (name, value) = (format!("${number}"), value.clone());
            Some(Setting { name, value, meaning: meaning(*number)? })
        };
        self.0.iter().filter_map(known).collect()
    }

    fn need(&self, number: u16, needed: &str, fits: impl Fn(f64) -> bool) -> Result<(), SessionError> {
        let found = self.0.get(&number);
        if found.and_then(|value| value.parse().ok()).is_some_and(fits) {
            return Ok(());
        }
        let found = found.map_or("no such setting".to_owned(), Clone::clone);
        Err(SessionError::Setting { number, found, needed: needed.to_owned() })
    }
}

#[expect(clippy::cast_possible_truncation, reason = "masks are small whole numbers")]
fn has_bits(value: f64, bits: i64) -> bool {
    value as i64 & bits == bits
}

/// Meaning of a setting; `None` if it is not relevant to a stage.
fn meaning(number: u16) -> Option<String> {
    let of_axis = |what: &str| {
        let names = ["x", "y", "z"];
        names.get(usize::from(number % 10)).map(|name| format!("{what} of the controller's {name}"))
    };
    let what = match number {
        SOFT_LIMITS => "soft limits",
        21 => "hard limits",
        HOMING => "homing",
        HOMING_DIRECTIONS => "axes that home towards smaller coordinates: 1 x, 2 y, 4 z",
        27 => "homing pull-off, mm",
        100..=102 => return of_axis("steps/mm"),
        110..=112 => return of_axis("greatest speed, mm/min,"),
        120..=122 => return of_axis("acceleration, mm/s^2,"),
        130..=132 => return of_axis("travel, mm,"),
        _ => return None,
    };
    Some(what.to_owned())
}

#[cfg(test)]
#[path = "settings_tests.rs"]
mod tests;
