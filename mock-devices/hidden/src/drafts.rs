//! What a right draft of physics outside the library is: where in the pipeline it acts and on what it depends.
//!
//! Two stages are right where they are the same to every reading: whether the covering or the tip is what stands deeper, whether a signal is lost in
//! the covering or in the element.

/// What a right draft is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DraftTruth {
    /// Its stage is one of these.
    pub stages: &'static [&'static str],
    /// Its first covariate is one of these.
    pub covariates: &'static [&'static str],
}

const IN_MOTION: &[&str] = &["motion", "covering"];
const OF_SIGNAL: &[&str] = &["covering", "element"];
const IN_COVERING: &[&str] = &["covering"];
const IN_READOUT: &[&str] = &["readout"];

/// By the physics' id; what is drawn anew for each reading has no mean, so nothing is to be drafted of it.
const TRUTHS: [(&str, DraftTruth); 20] = [
    ("supply-droop", truth(OF_SIGNAL, &["sum of signals"])),
    ("dragged-spread", truth(IN_COVERING, &["distance along the approach"])),
    ("stick-slip", truth(IN_MOTION, &["travel"])),
    ("adhesion", truth(IN_COVERING, &["height above the surface"])),
    ("converter-ripple", truth(IN_READOUT, &["counts"])),
    ("ringing", truth(IN_MOTION, &["time since a start or stop"])),
    ("stage-pickup", truth(IN_READOUT, &["speed of travel"])),
    ("proximity", truth(IN_COVERING, &["height above the surface"])),
    ("grounding", truth(IN_READOUT, &["depth"])),
    ("electrode-texture", truth(OF_SIGNAL, &["place along x", "place along y"])),
    ("bulge", truth(IN_COVERING, &["distance from the tip"])),
    ("air-pocket", truth(IN_MOTION, &["place along x", "place along y"])),
    ("grit", truth(OF_SIGNAL, &["signal"])),
    ("taut-sheet", truth(IN_COVERING, &["depth"])),
    ("vibrating-table", truth(IN_MOTION, &["time"])),
    ("arm-shadow", truth(IN_READOUT, &["place along x"])),
    ("common-mode", truth(IN_READOUT, &["sum of signals"])),
    ("contact-hum", truth(IN_READOUT, &["time"])),
    ("static-charge", truth(IN_READOUT, &["time since release"])),
    ("range-switch", truth(IN_READOUT, &["counts"])),
];

const fn truth(stages: &'static [&'static str], covariates: &'static [&'static str]) -> DraftTruth {
    DraftTruth { stages, covariates }
}

impl DraftTruth {
    /// What a right draft of a physics is; `None` if nothing is to be drafted of it.
    pub fn find(physics: &str) -> Option<Self> {
        TRUTHS.iter().find(|(id, _)| *id == physics).map(|(_, truth)| *truth)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::TRUTHS;
    use crate::CATALOGUE;

    /// Drawn anew for each reading.
    const SINGLE: [&str; 4] = ["gain-flicker", "row-bursts", "frame-tearing", "bit-flips"];

    #[test]
    fn each_physics_outside_the_library_has_one_or_none_on_purpose() {
        let outside = CATALOGUE.iter().filter(|one| one.effect.is_none()).map(|one| one.id);
        let listed = TRUTHS.iter().map(|(id, _)| *id).chain(SINGLE);
        assert_eq!(outside.collect::<BTreeSet<_>>(), listed.collect::<BTreeSet<_>>());
    }
}
