//! Predictions of a model for the bins.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use tactus_model::effect::PipelineStage;
use tactus_model::{
    Contact, Covering, Effect, ForwardModel, Images, Indenter, Moment, Pipeline, Response, Simulator,
};

use super::parameters::{Parameters, Term};
use crate::data::{Bins, DiscoverError, Frames, Known, Mismatch};

/// The data and what is known of the rig, from which predictions are made.
#[derive(Debug, Clone)]
pub(crate) struct Predictor<'a> {
    pub(crate) known: &'a Known,
    pub(crate) frames: &'a Frames,
    pub(crate) bins: &'a Bins,
    /// Cached images of presses, shared by all predictions.
    pub(crate) images: Arc<Images>,
    /// The least count that the converter gives.
    least_counts: f64,
    /// Work of all predictions so far: see [`Predictor::work`].
    work: Arc<AtomicU64>,
}

/// Greatest number of cached images of 48 elements, about 130 MB.
const IMAGES_MAX: usize = 200_000;

/// The least count that the converter of these readings gives. One that reads below its declared end does not end there, such as where a zero
/// is subtracted.
fn least_counts(known: &Known, readings: &Frames) -> f64 {
    let declared = known.array.least_counts();
    // A reading at the end is rounded.
    let below = declared - 0.5 * known.array.step_counts();
    let is_below = |counts: &f32| f64::from(*counts) < below;
    if readings.counts.iter().any(is_below) { f64::NEG_INFINITY } else { declared }
}

/// An empty cache of images, with the same number of values for every array.
pub(crate) fn no_images(elements: usize) -> Arc<Images> {
    Arc::new(Images::new(IMAGES_MAX * 48 / elements.max(1)))
}

impl<'a> Predictor<'a> {
    /// With a cache of images of its own.
    pub(crate) fn new(known: &'a Known, frames: &'a Frames, bins: &'a Bins) -> Self {
        Self::with_images(known, frames, bins, &no_images(bins.elements))
    }

    /// With a cache that others use, too.
    pub(crate) fn with_images(
        known: &'a Known,
        frames: &'a Frames,
        bins: &'a Bins,
        images: &Arc<Images>,
    ) -> Self {
        let (images, least_counts) = (Arc::clone(images), least_counts(known, frames));
        Self { known, frames, bins, images, least_counts, work: Arc::default() }
    }

    /// The same with the converter that gave other readings.
    pub(crate) fn read_as(self, readings: &Frames) -> Self {
        Self { least_counts: least_counts(self.known, readings), ..self }
    }

    /// How much was computed so far, in predicted readings, each counted once and once more for each effect of its model. It depends on the
    /// data and on what was asked alone, whatever the machine and the number of threads.
    pub(crate) fn work(&self) -> u64 {
        self.work.load(Ordering::Relaxed)
    }

    fn has_worked(&self, moments: usize, effects: usize) {
        let readings = moments * self.bins.elements * (1 + effects);
        // No sum of `usize` in a discovery exceeds `u64`.
        self.work.fetch_add(u64::try_from(readings).unwrap_or(u64::MAX), Ordering::Relaxed);
    }

    /// Counts of every bin and element, without noise and rounding.
    pub(crate) fn predict(&self, parameters: &Parameters) -> Result<Vec<f64>, DiscoverError> {
        let mut predicted = Vec::with_capacity(self.bins.len() * self.bins.elements);
        self.stream(parameters.clone())?.take(self.bins.len(), |_| true, &mut predicted)?;
        Ok(predicted)
    }

