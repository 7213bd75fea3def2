//! An axis: quantity, range and ticks.

/// A logarithmic axis of fewer decades has ticks between the powers of ten.
const TICKS_BETWEEN_BELOW: f64 = 3.0;

/// Quantity, unit and range of an axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    quantity: String,
    unit: String,
    range: Option<[f64; 2]>,
    from_zero: bool,
    tight: bool,
    logarithmic: bool,
}

impl Axis {
    /// An axis of a quantity in a unit (empty for a pure number); its range follows the data.
    pub fn new(quantity: impl Into<String>, unit: impl Into<String>) -> Self {
        Self {
            quantity: quantity.into(),
            unit: unit.into(),
            range: None,
            from_zero: false,
            tight: false,
            logarithmic: false,
        }
    }

    /// With exactly this range.
    #[must_use]
    pub fn spanning(mut self, range: [f64; 2]) -> Self {
        self.range = Some(range);
        self
    }

    /// With zero in its range.
    #[must_use]
    pub fn from_zero(mut self) -> Self {
        self.from_zero = true;
        self
    }

    /// Ending at the data instead of the next tick.
    #[must_use]
    pub fn tight(mut self) -> Self {
        self.tight = true;
        self
    }

    /// Logarithmic, if all data are positive and span a factor of ten; else as it is.
    #[must_use]
    pub fn logarithmic(mut self) -> Self {
        self.logarithmic = true;
        self
    }

    /// `quantity / unit`.
    pub(super) fn title(&self) -> String {
        if self.unit.is_empty() {
            self.quantity.clone()
        } else {
            format!("{} / {}", self.quantity, self.unit)
        }
    }

    /// The scale for these data, with about `ticks` ticks.
    pub(super) fn scale(&self, data: impl Iterator<Item = f64>, ticks: f64) -> AxisScale {
        let seed = if self.from_zero { Some([0.0, 0.0]) } else { None };
        let found = data.filter(|value| value.is_finite()).fold(seed, |range, value| {
            let [lo, hi] = range.unwrap_or([value, value]);
            Some([lo.min(value), hi.max(value)])
        });
        if let Some([least, most]) = found.filter(|_| self.logarithmic)
            && least > 0.0
            && most >= 10.0 * least
        {
            return AxisScale::logarithmic([least, most]);
        }
        match self.range {
            Some(range) => AxisScale::within(range, ticks),
            None if self.tight => AxisScale::within(found.unwrap_or([0.0, 1.0]), ticks),
            None => AxisScale::around(found.unwrap_or([0.0, 1.0]), ticks),
        }
    }
}

/// A range and the ticks in it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct AxisScale {
    pub(super) range: [f64; 2],
    pub(super) ticks: Vec<f64>,
    decimals: usize,
    is_logarithmic: bool,
}

impl AxisScale {
    /// Ticks inside a fixed range.
    fn within(range: [f64; 2], ticks: f64) -> Self {
        let [lo, hi] = wide(range);
        let step = round_step((hi - lo) / ticks);
        let slack = 1e-9 * (hi - lo);
        let (first, last) = (((lo - slack) / step).ceil(), ((hi + slack) / step).floor());
        Self {
            range: [lo, hi],
            ticks: multiples(first, last, step),
            decimals: decimals(step),
            is_logarithmic: false,
        }
    }

    /// Ticks at powers of ten inside a range of positive values, and at twice and five times them if these are few.
    #[expect(clippy::cast_possible_truncation, reason = "powers of ten of a finite number")]
    fn logarithmic([least, most]: [f64; 2]) -> Self {
        let slack = 1.0 + 1e-9;
        let powers = (least.log10().floor() as i32)..=(most.log10().ceil() as i32);
        let few = (most / least).log10() < TICKS_BETWEEN_BELOW;
        let digits: &[f64] = if few { &[1.0, 2.0, 5.0] } else { &[1.0] };
        let all = powers.flat_map(|power| digits.iter().map(move |digit| digit * 10_f64.powi(power)));
        let ticks = all.filter(|tick| *tick >= least / slack && *tick <= most * slack).collect();
        Self { range: [least, most], ticks, decimals: 0, is_logarithmic: true }
    }

