//! The controller's `$n=value` settings.

use std::collections::BTreeMap;
use std::fmt::Write;

use tactus_schema::rig::SimulatedStage;
use tactus_wire::grbl::Config;
use tactus_wire::stage::AxisName;

use super::gcode::GrblError;

/// Status reports: bit 0 machine position (else work position), bit 1 buffers.
const REPORT_MASK: u16 = 10;
const SOFT_LIMITS: u16 = 20;
const HARD_LIMITS: u16 = 21;
const HOMING: u16 = 22;
/// Bit by axis: set if it homes towards smaller coordinates.
const HOMING_DIRECTIONS: u16 = 23;
const HOMING_SEEK: u16 = 25;
const HOMING_PULL_OFF: u16 = 27;
const MAX_RATES: std::ops::RangeInclusive<u16> = 110..=112;

/// Values by number; those of a stage, with Grbl's numbers.
#[derive(Debug, Clone)]
pub(super) struct Settings {
    values: BTreeMap<u16, f64>,
}

impl Settings {
    /// The settings of a stage with these axis directions. Steps per mm are the rig's, if the rig file gives them.
    pub(super) fn of(stage: &SimulatedStage, frame: &Config) -> Self {
        let rate_mm_per_min = stage.speed_max_mm_per_s * 60.0;
        let (mut steps_per_mm, mut length_mm) = ([0.0; 3], [0.0; 3]);
        let mut homes_down = 0.0;
        for (name, axis) in AxisName::ALL.into_iter().zip(frame.axes) {
            let [least, greatest] = name.of(stage.travel_mm);
            let step_mm = name.of([stage.lateral_step_mm, stage.lateral_step_mm, stage.vertical_step_mm]);
            axis.machine.set(&mut length_mm, greatest - least);
            // x and y to their least, z to its greatest.
            if name.of([-1.0, -1.0, 1.0]) * axis.direction.sign() < 0.0 {
                homes_down += axis.machine.of([1.0, 2.0, 4.0]);
            }
            axis.machine.set(&mut steps_per_mm, axis.steps_per_mm.unwrap_or(1.0 / step_mm));
        }
        let values = [
            (REPORT_MASK, 3.0),
            (SOFT_LIMITS, 1.0),
            (HARD_LIMITS, 1.0),
            (HOMING, 1.0),
            (HOMING_DIRECTIONS, homes_down),
            (24, 60.0),
            (HOMING_SEEK, rate_mm_per_min.min(1500.0)),
            (HOMING_PULL_OFF, 1.0),
            (100, steps_per_mm[0]),
            (101, steps_per_mm[1]),
            (102, steps_per_mm[2]),
            (110, rate_mm_per_min),
            (111, rate_mm_per_min),
            (112, rate_mm_per_min),
            (120, stage.acceleration_mm_per_s2),
            (121, stage.acceleration_mm_per_s2),
            (122, stage.acceleration_mm_per_s2),
            (130, length_mm[0]),
            (131, length_mm[1]),
            (132, length_mm[2]),
        ];
        Self { values: BTreeMap::from(values) }
    }

    /// Executes `n=value`.
    pub(super) fn write(&mut self, statement: &str) -> Result<(), GrblError> {
        let (number, value) = statement.split_once('=').ok_or(GrblError::STATEMENT)?;
        let number: u16 = number.parse().map_err(|_| GrblError::STATEMENT)?;
        let value: f64 = value.parse().map_err(|_| GrblError::NUMBER)?;
        if !(0.0..=1e9).contains(&value) {
            return Err(GrblError::NEGATIVE);
        }
        *self.values.get_mut(&number).ok_or(GrblError::STATEMENT)? = value;
        Ok(())
    }

    /// What `$$` prints.
    pub(super) fn list(&self) -> String {
        self.values.iter().fold(String::new(), |mut list, (number, value)| {
            let decimals = if *number >= 24 { 3 } else { 0 };
            // Writing to a string does not fail.
            let _infallible = write!(list, "${number}={value:.decimals$}\r\n");
            list
        })
    }

    pub(super) fn reports_machine_position(&self) -> bool {
        self.mask(REPORT_MASK) & 1 != 0
    }

    pub(super) fn reports_buffers(&self) -> bool {
        self.mask(REPORT_MASK) & 2 != 0
    }

    pub(super) fn has_soft_limits(&self) -> bool {
        self.get(SOFT_LIMITS) != 0.0
    }

    pub(super) fn has_hard_limits(&self) -> bool {
        self.get(HARD_LIMITS) != 0.0
    }

    pub(super) fn has_homing(&self) -> bool {
        self.get(HOMING) != 0.0
    }

    /// True if homing takes one of the controller's axes towards smaller coordinates.
    pub(super) fn homes_down(&self, machine: AxisName) -> bool {
        self.mask(HOMING_DIRECTIONS) & machine.of([1, 2, 4]) != 0
    }

    pub(super) fn seek_mm_per_s(&self) -> f64 {
        self.get(HOMING_SEEK).max(1.0) / 60.0
    }

    pub(super) fn pull_off_mm(&self) -> f64 {
        self.get(HOMING_PULL_OFF)
    }

    /// The speed of a feed, limited to the controller's maximum.
    pub(super) fn speed_mm_per_s(&self, feed_mm_per_min: f64) -> f64 {
        feed_mm_per_min.clamp(1.0, self.rapid_mm_per_min()) / 60.0
    }

    /// Feed of G0, mm/min.
    pub(super) fn rapid_mm_per_min(&self) -> f64 {
        MAX_RATES.map(|number| self.get(number)).fold(f64::INFINITY, f64::min).max(1.0)
    }

    fn get(&self, number: u16) -> f64 {
        self.values.get(&number).copied().unwrap_or(0.0)
    }

    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "masks are small whole numbers"
    )]
    fn mask(&self, number: u16) -> u32 {
        self.get(number) as u32
    }
}
