//! Twins: effects that one of the paper's experiments cannot tell apart, and whether the experiments that
//! `tactus discover --active` chooses can.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};
use serde::Deserialize;

use super::outcome::parsed;

/// Hidden physics, and the effects that it is mistaken for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Twins {
    /// Id of the hidden physics, as in `tactus-mock hidden list`.
    pub physics: &'static str,
    /// Its strength; 1 is a bad rig.
    pub strength: f64,
    /// The effect that it is an instance of.
    pub effect: &'static str,
    /// Effects that look like it.
    pub twins: &'static [&'static str],
    /// The experiment of the paper that cannot tell them apart.
    pub experiment: &'static str,
}

/// A named effect, and those that the data cannot tell from it.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
pub struct Undecided {
    effect: String,
    equivalent: Vec<String>,
}

/// An experiment that was chosen and run, with the named effects before and after it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Chosen {
    experiment: String,
    parameters: BTreeMap<String, String>,
    duration_s: f64,
    #[serde(rename = "before_equivalent")]
    before: Vec<Undecided>,
    #[serde(rename = "after_equivalent")]
    after: Vec<Undecided>,
}

/// The result for one case of twins.
#[derive(Debug, Clone, PartialEq)]
pub struct Decision {
    /// The hidden physics and the effects that resemble it.
    pub twins: Twins,
    /// What is named in the end.
    pub named: Vec<Undecided>,
    /// The experiments of the round, in order; empty if nothing was undecided.
    pub chosen: Vec<Chosen>,
}

/// The cases of `docs/discovery-evidence.md`.
pub const TWINS: [Twins; 6] = [
    Twins {
        physics: "lost-motion",
        strength: 0.2,
        effect: "backlash",
        twins: &["hysteresis"],
        experiment: "corners",
    },
    Twins {
        physics: "imprint-power-law",
        strength: 0.1,
        effect: "imprint",
        twins: &["relaxation"],
        experiment: "element-centres",
    },
    Twins {
        physics: "soft-edge",
        strength: 0.2,
        effect: "edge-effect",
        twins: &["misregistration", "crosstalk", "gain-drift"],
        experiment: "corners",
    },
    Twins {
        physics: "stretched-spread",
        strength: 0.2,
        effect: "anisotropic-spread",
        twins: &["crosstalk"],
        experiment: "corners",
    },
    Twins {
        physics: "low-pass-second-order",
        strength: 0.5,
        effect: "low-pass",
        twins: &["time-lag"],
        experiment: "corners",
    },
    Twins {
        physics: "dead-band",
        strength: 0.4,
        effect: "surface-offset",
        twins: &["indenter-tilt"],
        experiment: "element-centres",
    },
];

/// Limit of the rig's time for a round.
pub const BUDGET_MIN: f64 = 6.0;

const RIG: &str = include_str!("../../../config/rigs/sim.toml");

#[derive(Debug, Deserialize)]
struct DiscoveryReport {
    steps: Vec<Undecided>,
    active: Vec<Chosen>,
}

#[derive(Debug, Deserialize)]
struct Summary {
    recording: PathBuf,
}

impl Twins {
    /// Runs the paper's experiment and one active round on the embedded rig, which hides this physics and nothing else.
    ///
    /// # Errors
    /// If the program or a file fails.
    pub fn decide(self, tactus: &Path, work: &Path) -> Result<Decision> {
        let folder = work.join(self.physics);
        if folder.exists() {
            fs::remove_dir_all(&folder).with_context(|| folder.display().to_string())?;
        }
        fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
        let (rig, truth, out) =
            (folder.join("rig.toml"), folder.join("hidden.toml"), folder.join("discovery"));
        fs::write(&rig, plain(RIG)?)?;
        fs::write(
            &truth,
            format!(
                "schema = \"tactus.hidden/1\"\n[[physics]]\nid = \"{}\"\nstrength = {:?}\nseed = 7\n",
                self.physics, self.strength
            ),
        )?;
        let on_rig = |command: &mut Command| -> Result<Vec<u8>> {
            let command = command.arg("--embedded").arg("--rig-file").arg(&rig).arg("--truth").arg(&truth);
            let output = command.output().with_context(|| tactus.display().to_string())?;
            let said = String::from_utf8_lossy(&output.stderr);
            ensure!(!output.stdout.is_empty(), "{}: {said}", self.physics);
            Ok(output.stdout)
        };
        let mut run = Command::new(tactus);
        run.args(["--json", "run", self.experiment, "--no-report", "--seed", "3", "--out"]);
        let summary: Summary = serde_json::from_slice(&on_rig(run.arg(folder.join("paper")))?)?;
        let mut discover = Command::new(tactus);
        // No effects of the lab take part.
        discover.env("XDG_STATE_HOME", &folder).env_remove("STATE_DIRECTORY");
        discover.args(["--json", "discover", "--active", "--budget-min"]).arg(BUDGET_MIN.to_string());
        on_rig(discover.arg(summary.recording).arg("--out").arg(&out))?;
        let report: DiscoveryReport = parsed(&out.join("report.json"))?;
        Ok(Decision { twins: self, named: report.steps, chosen: report.active })
    }

