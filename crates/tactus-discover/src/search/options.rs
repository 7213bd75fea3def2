//! Options of a discovery.

/// Options of a discovery.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// The seed of the split and of the Monte-Carlo tests.
    pub seed: u64,
    /// How many threads compute; 0 counts as 1. The result does not depend on it.
    pub threads: usize,
    /// The rule by which effects are added.
    pub rule: Rule,
    /// A structured residual that is tolerable, declared before the data are judged. If the 95 % upper bound of what is structured
    /// is lower, the added effects count as the explanation.
    pub tolerance_counts: Option<f64>,
}

/// The rule by which effects are added.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Rule {
    /// Evidence of sets of effects, corrected tests, a comparison of each added effect with rivals and other effects in its place, and folds of
    /// the fitted presses that confirm it. Held-out presses have no say until the verdict.
    #[default]
    Protocol,
    /// Forward selection by the Bayesian information criterion of the fitted presses alone, as a comparison for the protocol.
    Bic,
}
