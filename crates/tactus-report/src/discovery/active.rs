//! Experiments that were run to decide between explanations.

use std::fmt;

use super::{DiscoveryReport, words::list};
use crate::{
    document::{Column, Table},
    markup::Text,
    numbers::digits,
};

/// An experiment that was run to decide between explanations, and the undecided effects before and after it.
#[derive(Debug, Clone, PartialEq)]
pub struct ActiveRun {
    /// Name of the experiment.
    pub experiment: String,
    /// Its parameters and their values.
    pub parameters: Vec<(&'static str, String)>,
    /// Run id of its recording.
    pub recording: String,
    /// Duration on the rig.
    pub duration_s: f64,
    /// The two explanations that it was to distinguish.
    pub separates: [String; 2],
    /// Expected difference between them in standard errors, if predicted.
    pub expected_z: Option<f64>,
    /// Effects added before, each with those that could not be distinguished from it.
    pub before: Vec<AmbiguousEffect>,
    /// The same with this experiment among the data.
    pub after: Vec<AmbiguousEffect>,
}

/// An added effect, and the effects that the data cannot distinguish from it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AmbiguousEffect {
    /// The effect that was added.
    pub effect: &'static str,
    /// Effects that explain the fitted presses nearly as well.
    pub equivalent: Vec<&'static str>,
}

impl AmbiguousEffect {
    /// Such as `relaxation` or `relaxation or imprint`.
    pub fn in_words(undecided: &[Self]) -> String {
        if undecided.is_empty() {
            return "nothing".into();
        }
        let either = |one: &Self| [&[one.effect][..], &one.equivalent].concat().join(" or ");
        undecided.iter().map(either).collect::<Vec<_>>().join("; ")
    }
}

/// The command line that runs an experiment.
pub fn command(experiment: &str, parameters: &[(&'static str, String)]) -> String {
    let parameters = parameters.iter().map(|(name, value)| {
        let is_plain = value.chars().all(|c| c.is_ascii_alphanumeric() || ".,_-".contains(c));
        if is_plain { format!(" -p {name}={value}") } else { format!(" -p '{name}={value}'") }
    });
    format!("tactus run {experiment}{}", parameters.collect::<String>())
}

pub(super) fn section(f: &mut fmt::Formatter<'_>, report: &DiscoveryReport<'_>) -> fmt::Result {
    let runs = report.active;
    if runs.is_empty() && report.active_ended.is_none() {
        return Ok(());
    }
    writeln!(f, "<section>\n<h2>Experiments that were run to decide</h2>")?;
    if let Some(why) = report.active_ended {
        writeln!(f, "<p>{}</p>", Text(why))?;
    }
    if runs.is_empty() {
        return writeln!(f, "</section>");
    }
    let mut table = Table::new(&[
        Column::Name("experiment"),
        Column::Name("to distinguish"),
        Column::Number("expected, standard errors"),
        Column::Number("took, s"),
        Column::Name("explained before by"),
        Column::Name("after by"),
    ]);
    for run in runs {
        table.row([
            command(&run.experiment, &run.parameters),
            list(&run.separates),
            run.expected_z.map_or_else(String::new, |z| digits(z, 2)),
            format!("{:.0}", run.duration_s),
            AmbiguousEffect::in_words(&run.before),
            AmbiguousEffect::in_words(&run.after),
        ]);
    }
    for sentence in report.settled {
        writeln!(f, "<p>{}</p>", Text(sentence))?;
    }
    writeln!(f, "{table}\n<p>All these recordings are among the data of this report.</p>\n</section>")
}
