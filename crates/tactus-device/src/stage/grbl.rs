//! Converts a rig's axes to the configuration of a `grbl` session.

use tactus_schema::rig::{AxisEnd, GrblAxes, GrblAxis, MachineAxis};
use tactus_wire::grbl::{Axis, Config};
use tactus_wire::stage::{AxisName, Direction};

use super::direction;

pub(super) fn config(GrblAxes { axes, soft_limits }: &GrblAxes, tolerance_mm: f64) -> Config {
    Config { tolerance_mm, axes: axes.map(axis), needs_soft_limits: *soft_limits }
}

fn axis(GrblAxis { machine_axis, is_forward, origin_mm, steps_per_mm, home }: GrblAxis) -> Axis {
    let machine = match machine_axis {
        MachineAxis::X => AxisName::X,
        MachineAxis::Y => AxisName::Y,
        MachineAxis::Z => AxisName::Z,
    };
    let home = home.map(|end| match end {
        AxisEnd::Low => Direction::Negative,
        AxisEnd::High => Direction::Positive,
    });
    Axis { machine, direction: direction(is_forward), origin_mm, steps_per_mm, home }
}
