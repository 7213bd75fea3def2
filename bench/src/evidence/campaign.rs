//! The planned sets.

use serde::{Deserialize, Serialize};
use tactus_hidden::{CATALOGUE, Definition};
use tactus_sets::{Amount, Content, NoiseKind, Recipe};

/// The purpose of a set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Campaign {
    /// Nothing is hidden: any detection is a false alarm.
    FalseAlarms,
    /// One physics that is an instance of an effect of the library.
    Names,
    /// Two such physics, of different effects.
    Pairs,
    /// Three.
    Triples,
    /// One physics that has no counterpart in the library.
    Outside,
}

/// Which seeds the sets are made from. Sets of both kinds have the same ids, and nothing else in common.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Seeds {
    /// For work on the method: constants may be chosen on these sets, and CI watches some of them.
    Tuning,
    /// For the published tables alone. Nobody looks at these sets one by one.
    Sealed,
}

/// Which part of the recipe.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Size {
    /// All of it.
    Whole,
    /// The sets for other methods.
    Ablation,
    /// A first look.
    Glance,
    /// A short loop for work on the method.
    Quick,
    /// What fails if discovery has become worse.
    Slice,
    /// The part of that which CI runs.
    Sample,
}

/// How many sets of each kind, and how strong.
#[derive(Debug, Clone)]
pub struct Sizes {
    /// Sets without physics, in equal parts white, coloured and quantised.
    pub false_alarms: usize,
    /// Physics of the library's effects.
    pub physics: Vec<&'static Definition>,
    /// Separations of each physics, after the spread is fitted too.
    pub separations: Vec<f64>,
    /// Further sets of each physics, by strength; 1 is a bad rig.
    pub strengths: Vec<f64>,
    /// Sets for each physics and each separation or strength.
    pub name_seeds: usize,
    /// Sets of two effects.
    pub pairs: usize,
    /// Sets of three.
    pub triples: usize,
    /// Physics outside the library.
    pub outside: Vec<&'static Definition>,
    /// Their separations.
    pub outside_separations: Vec<f64>,
    /// Their strengths.
    pub outside_strengths: Vec<f64>,
    /// Sets for each of those.
    pub outside_seeds: usize,
    /// Frames of a set; the plan's own number if `None`.
    pub frames: Option<usize>,
}

/// A set that can be made.
#[derive(Debug, Clone)]
pub struct Planned {
    /// Such as `names/relaxation-prony-z8-0`. It says what is hidden, so it is for the scorer only.
    pub id: String,
    /// Its purpose.
    pub campaign: Campaign,
    /// How to make it.
    pub recipe: Recipe,
}

/// Effects whose form differs from one rig to the next.
const FREE_FORMS: [&str; 13] = [
    "hardening",
    "heavy-tail",
    "depth-dependent-spread",
    "relaxation",
    "hysteresis",
    "rate-stiffening",
    "imprint",
    "softening",
    "crosstalk",
    "saturation",
    "baseline-drift",
    "gain-drift",
    "low-pass",
];

/// Separation of each effect in sets of several, evenly on a logarithmic scale.
const SEVERAL_Z: [f64; 2] = [20.0, 60.0];

impl Seeds {
    /// What the seeds of all sets have in common.
    const fn domain(self) -> u64 {
        match self {
            Self::Tuning => 1,
            Self::Sealed => 0x7365_616c_6564_2131,
        }
    }

    /// Its folder.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Tuning => "tuning",
            Self::Sealed => "sealed",
        }
    }

    /// True if sets of these seeds may be looked at: sealed ones are the whole recipe or the sets for other methods. Who looks at less
    /// could choose by it.
    pub fn may_show(self, size: Size, is_part: bool) -> bool {
        match self {
            Self::Tuning => true,
            Self::Sealed => !is_part && matches!(size, Size::Whole | Size::Ablation),
        }
    }
}

