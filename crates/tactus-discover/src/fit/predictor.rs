//! Predictions of a model for the bins.

use std::sync::Arc;

use tactus_model::{Covering, Effect, ForwardModel, Images, Indenter, Moment, Pipeline, Response, Simulator};

use super::parameters::{Parameters, Term};
use crate::data::{Bins, DiscoverError, Frames, Known};

/// The data and what is known of the rig, from which predictions are made.
#[derive(Debug)]
pub(crate) struct Predictor<'a> {
    pub(crate) known: &'a Known,
    pub(crate) frames: &'a Frames,
    pub(crate) bins: &'a Bins,
    /// Cached images of presses, shared by all predictions.
    pub(crate) images: Arc<Images>,
}

/// Greatest number of cached images of 48 elements, about 130 MB.
const IMAGES_MAX: usize = 200_000;

impl<'a> Predictor<'a> {
    pub(crate) fn new(known: &'a Known, frames: &'a Frames, bins: &'a Bins) -> Self {
        // The same number of values for every array.
        let images = Arc::new(Images::new(IMAGES_MAX * 48 / bins.elements.max(1)));
        Self { known, frames, bins, images }
    }

    /// Counts of every bin and element, without noise and rounding.
    pub(crate) fn predict(&self, parameters: &Parameters) -> Result<Vec<f64>, DiscoverError> {
        let Self { known, frames, bins, .. } = self;
        let effects = parameters.terms.iter().map(Term::effect).collect::<Result<Vec<_>, _>>()?;
        let elements = bins.elements;
        let mut predicted: Vec<f64> = Vec::with_capacity(bins.len() * elements);
        let mut bin = 0;
        for (run, path) in bins.paths.iter().enumerate() {
            let mut pipeline: Option<(u16, f64, Pipeline)> = None;
            while bin < bins.len() && bins.run[bin] == run {
                let frame = bins.first[bin];
                let (tool, covering_mm) = (frames.indenter[frame], frames.covering_mm[frame]);
                let covering = Covering { thickness_mm: covering_mm };
                if pipeline.as_ref().is_none_or(|(known, ..)| *known != tool) {
                    let made = self.pipeline(parameters, run, tool, covering, &effects)?;
                    pipeline = Some((tool, covering_mm, made));
                }
                if let Some((_, last_mm, pipeline)) = &mut pipeline {
                    if last_mm.to_bits() != covering_mm.to_bits() {
                        pipeline.set_covering(covering);
                        *last_mm = covering_mm;
                    }
                    let temperature_c = Some(f64::from(frames.temperature_c[frame]))
                        .filter(|temperature_c| temperature_c.is_finite());
                    predicted.extend(pipeline.step(Moment { t_s: bins.t_s[bin], temperature_c }, path));
                }
                bin += 1;
            }
        }
        if let Some(walk) = &parameters.walk {
            walk.add(bins, 1.0, &mut predicted);
        }
        let full_scale_counts = known.array.full_scale_counts();
        let least =
            if parameters.sensitivity.iter().all(|one| *one >= 0.0) { 0.0 } else { f64::NEG_INFINITY };
        for counts in &mut predicted {
            *counts = counts.clamp(least, full_scale_counts);
        }
        Ok(predicted)
    }

    fn pipeline(
        &self,
        parameters: &Parameters,
        run: usize,
        tool: u16,
        covering: Covering,
        effects: &[Effect],
    ) -> Result<Pipeline, DiscoverError> {
        let known = self.known;
        let response = Response {
            sensitivity_counts_per_mm: parameters.sensitivity.clone(),
            baseline_counts: parameters.baseline[run].clone(),
            ..known.response.clone()
        };
        let model = ForwardModel::new(known.array.clone(), parameters.psf, response)?;
        let mut pipeline = Pipeline::new(&Simulator {
            model,
            registration: known.registration,
            surface_mm: 0.0,
            covering,
            indenter: self.indenter(tool)?,
            effects: effects.to_vec(),
            noise_rms_counts: 0.0,
        })?;
        pipeline.share(Arc::clone(&self.images));
        Ok(pipeline)
    }

    fn indenter(&self, tool: u16) -> Result<Indenter, DiscoverError> {
        let id = &self.frames.indenters[usize::from(tool)];
        let unknown = || DiscoverError::TooLittle(format!("the rig describes no indenter {id:?}"));
        self.known.indenters.get(id).cloned().ok_or_else(unknown)
    }
}
