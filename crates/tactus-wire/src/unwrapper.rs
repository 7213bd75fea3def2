//! Unwraps counters and clocks of devices that start again at 0.

/// Unwraps a number that starts again at 0 after `modulus` steps.
#[derive(Debug, Clone)]
pub(crate) struct Unwrapper {
    /// The number before it starts again at 0.
    greatest: u64,
    last: Option<Previous>,
}

#[derive(Debug, Clone, Copy)]
struct Previous {
    raw: u64,
    total: u64,
}

/// How a number compares with the previous one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Advance {
    /// It is the first number, or more than half the modulus ahead, which is taken as a step back: counting starts
    /// again here.
    Anew { total: u64 },
    /// Unchanged.
    Same { total: u64 },
    /// Ahead by 1 or more.
    Ahead { by: u64, total: u64 },
}

impl Advance {
    /// The unwrapped number.
    pub(crate) fn total(self) -> u64 {
        match self {
            Self::Anew { total } | Self::Same { total } | Self::Ahead { total, .. } => total,
        }
    }
}

impl Unwrapper {
    /// An unwrapper for numbers below `modulus`, which is 2 to 2^64.
    pub(crate) fn new(modulus: u128) -> Self {
        Self { greatest: u64::try_from(modulus.clamp(2, 1 << 64) - 1).unwrap_or(u64::MAX), last: None }
    }

    /// Takes the next number, modulo the modulus.
    pub(crate) fn advance(&mut self, raw: u64) -> Advance {
        let raw = if raw <= self.greatest { raw } else { raw % (self.greatest + 1) };
        let step = match self.last {
            None => Advance::Anew { total: raw },
            Some(last) if last.raw == raw => Advance::Same { total: last.total },
            Some(last) => {
                let by = if raw > last.raw { raw - last.raw } else { self.greatest - last.raw + raw + 1 };
                if by <= self.greatest.div_ceil(2) {
                    Advance::Ahead { by, total: last.total.saturating_add(by) }
                } else {
                    Advance::Anew { total: raw }
                }
            }
        };
        self.last = Some(Previous { raw, total: step.total() });
        step
    }
}

#[cfg(test)]
#[path = "unwrapper_tests.rs"]
mod tests;