impl Size {
    /// How many sets that is.
    pub fn sizes(self) -> Sizes {
        match self {
            Self::Whole => Sizes::whole(),
            Self::Ablation => Sizes::ablation(),
            Self::Glance => Sizes::glance(),
            Self::Quick => Sizes::quick(),
            Self::Slice => Sizes::slice(),
            Self::Sample => Sizes::sample(),
        }
    }
}

impl Campaign {
    /// Every campaign.
    pub const ALL: [Self; 5] = [Self::FalseAlarms, Self::Names, Self::Pairs, Self::Triples, Self::Outside];

    /// Its folder.
    pub const fn name(self) -> &'static str {
        match self {
            Self::FalseAlarms => "false-alarms",
            Self::Names => "names",
            Self::Pairs => "pairs",
            Self::Triples => "triples",
            Self::Outside => "outside",
        }
    }
}

impl Sizes {
    /// The sizes of the published evidence.
    pub fn whole() -> Self {
        Self {
            false_alarms: 501,
            physics: within().collect(),
            separations: vec![2.0, 4.0, 8.0, 16.0, 40.0],
            strengths: vec![0.3, 1.0],
            name_seeds: 1,
            pairs: 100,
            triples: 60,
            outside: outside().collect(),
            outside_separations: vec![15.0, 40.0, 100.0],
            outside_strengths: Vec::new(),
            outside_seeds: 2,
            frames: None,
        }
    }

    /// A first look: every physics once and strong, a third of the sets with several effects and a tenth of those without any.
    pub fn glance() -> Self {
        Self {
            false_alarms: 48,
            separations: vec![40.0],
            strengths: Vec::new(),
            name_seeds: 1,
            pairs: 40,
            triples: 20,
            outside_separations: vec![40.0],
            outside_strengths: Vec::new(),
            outside_seeds: 1,
            ..Self::whole()
        }
    }

    /// A short loop for work on the method: two physics of each class with a free form, and a few sets of every other campaign.
    pub fn quick() -> Self {
        Self {
            false_alarms: 8,
            physics: FREE_FORMS.iter().flat_map(|effect| foreign(effect).take(2)).collect(),
            pairs: 6,
            triples: 4,
            outside: outside().step_by(2).take(10).collect(),
            ..Self::glance()
        }
    }

    /// The sets for other methods: every physics once at a strong separation and once as on a bad rig.
    pub fn ablation() -> Self {
        Self {
            false_alarms: 45,
            strengths: vec![1.0],
            pairs: 20,
            triples: 0,
            outside_strengths: vec![1.0],
            ..Self::glance()
        }
    }

    /// A few strong sets of every campaign but `Triples`. All physics is of other forms than the library's: its own say nothing of these.
    pub fn slice() -> Self {
        Self {
            false_alarms: 12,
            physics: one_of_each().take(24).collect(),
            strengths: Vec::new(),
            pairs: 4,
            triples: 0,
            outside: outside().take(6).collect(),
            ..Self::glance()
        }
    }

    /// The part of the slice that CI runs: of every fourth effect, so that each group of effects is in it.
    pub fn sample() -> Self {
        Self {
            false_alarms: 3,
            physics: one_of_each().step_by(4).take(6).collect(),
            pairs: 1,
            outside: outside().take(1).collect(),
            ..Self::slice()
        }
    }
}