    /// A range that begins and ends at a tick.
    fn around(range: [f64; 2], ticks: f64) -> Self {
        let [lo, hi] = wide(range);
        let step = round_step((hi - lo) / ticks);
        let slack = 1e-9 * (hi - lo);
        let (first, last) = (((lo + slack) / step).floor(), ((hi - slack) / step).ceil());
        Self {
            range: [first * step, last * step],
            ticks: multiples(first, last, step),
            decimals: decimals(step),
            is_logarithmic: false,
        }
    }

    /// Position of a value: 0 at the range's start, 1 at its end.
    pub(super) fn share(&self, value: f64) -> f64 {
        let [lo, hi] = self.range;
        if self.is_logarithmic {
            return (value / lo).log10() / (hi / lo).log10();
        }
        (value - lo) / (hi - lo)
    }

    /// True if there are ticks at both ends.
    pub(super) fn spans_range(&self) -> bool {
        let at =
            |tick: Option<&f64>, end: f64| tick.is_some_and(|tick| (self.share(*tick) - end).abs() < 1e-9);
        at(self.ticks.first(), 0.0) && at(self.ticks.last(), 1.0)
    }

    /// A tick's text, with the decimals that the step needs.
    pub(super) fn label(&self, tick: f64) -> String {
        number(tick, if self.is_logarithmic { decimals(tick) } else { self.decimals })
    }
}

/// Formats a number with a true minus sign, separated thousands and no negative zero; a dash if it is not finite.
pub(crate) fn number(value: f64, decimals: usize) -> String {
    if !value.is_finite() {
        return "\u{2013}".into();
    }
    let digits = format!("{:.decimals$}", value.abs());
    let (whole, fraction) = digits.split_once('.').map_or((digits.as_str(), None), |(a, b)| (a, Some(b)));
    let zero = digits.bytes().all(|byte| matches!(byte, b'0' | b'.'));
    let mut text = String::from(if value < 0.0 && !zero { "\u{2212}" } else { "" });
    for (index, digit) in whole.chars().enumerate() {
        let left = whole.len() - index;
        if index > 0 && left.is_multiple_of(3) && whole.len() > 4 {
            text.push('\u{202f}');
        }
        text.push(digit);
    }
    if let Some(fraction) = fraction {
        text.push('.');
        text.push_str(fraction);
    }
    text
}

/// The least of 1, 2 or 5 times a power of ten that is not below the rough step.
pub(crate) fn round_step(rough: f64) -> f64 {
    let power = 10_f64.powf(rough.log10().floor());
    let share = rough / power;
    let digit = [1.0, 2.0, 5.0].into_iter().find(|digit| share <= digit * (1.0 + 1e-9)).unwrap_or(10.0);
    digit * power
}

/// Widens a range that is too narrow for ticks.
fn wide([lo, hi]: [f64; 2]) -> [f64; 2] {
    let least = 1e-9 * lo.abs().max(hi.abs()).max(1e-9);
    if hi - lo > least {
        return [lo, hi];
    }
    let half = if lo == 0.0 { 0.5 } else { 0.5 * lo.abs() };
    [lo - half, lo + half]
}

fn multiples(first: f64, last: f64, step: f64) -> Vec<f64> {
    // There are only a few; the bound guards against rounding in extreme ranges.
    let mut ticks: Vec<f64> = Vec::new();
    let mut index = first;
    while index <= last && ticks.len() < 100 {
        ticks.push(index * step);
        index += 1.0;
    }
    ticks
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 0 and 12")]
fn decimals(step: f64) -> usize {
    (-(step * (1.0 + 1e-9)).log10().floor()).clamp(0.0, 12.0) as usize
}

#[cfg(test)]
#[path = "axis_tests.rs"]
mod tests;
