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
        let mut predicted = Vec::with_capacity(self.bins.len() * self.bins.elements);
        self.stream(parameters.clone())?.take(self.bins.len(), &mut predicted)?;
        Ok(predicted)
    }

    /// The prediction of a model, to be taken part by part.
    pub(crate) fn stream(&self, parameters: Parameters) -> Result<Stream<'_>, DiscoverError> {
        let effects = parameters.terms.iter().map(Term::effect).collect::<Result<Vec<_>, _>>()?;
        Ok(Stream { predictor: self, parameters, effects, bin: 0, running: None })
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

/// The prediction of a model in order of time, with the history of the bins taken so far.
pub(crate) struct Stream<'a> {
    predictor: &'a Predictor<'a>,
    parameters: Parameters,
    effects: Vec<Effect>,
    /// The next bin.
    bin: usize,
    running: Option<Running>,
}

/// The pipeline of a run and a tool.
struct Running {
    run: usize,
    tool: u16,
    covering_mm: f64,
    pipeline: Pipeline,
}

impl Stream<'_> {
    /// Appends the counts of so many more bins.
    pub(crate) fn take(&mut self, count: usize, predicted: &mut Vec<f64>) -> Result<(), DiscoverError> {
        let Predictor { known, frames, bins, .. } = *self.predictor;
        let (first_bin, first) = (self.bin, predicted.len());
        for bin in first_bin..first_bin + count {
            let frame = bins.first[bin];
            let (run, tool, covering_mm) = (bins.run[bin], frames.indenter[frame], frames.covering_mm[frame]);
            let covering = Covering { thickness_mm: covering_mm };
            let same = self.running.take().filter(|one| (one.run, one.tool) == (run, tool));
            let running = if let Some(running) = same {
                running
            } else {
                let pipeline =
                    self.predictor.pipeline(&self.parameters, run, tool, covering, &self.effects)?;
                Running { run, tool, covering_mm, pipeline }
            };
            let running = self.running.insert(running);
            if running.covering_mm.to_bits() != covering_mm.to_bits() {
                running.pipeline.set_covering(covering);
                running.covering_mm = covering_mm;
            }
            let temperature_c = Some(f64::from(frames.temperature_c[frame])).filter(|c| c.is_finite());
            let moment = Moment { t_s: bins.t_s[bin], temperature_c };
            predicted.extend(running.pipeline.step(moment, &bins.paths[run]));
        }
        self.bin += count;
        if let Some(walk) = &self.parameters.walk {
            walk.add_from(bins, first_bin, 1.0, &mut predicted[first..]);
        }
        let full_scale_counts = known.array.full_scale_counts();
        let is_positive = self.parameters.sensitivity.iter().all(|one| *one >= 0.0);
        let least = if is_positive { 0.0 } else { f64::NEG_INFINITY };
        for counts in &mut predicted[first..] {
            *counts = counts.clamp(least, full_scale_counts);
        }
        Ok(())
    }
}