/// The sets of a campaign. A set's seed follows from its id and `seeds`, so that a set is the same at all sizes.
pub fn campaigns(campaign: Campaign, sizes: &Sizes, seeds: Seeds) -> Vec<Planned> {
    let seed = seeds.domain();
    let planned = |name: String, noise: NoiseKind, content: Content, amount: fn(f64) -> Amount, of: f64| {
        let id = format!("{}/{name}", campaign.name());
        let recipe = Recipe {
            // This is the run's id in the table, which must not say what is hidden.
            name: "set".into(),
            noise,
            content,
            amount: amount(of),
            frames: sizes.frames,
            ..Recipe::new(seed_of(&id, seed))
        };
        Planned { id, campaign, recipe }
    };
    let doses = |physics: &[&'static Definition], separations: &[f64], strengths: &[f64], each: usize| {
        let amounts = separations.iter().map(|z| ("z", *z, Amount::BeyondSpread as fn(f64) -> Amount));
        let amounts: Vec<_> =
            amounts.chain(strengths.iter().map(|s| ("s", *s, Amount::Strength as _))).collect();
        let mut sets = Vec::new();
        for physics in physics {
            for (letter, of, amount) in &amounts {
                for index in 0..each {
                    let name = format!("{}-{letter}{of}-{index}", physics.id);
                    sets.push(planned(name, NoiseKind::Any, alone(physics), *amount, *of));
                }
            }
        }
        sets
    };
    let several = |effects: usize, count: usize| {
        let set = |index: usize| {
            let name = format!("{index:03}");
            let share = uniform(seed_of(&format!("z of {name}"), seed));
            let z = SEVERAL_Z[0] * (SEVERAL_Z[1] / SEVERAL_Z[0]).powf(share);
            let content = Content { combine: Some(effects), ..Content::default() };
            planned(name, NoiseKind::Any, content, Amount::BeyondSpread, z)
        };
        (0..count).map(set).collect()
    };
    match campaign {
        Campaign::FalseAlarms => {
            let kinds = [NoiseKind::White, NoiseKind::Coloured, NoiseKind::Quantised];
            let names = ["white", "coloured", "quantised"];
            let set = |index: usize| {
                let kind = index % kinds.len();
                let content = Content { none: true, ..Content::default() };
                let name = format!("{}-{:03}", names[kind], index / kinds.len());
                planned(name, kinds[kind], content, Amount::Strength, 0.0)
            };
            (0..sizes.false_alarms).map(set).collect()
        }
        Campaign::Names => doses(&sizes.physics, &sizes.separations, &sizes.strengths, sizes.name_seeds),
        Campaign::Pairs => several(2, sizes.pairs),
        Campaign::Triples => several(3, sizes.triples),
        Campaign::Outside => {
            doses(&sizes.outside, &sizes.outside_separations, &sizes.outside_strengths, sizes.outside_seeds)
        }
    }
}

fn alone(physics: &Definition) -> Content {
    Content { physics: vec![physics.id.into()], ..Content::default() }
}

fn within() -> impl Iterator<Item = &'static Definition> {
    CATALOGUE.iter().copied().filter(|definition| definition.effect.is_some())
}

fn outside() -> impl Iterator<Item = &'static Definition> {
    CATALOGUE.iter().copied().filter(|definition| definition.effect.is_none())
}

/// Forms of an effect that the library does not have.
fn foreign(effect: &str) -> impl Iterator<Item = &'static Definition> {
    within().filter(move |definition| definition.effect == Some(effect) && !definition.is_library_point)
}

/// The first form of each effect that the library does not have.
fn one_of_each() -> impl Iterator<Item = &'static Definition> {
    let mut seen = Vec::new();
    within().filter(|definition| !definition.is_library_point).filter(move |definition| {
        let is_new = !seen.contains(&definition.effect);
        seen.push(definition.effect);
        is_new
    })
}

/// A different seed for each name: FNV-1a, mixed as in `SplitMix64`.
fn seed_of(name: &str, seed: u64) -> u64 {
    let hash = name.bytes().fold(0xcbf2_9ce4_8422_2325_u64 ^ seed, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    });
    let mixed = (hash ^ (hash >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    mixed ^ (mixed >> 31)
}

/// In `[0, 1)`.
fn uniform(seed: u64) -> f64 {
    (seed >> 11) as f64 / (1_u64 << 53) as f64
}

#[cfg(test)]
#[path = "campaign_tests.rs"]
mod tests;
