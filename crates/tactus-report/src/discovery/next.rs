//! Proposed experiments, each once, with everything that it would decide.

use std::fmt;

use tactus_discover::{Discovery, NextExperiment};

use super::{active::command, words::list};
use crate::{
    markup::Text,
    numbers::{digits, duration},
};

/// A proposed experiment.
#[derive(Debug, Clone, PartialEq)]
pub struct Proposal {
    /// The command line that runs it.
    pub command: String,
    /// Approximate duration on the rig.
    pub duration_s: f64,
    /// What it decides, such as `distinguishes backlash from hysteresis (z = 11); shows imprint (z = 4.1)`.
    pub decides: String,
}

/// The proposed experiments in order of priority, each once.
pub fn proposals(found: &Discovery) -> Vec<Proposal> {
    let mut commands: Vec<(String, Vec<&NextExperiment>)> = Vec::new();
    for next in &found.next_experiments {
        let command = command(next.experiment, &next.parameters);
        match commands.iter_mut().find(|(other, _)| *other == command) {
            Some((_, questions)) => questions.push(next),
            None => commands.push((command, vec![next])),
        }
    }
    let proposal = |(command, questions): (String, Vec<&NextExperiment>)| Proposal {
        command,
        duration_s: questions[0].duration_s,
        decides: decides(&questions),
    };
    commands.into_iter().map(proposal).collect()
}

fn decides(questions: &[&NextExperiment]) -> String {
    let mut parts: Vec<String> = Vec::new();
    let mut shown: Vec<String> = Vec::new();
    for next in questions {
        let [one, other] = &next.separates;
        let z = next.expected_z.map_or_else(String::new, |z| format!(" (z = {})", digits(z, 2)));
        if other == "nothing" {
            shown.push(format!("{one}{z}"));
        } else {
            parts.push(format!("distinguishes {one} from {other}{z}"));
        }
    }
    if !shown.is_empty() {
        parts.push(format!("shows {}", list(&shown)));
    }
    parts.join("; ")
}

pub(super) fn section(f: &mut fmt::Formatter<'_>, found: &Discovery) -> fmt::Result {
    writeln!(f, "<section>\n<h2>What to measure next</h2>")?;
    let proposals = proposals(found);
    if proposals.is_empty() {
        return writeln!(f, "<p>No experiment is proposed.</p>\n</section>");
    }
    writeln!(f, "<ol>")?;
    for Proposal { command, duration_s, decides } in &proposals {
        writeln!(
            f,
            "<li><code>{}</code> ({})<br>{}</li>",
            Text(command),
            duration(*duration_s),
            Text(decides)
        )?;
    }
    writeln!(
        f,
        "</ol>\n<p>z: expected difference between two explanations, or size of a small effect, in standard errors. Give the \
         new recording together with these data to <code>tactus discover</code>.</p>\n</section>"
    )
}