    /// The prediction of a model, to be taken part by part.
    pub(crate) fn stream(&self, parameters: Parameters) -> Result<Stream<'_>, DiscoverError> {
        let effects = parameters.terms.iter().map(Term::effect).collect::<Result<Vec<_>, _>>()?;
        Ok(Stream { predictor: self, parameters, effects, from: None, bin: 0, running: None })
    }

    /// As [`Self::stream`], on what the first stages of `trunk` reach, if the model differs from it only in what follows.
    pub(crate) fn branch(
        &self,
        parameters: Parameters,
        trunk: &Parameters,
    ) -> Result<Stream<'_>, DiscoverError> {
        let Some(from) = parameters.shared(trunk)? else { return self.stream(parameters) };
        let mut covers = 0;
        let mut effects = Vec::new();
        for term in &parameters.terms {
            let effect = term.effect()?;
            let is_covering = term.definition.stage() == PipelineStage::Covering;
            covers += usize::from(is_covering);
            if !(effect.acts_before_signal() || is_covering && covers <= from) {
                effects.push(effect);
            }
        }
        Ok(Stream { predictor: self, parameters, effects, from: Some(from), bin: 0, running: None })
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
            sensitivity_counts_per_mm: parameters
                .sensitivity
                .iter()
                .map(|gain| gain * parameters.run_gain[run])
                .collect(),
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

    fn moment(&self, bin: usize) -> Moment {
        self.moment_at(bin, self.bins.t_s[bin])
    }

    /// Moments on the way to a bin at which no frame is read.
    fn moments_before(&self, bin: usize) -> impl Iterator<Item = Moment> {
        let way = self.frames.way_to(self.bins.first[bin]);
        way.iter().map(move |point| self.moment_at(bin, point.t_s))
    }

    fn moment_at(&self, bin: usize, t_s: f64) -> Moment {
        let temperature_c = f64::from(self.frames.temperature_c[self.bins.first[bin]]);
        Moment { t_s, temperature_c: Some(temperature_c).filter(|c| c.is_finite()) }
    }

    fn indenter(&self, tool: u16) -> Result<Indenter, DiscoverError> {
        let id = &self.frames.indenters[usize::from(tool)];
        let known = &self.known.indenters;
        let unknown = || Mismatch::UnknownIndenter { id: id.clone(), known: known.keys().cloned().collect() };
        Ok(known.get(id).cloned().ok_or_else(unknown)?)
    }
}

/// The prediction of a model in order of time, with the history of the bins taken so far.
pub(crate) struct Stream<'a> {
    predictor: &'a Predictor<'a>,
    parameters: Parameters,
    /// The effects that its pipelines have.
    effects: Vec<Effect>,
    /// If it goes on from a trunk: from the signal after so many of the trunk's effects of the covering.
    from: Option<usize>,
    /// The next bin.
    bin: usize,
    running: Option<Box<Running>>,
}

/// What the first stages of a model's pipeline give for some bins, and for the way to them of which no frame is read. The streams of models
/// that differ only in what follows go on from there.
pub(crate) struct Reached {
    contacts: Vec<Contact>,
    /// Moment by moment: before the effects of the covering and after each of them.
    signals_mm: Vec<f64>,
}

/// The pipeline of a run and a tool.
struct Running {
    run: usize,
    tool: u16,
    covering_mm: f64,
    pipeline: Pipeline,
}

