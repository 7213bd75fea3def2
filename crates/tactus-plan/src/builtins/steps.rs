//! Functions that ask for steps. They refuse values that are invalid on every rig; the host checks the envelope.

use starlark::environment::GlobalsBuilder;
use starlark::eval::Evaluator;
use starlark::starlark_module;
use starlark::values::Value;
use starlark::values::float::UnpackFloat;
use starlark::values::list::AllocList;
use starlark::values::none::{NoneOr, NoneType};
use starlark::values::structs::AllocStruct;
use starlark::values::tuple::UnpackTuple;

use super::arguments::{finite, numbers, positive};
use super::values::reading_value;
use crate::context::{self, Halt};
use crate::sandbox::{Numbers, write_text};
use crate::{Position, Press, Reply, Step};

#[starlark_module]
pub(super) fn functions(builder: &mut GlobalsBuilder) {
    /// Travels to a place of the sensor frame: up first, down last.
    ///
    /// Without a height the tip goes to the rig's safe height. Gives where it is then: `x_mm`, `y_mm`, `height_mm`.
    fn r#move<'v>(
        x_mm: UnpackFloat,
        y_mm: UnpackFloat,
        #[starlark(default = NoneOr::None)] height_mm: NoneOr<UnpackFloat>,
        #[starlark(default = NoneOr::None)] speed_mm_per_s: NoneOr<UnpackFloat>,
        eval: &mut Evaluator<'v, '_, '_>,
    ) -> starlark::Result<Value<'v>> {
        let height_mm =
            height_mm.into_option().map(|UnpackFloat(height)| finite("height_mm", height)).transpose()?;
        let speed_mm_per_s = speed(speed_mm_per_s)?;
        let step = Step::Move { to: place(&x_mm, &y_mm)?, height_mm, speed_mm_per_s };
        ask(step, eval)
    }

    /// Presses once: comes down, holds each depth in turn while it reads, goes up again.
    ///
    /// Depths are below the covering's nominal surface and held in the order given; they may fall as well as
    /// rise. `approach_from_mm = [dx, dy]` has the tip come to the place from that much aside. Gives one reading
    /// for each depth.
    fn press<'v>(
        x_mm: UnpackFloat,
        y_mm: UnpackFloat,
        depths_mm: Value<'v>,
        #[starlark(default = UnpackFloat(0.25))] dwell_s: UnpackFloat,
        #[starlark(default = NoneOr::None)] speed_mm_per_s: NoneOr<UnpackFloat>,
        #[starlark(default = NoneOr::None)] approach_from_mm: NoneOr<Value<'v>>,
        eval: &mut Evaluator<'v, '_, '_>,
    ) -> starlark::Result<Value<'v>> {
        let step = Step::Press(Press {
            at: place(&x_mm, &y_mm)?,
            depths_mm: numbers("depths_mm", depths_mm)?
                .into_iter()
                .map(|depth| positive("a depth of depths_mm", depth))
                .collect::<Result<_, _>>()?,
            dwell_s: positive("dwell_s", dwell_s.0)?,
            speed_mm_per_s: speed(speed_mm_per_s)?,
            approach_from_mm: approach_from_mm.into_option().map(aside).transpose()?,
        });
        ask(step, eval)
    }

    /// Stays where the tip is and averages readings, after the rig's settling time. Gives a reading.
    fn dwell<'v>(duration_s: UnpackFloat, eval: &mut Evaluator<'v, '_, '_>) -> starlark::Result<Value<'v>> {
        ask(Step::Dwell { duration_s: positive("duration_s", duration_s.0)? }, eval)
    }

    /// Averages readings at once. Gives a reading: `counts`, `signal` (above the tare) and `rms` have one number
    /// for each element, `frames` is how many frames were averaged.
    fn read<'v>(
        #[starlark(default = UnpackFloat(0.25))] duration_s: UnpackFloat,
        eval: &mut Evaluator<'v, '_, '_>,
    ) -> starlark::Result<Value<'v>> {
        ask(Step::Read { duration_s: positive("duration_s", duration_s.0)? }, eval)
    }

    /// Makes the present reading the zero of later signals. Not while pressing.
    fn tare<'v>(
        #[starlark(default = UnpackFloat(0.5))] duration_s: UnpackFloat,
        eval: &mut Evaluator<'v, '_, '_>,
    ) -> starlark::Result<Value<'v>> {
        ask(Step::Tare { duration_s: positive("duration_s", duration_s.0)? }, eval)
    }

    /// Lets time pass.
    fn wait<'v>(duration_s: UnpackFloat, eval: &mut Evaluator<'v, '_, '_>) -> starlark::Result<Value<'v>> {
        ask(Step::Wait { duration_s: positive("duration_s", duration_s.0)? }, eval)
    }

    /// Has another covering put in place: a simulated rig changes it itself, a real one asks and waits.
    fn covering<'v>(
        thickness_mm: UnpackFloat,
        eval: &mut Evaluator<'v, '_, '_>,
    ) -> starlark::Result<Value<'v>> {
        ask(Step::Covering { thickness_mm: positive("thickness_mm", thickness_mm.0)? }, eval)
    }

    /// Writes a line into the run's events. Values are separated by spaces, numbers rounded to a millionth. Only 4 KiB of a
    /// line are kept.
    fn log<'v>(
        #[starlark(args)] values: UnpackTuple<Value<'v>>,
        eval: &mut Evaluator<'v, '_, '_>,
    ) -> starlark::Result<Value<'v>> {
        let message = context::current()?.log_line(line_of(values)?)?;
        ask(Step::Log { message }, eval)
    }

    /// Ends the run as failed, with the values as its message.
    fn fail(#[starlark(args)] values: UnpackTuple<Value<'_>>) -> starlark::Result<NoneType> {
        Err(Halt::Failed(line_of(values)?).into())
    }
}

fn ask<'v>(step: Step, eval: &mut Evaluator<'v, '_, '_>) -> starlark::Result<Value<'v>> {
    let reply = context::current()?.ask(step, eval)?;
    let heap = eval.heap();
    Ok(match reply {
        Reply::Done => Value::new_none(),
        Reply::Reading(reading) => reading_value(&reading, heap),
        Reply::Pressed(readings) => {
            heap.alloc(AllocList(readings.iter().map(|reading| reading_value(reading, heap))))
        }
        Reply::Position { x_mm, y_mm, height_mm } => {
            heap.alloc(AllocStruct([("x_mm", x_mm), ("y_mm", y_mm), ("height_mm", height_mm)]))
        }
    })
}

fn place(x_mm: &UnpackFloat, y_mm: &UnpackFloat) -> Result<Position, Halt> {
    Ok(Position { x_mm: finite("x_mm", x_mm.0)?, y_mm: finite("y_mm", y_mm.0)? })
}

fn speed(speed: NoneOr<UnpackFloat>) -> Result<Option<f64>, Halt> {
    speed.into_option().map(|UnpackFloat(speed)| positive("speed_mm_per_s", speed)).transpose()
}

fn aside(value: Value<'_>) -> Result<[f64; 2], Halt> {
    let aside = numbers("approach_from_mm", value)?;
    <[f64; 2]>::try_from(aside).map_err(|_| Halt::Failed("approach_from_mm must be [dx, dy]".into()))
}

fn line_of(values: UnpackTuple<Value<'_>>) -> Result<String, Halt> {
    let mut line = String::new();
    for (index, value) in values.items.into_iter().enumerate() {
        line.push_str(if index == 0 { "" } else { " " });
        write_text(value, Numbers::Rounded, &mut line)?;
    }
    Ok(line)
}
