//! The arithmetic that the language lacks.

use starlark::environment::GlobalsBuilder;
use starlark::starlark_module;
use starlark::values::float::UnpackFloat;

use super::arguments::finite;
use crate::context::Halt;

#[starlark_module]
pub(super) fn functions(builder: &mut GlobalsBuilder) {
    /// Half a turn in radians.
    const pi: f64 = std::f64::consts::PI;

    /// The square root of a number that is not negative.
    fn sqrt(#[starlark(require = pos)] x: UnpackFloat) -> starlark::Result<f64> {
        result("sqrt", x.0, finite("x", x.0)?.sqrt())
    }

    /// The sine of an angle in radians.
    fn sin(#[starlark(require = pos)] x: UnpackFloat) -> starlark::Result<f64> {
        result("sin", x.0, finite("x", x.0)?.sin())
    }

    /// The cosine of an angle in radians.
    fn cos(#[starlark(require = pos)] x: UnpackFloat) -> starlark::Result<f64> {
        result("cos", x.0, finite("x", x.0)?.cos())
    }

    /// The angle from the x axis to the point (x, y), in radians.
    fn atan2(
        #[starlark(require = pos)] y: UnpackFloat,
        #[starlark(require = pos)] x: UnpackFloat,
    ) -> starlark::Result<f64> {
        Ok(finite("y", y.0)?.atan2(finite("x", x.0)?))
    }

    /// e to the power of x.
    fn exp(#[starlark(require = pos)] x: UnpackFloat) -> starlark::Result<f64> {
        result("exp", x.0, finite("x", x.0)?.exp())
    }

    /// The natural logarithm of a positive number.
    fn ln(#[starlark(require = pos)] x: UnpackFloat) -> starlark::Result<f64> {
        result("ln", x.0, finite("x", x.0)?.ln())
    }

    /// A number rounded to this many digits after the point.
    fn round(
        #[starlark(require = pos)] x: UnpackFloat,
        #[starlark(default = 0)] digits: i32,
    ) -> starlark::Result<f64> {
        if !(0..=15).contains(&digits) {
            return Err(Halt::Failed(format!("digits is {digits}, it must be 0 to 15")).into());
        }
        let scale = 10_f64.powi(digits);
        let rounded = (finite("x", x.0)? * scale).round() / scale;
        Ok(if rounded.is_finite() { rounded } else { x.0 })
    }
}

fn result(function: &str, x: f64, y: f64) -> starlark::Result<f64> {
    if y.is_finite() {
        Ok(y)
    } else {
        Err(Halt::Failed(format!("{function}({x}) is not a finite number")).into())
    }
}
