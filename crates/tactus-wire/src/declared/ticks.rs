//! The device's clock in whole nanoseconds.

use super::Format;

/// Ticks that are not a whole number of ns are converted to ns if they are shorter than this. Longer ones are taken as
/// rounded to whole ns: that error is below the tolerance of a quartz.
const FINE_TICK_NS: f64 = 100_000.0;

/// The unit in which a device's ticks are reported.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TickLength {
    /// The unit in ns; 0 without a clock.
    pub(super) unit_ns: u64,
    /// Units in one tick of the device; `None` if a unit is a tick.
    units_per_tick: Option<f64>,
}

impl TickLength {
    /// The unit for a format's clock.
    pub(super) fn of(format: &Format) -> Self {
        let Some(tick_ns) = format.tick_ns() else { return Self { unit_ns: 0, units_per_tick: None } };
        if tick_ns.fract() != 0.0 && tick_ns < FINE_TICK_NS {
            return Self { unit_ns: 1, units_per_tick: Some(tick_ns) };
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "positive; saturates, as it should"
        )]
        let unit_ns = tick_ns.round() as u64;
        Self { unit_ns, units_per_tick: None }
    }

    /// A tick of the device in units.
    pub(super) fn convert(self, tick: u64) -> u64 {
        let Some(units_per_tick) = self.units_per_tick else { return tick };
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "positive; saturates, as it should"
        )]
        let units = (tick as f64 * units_per_tick).round() as u64;
        units
    }

    pub(super) fn seconds(self, ticks: u64) -> f64 {
        ticks as f64 * self.units_per_tick.unwrap_or(1.0) * self.unit_ns as f64 * 1e-9
    }
}