    /// True if the right effect is named, and no twin is named or equivalent to it.
    fn are_decided(self, named: &[Undecided]) -> bool {
        let is_twin = |name: &str| self.twins.contains(&name);
        named
            .iter()
            .any(|one| one.effect == self.effect && !one.equivalent.iter().any(|other| is_twin(other)))
            && !named.iter().any(|one| is_twin(&one.effect))
    }
}

impl Decision {
    /// True if the right effect or a twin was named, with all others as equivalents.
    pub fn is_undecided_before(&self) -> bool {
        let Twins { effect, twins, .. } = self.twins;
        self.chosen.first().is_some_and(|first| {
            first.before.iter().any(|one| {
                let has = |name: &str| one.effect == name || one.equivalent.iter().any(|other| other == name);
                has(effect) && twins.iter().all(|twin| has(twin))
            })
        })
    }

    /// True if after the round the right effect was named, and no twin was named or equivalent to it.
    pub fn is_decided_after(&self) -> bool {
        self.chosen.last().is_some_and(|last| self.twins.are_decided(&last.after))
    }

    /// True if the first experiment decided it: then there is no round.
    pub fn is_decided_at_once(&self) -> bool {
        self.chosen.is_empty() && self.twins.are_decided(&self.named)
    }

    /// The rig's time for the round, in s.
    pub fn duration_s(&self) -> f64 {
        self.chosen.iter().fold(0.0, |sum, chosen| sum + chosen.duration_s)
    }

    fn row(&self) -> String {
        let Twins { physics, strength, effect, twins, experiment } = self.twins;
        let (before, after) = self.chosen.first().map_or_else(
            || (in_words(&self.named), "-".into()),
            |first| (in_words(&first.before), in_words(&first.after)),
        );
        let experiments: Vec<String> = self.chosen.iter().map(Chosen::command).collect();
        let decided = if self.is_decided_at_once() {
            "by the first experiment"
        } else if self.is_undecided_before() && self.is_decided_after() {
            "yes"
        } else {
            "**no**"
        };
        format!(
            "| {physics} | {strength} | {effect} or {} | {experiment} | {before} | {} | {:.0} s | {after} | {decided} |\n",
            twins.join(", "),
            experiments.join("; "),
            self.duration_s(),
        )
    }
}

/// The table of `docs/discovery-evidence.md`.
pub fn twins_table(decisions: &[Decision]) -> String {
    let head = "| hidden physics | strength | effect or twins | first experiment | named after it | chosen next | time on the rig | named after that | decided |\n\
                |---|---|---|---|---|---|---|---|---|\n";
    let rows: Vec<String> = decisions.iter().map(Decision::row).collect();
    [head, &rows.concat()].concat()
}

impl Chosen {
    fn command(&self) -> String {
        let parameters = self.parameters.iter().map(|(name, value)| format!(" {name}={value}"));
        format!("{}{}", self.experiment, parameters.collect::<String>())
    }
}

fn in_words(undecided: &[Undecided]) -> String {
    let either = |one: &Undecided| [&[one.effect.clone()][..], &one.equivalent].concat().join(" or ");
    let all: Vec<String> = undecided.iter().map(either).collect();
    if all.is_empty() { "nothing named".into() } else { all.join("; ") }
}

/// The rig file without the departures that its own simulation hides.
fn plain(rig: &str) -> Result<String> {
    let mut rig: toml::Table = rig.parse()?;
    let simulation = rig.get_mut("simulation").and_then(toml::Value::as_table_mut);
    let simulation = simulation.context("the rig has no simulation")?;
    simulation.remove("miswired");
    let nowhere: toml::Table = "origin_mm = [0.0, 0.0]\nrotation_deg = 0.0".parse()?;
    simulation.insert("registration_error".into(), nowhere.into());
    simulation.insert("quadratic_per_mm".into(), 0.0.into());
    Ok(toml::to_string(&rig)?)
}

#[cfg(test)]
#[path = "twins_tests.rs"]
mod tests;
