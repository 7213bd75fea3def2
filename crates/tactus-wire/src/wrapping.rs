//! Numbers of a device that wrap: frame counters and clocks.

/// Unwraps a number that begins again at 0 after `modulus` steps.
#[derive(Debug, Clone)]
pub(crate) struct Wrapping {
    modulus: u128,
    last: Option<Last>,
}

#[derive(Debug, Clone, Copy)]
struct Last {
    raw: u64,
    total: u64,
}

/// Where a number stands to the one before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Step {
    /// There is none before, or it is more than half the way round ahead, which is taken for a step back:
    /// counting begins anew here.
    Anew { total: u64 },
    /// The same again.
    Same { total: u64 },
    /// Ahead by 1 or more.
    Ahead { by: u64, total: u64 },
}

impl Step {
    /// The number unwrapped.
    pub(crate) fn total(self) -> u64 {
        match self {
            Self::Anew { total } | Self::Same { total } | Self::Ahead { total, .. } => total,
        }
    }
}

impl Wrapping {
    /// For numbers below `modulus`, which is 2 to 2^64.
    pub(crate) fn new(modulus: u128) -> Self {
        Self { modulus: modulus.clamp(2, 1 << 64), last: None }
    }

    /// Takes the next number; one beyond the modulus is taken by its remainder.
    pub(crate) fn advance(&mut self, raw: u64) -> Step {
        let raw = narrow(u128::from(raw) % self.modulus);
        let step = match self.last {
            None => Step::Anew { total: raw },
            Some(last) if last.raw == raw => Step::Same { total: last.total },
            Some(last) => {
                let ahead = (u128::from(raw) + self.modulus - u128::from(last.raw)) % self.modulus;
                if ahead <= self.modulus / 2 {
                    Step::Ahead { by: narrow(ahead), total: last.total.saturating_add(narrow(ahead)) }
                } else {
                    Step::Anew { total: raw }
                }
            }
        };
        self.last = Some(Last { raw, total: step.total() });
        step
    }
}

fn narrow(number: u128) -> u64 {
    u64::try_from(number).unwrap_or(u64::MAX)
}

#[cfg(test)]
#[path = "wrapping_tests.rs"]
mod tests;
