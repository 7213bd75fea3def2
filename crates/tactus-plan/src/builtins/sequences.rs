//! Bounded forms of standard functions on lists and texts, and random numbers.

use std::num::NonZeroI32;

use starlark::environment::GlobalsBuilder;
use starlark::eval::Evaluator;
use starlark::starlark_module;
use starlark::values::float::UnpackFloat;
use starlark::values::list::AllocList;
use starlark::values::none::NoneOr;
use starlark::values::range::Range;
use starlark::values::tuple::{AllocTuple, UnpackTuple};
use starlark::values::{StringValue, UnpackValue, Value};

use super::arguments::finite;
use crate::Exceeded;
use crate::context::{self, Halt};
use crate::sandbox::{Numbers, SEQUENCE_MAX, write_text};

#[starlark_module]
pub(super) fn functions(builder: &mut GlobalsBuilder) {
    /// The whole numbers from `start` (0 if only one is given) up to and without `stop`.
    fn range(
        #[starlark(require = pos)] a: i32,
        #[starlark(require = pos, default = NoneOr::None)] b: NoneOr<i32>,
        #[starlark(require = pos, default = 1)] step: i32,
    ) -> starlark::Result<Range> {
        let (start, stop) = b.into_option().map_or((0, a), |stop| (a, stop));
        let step = NonZeroI32::new(step).ok_or_else(|| Halt::Failed("the step of a range is 0".into()))?;
        let distance = (i64::from(stop) - i64::from(start)) * i64::from(step.get().signum());
        let size = u64::try_from(distance).unwrap_or(0).div_ceil(u64::from(step.get().unsigned_abs()));
        check_size("a range", size)?;
        Ok(Range::new(start, stop, step))
    }

    /// A list of tuples with one value from each list, as many as the shortest has.
    fn zip<'v>(
        #[starlark(args)] lists: UnpackTuple<Value<'v>>,
        eval: &mut Evaluator<'v, '_, '_>,
    ) -> starlark::Result<Value<'v>> {
        let heap = eval.heap();
        let mut shortest: Option<u64> = None;
        for list in &lists.items {
            let length = u64::try_from(list.length()?).unwrap_or(0);
            shortest = Some(shortest.map_or(length, |shortest| shortest.min(length)));
        }
        check_size("a list", shortest.unwrap_or(0).saturating_mul(lists.items.len() as u64))?;
        context::check_heap(eval)?;
        let mut columns = Vec::new();
        for list in &lists.items {
            columns.push(list.iterate(heap)?);
        }
        let mut rows = Vec::new();
        for _ in 0..shortest.unwrap_or(0) {
            let row: Vec<Value<'v>> = columns.iter_mut().filter_map(Iterator::next).collect();
            rows.push(heap.alloc(AllocTuple(row)));
        }
        Ok(heap.alloc(AllocList(rows)))
    }

    /// A value as text.
    fn str<'v>(
        #[starlark(require = pos)] value: Value<'v>,
        eval: &mut Evaluator<'v, '_, '_>,
    ) -> starlark::Result<StringValue<'v>> {
        let mut text = String::new();
        write_text(value, Numbers::Whole, &mut text).map_err(Halt::from)?;
        context::check_heap(eval)?;
        Ok(eval.heap().alloc_str(&text))
    }

    /// The sum of a list of numbers.
    fn sum<'v>(
        #[starlark(require = pos)] values: Value<'v>,
        eval: &mut Evaluator<'v, '_, '_>,
    ) -> starlark::Result<f64> {
        let mut sum = 0.0;
        for value in values.iterate(eval.heap())? {
            match UnpackFloat::unpack_value(value) {
                Ok(Some(UnpackFloat(number))) => sum += number,
                Ok(None) | Err(_) => {
                    return Err(Halt::Failed(format!("sum adds numbers, not {}", value.get_type())).into());
                }
            }
        }
        Ok(sum)
    }

    /// A new list with the same values in random order. The order comes from the run's seed alone.
    fn shuffled<'v>(
        #[starlark(require = pos)] values: Value<'v>,
        eval: &mut Evaluator<'v, '_, '_>,
    ) -> starlark::Result<Value<'v>> {
        check_size("a list", u64::try_from(values.length()?).unwrap_or(0))?;
        context::check_heap(eval)?;
        let heap = eval.heap();
        let mut values: Vec<Value<'v>> = values.iterate(heap)?.collect();
        context::current()?.rng.borrow_mut().shuffle(&mut values);
        Ok(heap.alloc(AllocList(values)))
    }

    /// A random number between `low` and `high`, every one equally likely. It comes from the run's seed alone.
    fn uniform(low: UnpackFloat, high: UnpackFloat) -> starlark::Result<f64> {
        let (low, high) = (finite("low", low.0)?, finite("high", high.0)?);
        if low > high {
            return Err(Halt::Failed(format!("low is {low}, greater than high, which is {high}")).into());
        }
        Ok(low + (high - low) * context::current()?.rng.borrow_mut().unit())
    }
}

fn check_size(what: &'static str, size: u64) -> Result<(), Halt> {
    let limit = SEQUENCE_MAX as u64;
    if size > limit {
        Err(Exceeded::Size { what: what.into(), size, unit: "values".into(), limit }.into())
    } else {
        Ok(())
    }
}
