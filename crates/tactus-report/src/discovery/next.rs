//! Proposed experiments, each once, with everything that it would decide; and why there are no others.

use std::fmt;

use tactus_discover::{Discovery, LeftOut, NextExperiment, OpenQuestion, Verdict, WORTH_Z};

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
    for next in &found.plan.next {
        let command = command(&next.experiment, &next.parameters);
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

/// Why nothing is proposed, or nothing for some questions; and which experiments were left out. A sentence each.
pub fn not_proposed(found: &Discovery) -> Vec<String> {
    let plan = &found.plan;
    let mut said: Vec<String> = plan.open.iter().map(open).collect();
    if plan.next.is_empty() && plan.open.is_empty() {
        said.push(format!("No experiment is proposed: {}.", nothing_open(found)));
    }
    let mut reasons: Vec<(&str, Vec<String>)> = Vec::new();
    for LeftOut { experiment, parameters, reason } in &plan.left_out {
        let command = format!("`{}`", command(experiment, parameters));
        match reasons.iter_mut().find(|(known, _)| known == reason) {
            Some((_, commands)) => commands.push(command),
            None => reasons.push((reason, vec![command])),
        }
    }
    said.extend(reasons.iter().map(|(reason, commands)| format!("Left out: {}: {reason}.", list(commands))));
    said
}

/// Why there is no question that an experiment would decide.
pub fn nothing_open(found: &Discovery) -> &'static str {
    match found.verdict {
        Verdict::CannotJudge => "no experiment of this rig would rest and repeat a press",
        Verdict::NothingMissing | Verdict::Explained => "no two explanations are undecided",
        Verdict::PartlyExplained | Verdict::Unexplained => {
            "no two effects are undecided, and what remains is no effect of the library, so no experiment can be predicted"
        }
    }
}

/// Effects of the tool's face: under a small one they are smaller than the covering spreads.
const NEED_A_WIDE_TOOL: [&str; 2] = ["indenter-size", "indenter-tilt"];

/// Such as `No experiment would distinguish backlash from hysteresis: ...`.
pub fn open(question: &OpenQuestion) -> String {
    let [one, other] = &question.separates;
    let why = question.best.as_ref().map_or_else(
        || "none of those that would could be rehearsed".to_owned(),
        |best| {
            let z = best.expected_z.map_or_else(|| "no".to_owned(), |z| digits(z, 2));
            format!(
                "the best, `{}`, would show {z} standard errors, and less than {WORTH_Z} is not worth its time",
                command(&best.experiment, &best.parameters)
            )
        },
    );
    if other == "nothing" {
        let wider =
            if NEED_A_WIDE_TOOL.contains(&one.as_str()) { "; a wider indenter would show more" } else { "" };
        format!("No experiment would show a small {one}: {why}{wider}.")
    } else {
        format!("No experiment would distinguish {one} from {other}: {why}.")
    }
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
    for sentence in not_proposed(found) {
        writeln!(f, "<p>{}</p>", Text(sentence))?;
    }
    if proposals.is_empty() {
        return writeln!(f, "</section>");
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
        "</ol>\n<p>z: expected difference between two explanations, or size of a small effect, in standard errors, if the experiment goes as in its \
         rehearsal on the simulated twin. Give the \
         new recording together with these data to <code>tactus discover</code>.</p>\n</section>"
    )
}
