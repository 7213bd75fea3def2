//! The experiments that may be proposed: the parts of `diagnose`, two experiments of the paper, and the lab's own.

use super::reach::{Reach, is_within};

/// An experiment that may be proposed.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Candidate {
    /// Name of the experiment, or of the part of `diagnose`, as in the definitions of effects.
    pub(super) name: String,
    /// The name that `tactus run` takes.
    pub(super) experiment: String,
    /// The parameters that differ from their defaults.
    pub(super) parameters: Vec<(&'static str, String)>,
    /// A script of the lab.
    pub(super) is_own: bool,
}

/// The candidate that gives data a floor: it rests, and presses one place many times.
pub(super) const FLOOR: &str = "drift,repeats";

/// The parts of `diagnose`.
const PARTS: [&str; 11] = [
    "drift",
    "repeats",
    "ladder",
    "rates",
    "approach",
    "reversals",
    "tilt",
    "depths",
    "wide",
    "hold",
    "rests",
];
/// Values of `diagnose`'s parameter `scale`: a short and a full form of each part.
const SCALES: [f64; 2] = [0.3, 1.0];
/// `diagnose`'s default of `depth_share`. Its ladder goes a fifth deeper.
const DEPTH_SHARE: f64 = 0.5;
const LADDER: f64 = 1.2;
/// `diagnose`'s default of `speeds_mm_per_s`.
pub(super) const SPEEDS_MM_PER_S: [f64; 6] = [0.1, 0.2, 0.3, 0.5, 0.7, 1.0];
/// The default depths of `element-centres`.
pub(super) const ELEMENT_DEPTHS_MM: [f64; 5] = [0.2, 0.3, 0.4, 0.5, 0.6];
/// The default depths of `grid-sweep`, as shares of the covering.
pub(super) const SWEEP_SHARES: [f64; 3] = [0.3, 0.5, 0.65];

/// All candidates, with parameters that keep them within the reach of the data.
pub(super) fn catalogue(reach: &Reach, own: &[String]) -> Vec<Candidate> {
    let parts = PARTS.into_iter().flat_map(|part| SCALES.map(|scale| diagnose(part, scale, reach)));
    let lab = own.iter().map(|name| Candidate {
        name: name.clone(),
        experiment: name.clone(),
        parameters: Vec::new(),
        is_own: true,
    });
    parts.chain([element_centres(reach), grid_sweep(reach), diagnose(FLOOR, 1.0, reach)]).chain(lab).collect()
}

impl Candidate {
    /// The seed of its run: each candidate has its own, so that on a simulated rig no two runs have the same noise.
    ///
    /// # Source
    /// The hash FNV-1a (Fowler, Noll and Vo), started with the discovery's seed; its upper half.
    pub(super) fn seed(&self, seed: u64) -> u64 {
        let parameters = self.parameters.iter().flat_map(|(name, value)| [*name, value]);
        let words = [self.experiment.as_str()].into_iter().chain(parameters);
        let mut hash = 0xcbf2_9ce4_8422_2325 ^ seed;
        for byte in words.flat_map(|word| word.bytes().chain([0])) {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
        hash >> 32
    }

    fn built_in(name: &str, experiment: &str, parameters: Vec<(&'static str, String)>) -> Self {
        Self { name: name.to_owned(), experiment: experiment.to_owned(), parameters, is_own: false }
    }
}

fn diagnose(part: &str, scale: f64, reach: &Reach) -> Candidate {
    let mut parameters = vec![("parts", part.to_owned())];
    if scale < 1.0 {
        parameters.push(("scale", scale.to_string()));
    }
    let share = reach.deepest_mm() / (LADDER * reach.covering_mm);
    if !is_within(DEPTH_SHARE, share) {
        // The script takes no less.
        parameters.push(("depth_share", ((100.0 * share).floor() / 100.0).max(0.05).to_string()));
    }
    let [slowest, ..] = SPEEDS_MM_PER_S;
    let fastest = reach.fastest_mm_per_s.unwrap_or(slowest).max(slowest);
    let speeds = SPEEDS_MM_PER_S.into_iter().filter(|speed| is_within(*speed, fastest));
    let speeds: Vec<f64> = speeds.collect();
    if part == "rates" && speeds.len() < SPEEDS_MM_PER_S.len() {
        parameters.push(("speeds_mm_per_s", list(&speeds)));
    }
    Candidate::built_in(part, "diagnose", parameters)
}

fn element_centres(reach: &Reach) -> Candidate {
    let [.., deepest_mm] = ELEMENT_DEPTHS_MM;
    let mut parameters = Vec::new();
    if !is_within(deepest_mm, reach.deepest_mm()) {
        let by = reach.deepest_mm() / deepest_mm;
        let depths_mm =
            ELEMENT_DEPTHS_MM.map(|depth_mm| ((1000.0 * by * depth_mm).floor() / 1000.0).max(0.001));
        parameters.push(("depths_mm", list(&depths_mm)));
    }
    Candidate::built_in("element-centres", "element-centres", parameters)
}

/// Five by five places about the middle, with the present covering.
fn grid_sweep(reach: &Reach) -> Candidate {
    let mut parameters = vec![
        ("coverings_mm", list(&[reach.covering_mm])),
        ("points", "5".to_owned()),
        ("spacing_mm", "0.35".to_owned()),
    ];
    let share = reach.deepest_mm() / reach.covering_mm;
    let [.., deepest] = SWEEP_SHARES;
    if !is_within(deepest, share) {
        let shares = SWEEP_SHARES.map(|one| ((100.0 * one.min(share)).floor() / 100.0).max(0.01));
        parameters.push(("depth_shares", list(&shares)));
    }
    Candidate::built_in("grid-sweep", "grid-sweep", parameters)
}

fn list(values: &[f64]) -> String {
    format!("{values:?}").replace(' ', "")
}
