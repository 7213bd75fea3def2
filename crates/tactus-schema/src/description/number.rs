//! Checks of numbers; a file may contain `nan`, `inf` and typing errors.

use super::{WrongField, wrong};

/// Larger than any quantity in a lab in the units used here; sums and products of a few such numbers stay finite.
pub(crate) const LARGEST: f64 = 1e12;

pub(crate) fn finite(field: impl Into<String>, value: f64) -> Result<f64, WrongField> {
    if value.abs() <= LARGEST {
        Ok(value)
    } else {
        Err(wrong(field, format!("finite and sane, not {value}")))
    }
}

pub(crate) fn not_negative(field: impl Into<String>, value: f64) -> Result<f64, WrongField> {
    if (0.0..=LARGEST).contains(&value) {
        Ok(value)
    } else {
        Err(wrong(field, format!("not negative and finite, not {value}")))
    }
}

pub(crate) fn positive(field: impl Into<String>, value: f64) -> Result<f64, WrongField> {
    if value > 0.0 && value <= LARGEST {
        Ok(value)
    } else {
        Err(wrong(field, format!("positive and finite, not {value}")))
    }
}

pub(crate) fn range(field: impl Into<String>, [low, high]: [f64; 2]) -> Result<[f64; 2], WrongField> {
    if low < high && low >= -LARGEST && high <= LARGEST {
        Ok([low, high])
    } else {
        Err(wrong(field, format!("[least, greatest] with least < greatest, not [{low}, {high}]")))
    }
}