impl Stream<'_> {
    /// Appends the counts of so many more bins; any, for those that are not wanted.
    pub(crate) fn take(
        &mut self,
        count: usize,
        wanted: impl Fn(usize) -> bool,
        predicted: &mut Vec<f64>,
    ) -> Result<(), DiscoverError> {
        let (predictor, first_bin, first) = (self.predictor, self.bin, predicted.len());
        predictor.has_worked(count, self.effects.len());
        predicted.reserve(count * predictor.bins.elements);
        for bin in first_bin..first_bin + count {
            let path = &predictor.bins.paths[predictor.bins.run[bin]];
            let (moment, pipeline) = (predictor.moment(bin), self.pipeline(bin)?);
            for moment in predictor.moments_before(bin) {
                pipeline.pass(moment, path);
            }
            if wanted(bin) {
                pipeline.step(moment, path);
            } else {
                pipeline.pass(moment, path);
            }
            predicted.extend(pipeline.counts());
        }
        self.finish(first_bin, &mut predicted[first..]);
        Ok(())
    }

    /// As [`Self::take`], on what a trunk has reached for these bins, where the model allows it.
    pub(crate) fn take_on(
        &mut self,
        count: usize,
        reached: &Reached,
        wanted: impl Fn(usize) -> bool,
        predicted: &mut Vec<f64>,
    ) -> Result<(), DiscoverError> {
        let Some(from) = self.from else { return self.take(count, wanted, predicted) };
        let (predictor, first_bin, first) = (self.predictor, self.bin, predicted.len());
        predictor.has_worked(count, self.effects.len());
        predicted.reserve(count * predictor.bins.elements);
        let elements = predictor.bins.elements;
        let each = reached.signals_mm.len() / reached.contacts.len().max(1);
        let signals_mm = reached.signals_mm.chunks_exact(each.max(1));
        let mut reached = reached.contacts.iter().zip(signals_mm);
        for bin in first_bin..first_bin + count {
            let (moment, pipeline) = (predictor.moment(bin), self.pipeline(bin)?);
            let before = predictor.moments_before(bin).map(|moment| (moment, false));
            for ((moment, wanted), (contact, signals_mm)) in
                before.chain([(moment, wanted(bin))]).zip(reached.by_ref())
            {
                let signal_mm = &signals_mm[from * elements..(from + 1) * elements];
                if wanted {
                    pipeline.step_on(moment, contact, signal_mm);
                } else {
                    pipeline.pass_on(moment, contact, signal_mm);
                }
            }
            predicted.extend(pipeline.counts());
        }
        self.finish(first_bin, &mut predicted[first..]);
        Ok(())
    }

    /// The first stages for so many more bins.
    pub(crate) fn reach(&mut self, count: usize) -> Result<Reached, DiscoverError> {
        let predictor = self.predictor;
        let mut reached = Reached { contacts: Vec::with_capacity(count), signals_mm: Vec::new() };
        for bin in self.bin..self.bin + count {
            let path = &predictor.bins.paths[predictor.bins.run[bin]];
            let pipeline = self.pipeline(bin)?;
            for moment in predictor.moments_before(bin).chain([predictor.moment(bin)]) {
                pipeline.reach(moment, path, &mut reached.signals_mm);
                reached.contacts.push(pipeline.contact().clone());
            }
        }
        self.bin += count;
        Ok(reached)
    }

    /// The pipeline at a bin: a new one for another run or tool.
    fn pipeline(&mut self, bin: usize) -> Result<&mut Pipeline, DiscoverError> {
        let Predictor { frames, bins, .. } = self.predictor;
        let frame = bins.first[bin];
        let (run, tool, covering_mm) = (bins.run[bin], frames.indenter[frame], frames.covering_mm[frame]);
        let covering = Covering { thickness_mm: covering_mm };
        let same = self.running.take().filter(|one| (one.run, one.tool) == (run, tool));
        let running = if let Some(running) = same {
            running
        } else {
            let pipeline = self.predictor.pipeline(&self.parameters, run, tool, covering, &self.effects)?;
            Box::new(Running { run, tool, covering_mm, pipeline })
        };
        let running = self.running.insert(running);
        if running.covering_mm.to_bits() != covering_mm.to_bits() {
            running.pipeline.set_covering(covering);
            running.covering_mm = covering_mm;
        }
        Ok(&mut running.pipeline)
    }

    /// What follows the pipeline for the bins from `first_bin` on: walks of the baselines, and the converter's range.
    fn finish(&mut self, first_bin: usize, predicted: &mut [f64]) {
        let Predictor { known, bins, least_counts, .. } = self.predictor;
        self.bin = first_bin + predicted.len() / bins.elements;
        if let Some(walk) = &self.parameters.walk {
            walk.add_from(bins, first_bin, 1.0, predicted);
        }
        let full_scale_counts = known.array.full_scale_counts();
        for counts in predicted {
            *counts = counts.clamp(*least_counts, full_scale_counts);
        }
    }
}
