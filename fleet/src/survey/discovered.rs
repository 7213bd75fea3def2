//! What the model of one run is missing.

use std::path::Path;

use serde::{Deserialize, Serialize};
use tactus_discover::{Experiments, Frames, Known, Options, Rehearsal, RehearsalOrder, Rule, discover};
use tactus_record::rows;
use tactus_schema::Model;

use super::Analysis;

/// What a discovery finds in one run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Discovered {
    /// The verdict in one word.
    pub(crate) verdict: String,
    /// Effects that the rig's base model lacks, in the order in which they were found.
    pub(crate) effects: Vec<String>,
}

/// The verdict on a run that cannot show anything.
pub(crate) const CANNOT_JUDGE: &str = tactus_discover::Verdict::CannotJudge.name();

impl Analysis for Discovered {
    const NAME: &'static str = "discovery";

    fn of(table: &Path) -> Result<Self, String> {
        let mut frames: Option<Frames> = None;
        let mut covering_mm = 0.0;
        let source = rows::visit(&[table], |rig, row| {
            covering_mm = row.covering_mm;
            frames.get_or_insert_with(|| Frames::new(rig.array.elements())).push(row);
        });
        let rig = source.map_err(|error| error.to_string())?.rig;
        let frames = frames.ok_or("the run holds no frame")?;
        let model = Model::of_rig(&rig).ok_or("the rig's reference indenter is not among its tools")?;
        let known = Known {
            array: rig.array,
            psf: model.base.psf,
            response: model.base.response,
            registration: rig.registration,
            indenters: rig.indenters,
            effects: Vec::new(),
            drafts: Vec::new(),
        };
        // The survey has a thread for each run.
        let options = Options { seed: 0, threads: 1, rule: Rule::Protocol, tolerance_counts: None };
        let found = discover(&known, &frames, options, &NoExperiments { covering_mm }, &|_| ())
            .map_err(|error| error.to_string())?;
        Ok(Self {
            verdict: found.verdict.name().to_owned(),
            effects: found.steps.iter().map(|step| step.effect.to_owned()).collect(),
        })
    }
}

/// A fleet proposes no next experiment.
struct NoExperiments {
    covering_mm: f64,
}

impl Experiments for NoExperiments {
    fn covering_mm(&self) -> f64 {
        self.covering_mm
    }

    fn own(&self) -> &[String] {
        &[]
    }

    fn rehearse(&self, _: RehearsalOrder<'_>) -> Result<Rehearsal, String> {
        Err("a survey of recorded runs rehearses nothing".to_owned())
    }
}
