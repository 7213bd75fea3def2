//! The pipeline in time: from the position of the tip to the reading of every element.

use std::{slice, sync::Arc};

use crate::effect::{
    BaseModel, Drafted, Effect, EffectError, Load, Make, Now, OnContact, OnCovering, OnElement, OnMotion,
    OnReadout, PipelineStage, Tabled, TipState,
};
use crate::forward::Shares;
use crate::{
    Contact, Covering, ForwardModel, Images, Indenter, Path, PressTable, PressTableError, Readout,
    Registration, Simulator,
};

/// An instant at which the elements are read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moment {
    /// Time since the start, in s.
    pub t_s: f64,
    /// Temperature of the sensor, where it is known.
    pub temperature_c: Option<f64>,
}

/// A running [`Simulator`]: computes the readings moment by moment.
///
/// ```text
/// motion    path at t, effects        -> tip, registration, surface
/// contact   effects                   -> tool, position, rotation, depth = surface - z
/// covering  base model u_e, effects   -> what reaches every element, in mm
/// element   effects, base response    -> counts
/// readout   effects; then read()      -> what the converter gives
/// ```
///
/// Stages without memory are computed again only when the contact changes, so a resting tip costs little. Without effects
/// the counts are those of [`ForwardModel::image`], to the bit.
///
/// Moments need not be evenly spaced, and not every moment need be a frame. Time does not go back: a moment before the
/// last one counts as the same instant.
#[derive(Debug)]
pub struct Pipeline {
    model: ForwardModel,
    readout: Readout,
    registration: Registration,
    surface_mm: f64,
    covering: Covering,
    indenter: Indenter,
    stiffness: f64,
    stages: Stages,
    last_s: Option<f64>,
    pressed: Pressed,
    table: Option<PressTable>,
    images: Option<Arc<Images>>,
    signal_mm: Vec<f64>,
    counts: Vec<f64>,
}

/// The effects of each stage, in their order.
#[derive(Debug, Default)]
struct Stages {
    motion: Vec<Box<dyn OnMotion>>,
    contact: Vec<Box<dyn OnContact>>,
    covering: Vec<Box<dyn OnCovering>>,
    element: Vec<Box<dyn OnElement>>,
    readout: Vec<Box<dyn OnReadout>>,
    /// The last stage with an effect that remembers.
    remember: Option<PipelineStage>,
    /// True if a press at one place and depth may differ with time.
    press_is_timed: bool,
}

/// The last contact and its signal at the elements.
#[derive(Debug)]
struct Pressed {
    /// Position, rotation and depth, and the time if it matters; `None` if the image must be computed again.
    at: Option<([f64; 2], f64, f64, Option<f64>)>,
    contact: Contact,
    loads: Vec<Load>,
    /// What the last press of each load leaves for the next.
    shares: Vec<Shares>,
    reached_mm: Vec<f64>,
    of_one_mm: Vec<f64>,
}

/// A moment, and the time since the one before.
#[derive(Debug, Clone, Copy)]
struct Elapsed {
    t_s: f64,
    dt_s: f64,
    temperature_c: Option<f64>,
}

impl Elapsed {
    fn now(self, base: BaseModel<'_>) -> Now<'_> {
        let Self { t_s, dt_s, temperature_c } = self;
        Now { t_s, dt_s, temperature_c, base, contact: None, signal_mm: &[] }
    }
}

/// Sources of images that need not be computed.
#[derive(Debug, Clone, Copy)]
struct Ready<'a> {
    table: Option<&'a PressTable>,
    images: Option<&'a Images>,
}

impl Moment {
    /// An instant with unknown temperature.
    pub fn at(t_s: f64) -> Self {
        Self { t_s, temperature_c: None }
    }
}

impl Pipeline {
    /// A sensor without history.
    ///
    /// # Errors
    /// [`EffectError::Element`] if an effect names an element that the array does not have.
    pub fn new(simulator: &Simulator) -> Result<Self, EffectError> {
        let Simulator { model, registration, surface_mm, covering, indenter, effects, .. } =
            simulator.clone();
        let elements = model.array().elements();
        effects.iter().try_for_each(|effect| effect.fits(model.array()))?;
        Ok(Self {
            readout: Readout::of(model.array()),
            registration,
            surface_mm,
            covering,
            stiffness: 1.0,
            stages: Stages::of(&effects),
            last_s: None,
            pressed: Pressed {
                at: None,
                contact: Contact {
                    indenter: indenter.clone(),
                    position_mm: [0.0; 2],
                    rotation_deg: 0.0,
                    depth_mm: 0.0,
                },
                loads: Vec::new(),
                shares: Vec::new(),
                reached_mm: vec![0.0; elements],
                of_one_mm: vec![0.0; elements],
            },
            table: None,
            images: None,
            signal_mm: vec![0.0; elements],
            counts: vec![0.0; elements],
            indenter,
            model,
        })
    }

    /// Counts of every element at a moment, row-major, before noise and converter.
    ///
    /// `path`: the tip in the robot frame, z up; a fixed position, a [`Trajectory`](crate::Trajectory), a
    /// [`Trail`](crate::Trail) of the positions so far, or a function of time.
    pub fn step(&mut self, moment: Moment, path: &impl Path) -> &[f64] {
        let moment = self.elapse(moment);
        self.press(moment, path);
        self.cover(moment, |_| ());
        self.respond(moment)
    }

    /// The first part of a step. Appends to `signals_mm` the signal that reaches the elements, before the effects of the covering and
    /// after each of them: row-major, in mm. [`Pipeline::contact`] is that of the moment. [`Pipeline::step_on`] of other pipelines goes
    /// on from there.
    pub fn reach(&mut self, moment: Moment, path: &impl Path, signals_mm: &mut Vec<f64>) {
        let moment = self.elapse(moment);
        self.press(moment, path);
        signals_mm.extend(&self.signal_mm);
        self.cover(moment, |signal_mm| signals_mm.extend(signal_mm));
    }

    /// As [`Pipeline::step`], from a contact and a signal of another pipeline at this moment, which has done the first part of the
    /// step for both. Effects that act before the signal ([`Effect::acts_before_signal`]) take no part.
    pub fn step_on(&mut self, moment: Moment, contact: &Contact, signal_mm: &[f64]) -> &[f64] {
        let moment = self.elapse(moment);
        self.go_on_from(contact, signal_mm);
        self.cover(moment, |_| ());
        self.respond(moment)
    }

    /// A step of which nobody wants the counts: only what the effects remember goes on. [`Pipeline::counts`] are then any.
    pub fn pass(&mut self, moment: Moment, path: &impl Path) {
        let moment = self.elapse(moment);
        if self.stages.remember == Some(PipelineStage::Motion) {
            self.place(moment, path);
        } else if self.stages.remember >= Some(PipelineStage::Covering) {
            self.press(moment, path);
            self.remember(moment);
        }
    }

    /// As [`Pipeline::pass`], from a contact and a signal of another pipeline.
    pub fn pass_on(&mut self, moment: Moment, contact: &Contact, signal_mm: &[f64]) {
        let moment = self.elapse(moment);
        if self.stages.remember >= Some(PipelineStage::Covering) {
            self.go_on_from(contact, signal_mm);
            self.remember(moment);
        }
    }

    fn go_on_from(&mut self, contact: &Contact, signal_mm: &[f64]) {
        self.pressed.contact.clone_from(contact);
        self.signal_mm.copy_from_slice(signal_mm);
    }

    /// What follows the signal, as far as effects remember it.
    fn remember(&mut self, moment: Elapsed) {
        self.cover(moment, |_| ());
        if self.stages.remember > Some(PipelineStage::Covering) {
            self.respond(moment);
        }
    }

    /// Advances the time.
    fn elapse(&mut self, Moment { t_s, temperature_c }: Moment) -> Elapsed {
        let dt_s = self.last_s.map_or(0.0, |last_s| (t_s - last_s).max(0.0));
        self.last_s = Some(self.last_s.map_or(t_s, |last_s| last_s.max(t_s)));
        Elapsed { t_s, dt_s, temperature_c }
    }

    /// Motion: where the tip is.
    fn place(&mut self, moment: Elapsed, path: &impl Path) -> TipState {
        let base = BaseModel { model: &self.model, covering: self.covering };
        let instant_s = self.stages.motion.iter().fold(moment.t_s, |t_s, effect| effect.instant_s(t_s));
        let mut tip = TipState {
            tip_mm: path.at(instant_s),
            registration: self.registration,
            surface_mm: self.surface_mm,
        };
        for effect in &mut self.stages.motion {
            effect.place(moment.now(base), &mut tip);
        }
        tip
    }

    /// Motion and contact: the signal that reaches the elements.
    fn press(&mut self, moment: Elapsed, path: &impl Path) {
        let tip = self.place(moment, path);
        let base = BaseModel { model: &self.model, covering: self.covering };
        let ready = Ready { table: self.table.as_ref(), images: self.images.as_deref() };
        self.pressed.press(&tip, &self.indenter, moment.now(base), &self.stages, ready);
        for (signal, reached) in self.signal_mm.iter_mut().zip(&self.pressed.reached_mm) {
            *signal = self.stiffness * reached;
        }
    }

    /// The effects of the covering; `after` each of them.
    fn cover(&mut self, moment: Elapsed, mut after: impl FnMut(&[f64])) {
        let now = moment.now(BaseModel { model: &self.model, covering: self.covering });
        for effect in &mut self.stages.covering {
            effect.signal(now, &self.pressed.contact, &mut self.signal_mm);
            after(&self.signal_mm);
        }
    }

    /// Elements and readout.
    fn respond(&mut self, moment: Elapsed) -> &[f64] {
        let base = BaseModel { model: &self.model, covering: self.covering };
        let now =
            Now { contact: Some(&self.pressed.contact), signal_mm: &self.signal_mm, ..moment.now(base) };
        self.counts.copy_from_slice(&self.signal_mm);
        for effect in &mut self.stages.element {
            effect.signal(now, &self.signal_mm, &mut self.counts);
        }
        self.model.respond(&mut self.counts);
        for effect in &self.stages.element {
            effect.counts(base, &mut self.counts);
        }
        for effect in &mut self.stages.readout {
            effect.counts(now, &mut self.counts);
        }
        &self.counts
    }

    /// Counts of the last moment, as [`Pipeline::step`] gave them; 0 before the first.
    pub fn counts(&self) -> &[f64] {
        &self.counts
    }

    /// The reading for `counts` plus `noise_counts`, a noise sample that the caller draws.
    pub fn read(&self, counts: f64, noise_counts: f64) -> f64 {
        let noisy = counts + noise_counts;
        self.readout
            .read(self.stages.readout.iter().fold(noisy, |counts, effect| effect.convert(counts)), 0.0)
    }

    /// The last contact, after the effects of motion and contact.
    pub fn contact(&self) -> &Contact {
        &self.pressed.contact
    }

    /// Clears the history of every effect, and the time.
    pub fn reset(&mut self) {
        let Stages { motion, contact: _, covering, element, readout, .. } = &mut self.stages;
        for effect in motion {
            effect.reset();
        }
        for effect in covering {
            effect.reset();
        }
        for effect in element {
            effect.reset();
        }
        for effect in readout {
            effect.reset();
        }
        self.last_s = None;
    }

    /// Computes contacts up to `depth_max_mm` deep by a [`PressTable`] of the tool from now on. Images are faster and have
    /// the table's accuracy; making it takes time. It is used wherever no effect changes the tool or the spread, until
    /// another covering is put in place.
    ///
    /// # Errors
    /// As [`PressTable::new`].
    pub fn use_press_table(&mut self, depth_max_mm: f64) -> Result<(), PressTableError> {
        self.table = Some(PressTable::new(&self.model, &self.indenter, self.covering, depth_max_mm)?);
        self.pressed.at = None;
        Ok(())
    }

    /// Uses a cache of images that is shared with other pipelines of the same array and the same reference press.
    pub fn share(&mut self, images: Arc<Images>) {
        self.images = Some(images);
    }

    /// Puts another covering in place.
    pub fn set_covering(&mut self, covering: Covering) {
        self.covering = covering;
        self.table = None;
        self.pressed.at = None;
    }

    /// Moves the covering's surface, robot frame.
    pub fn set_surface_mm(&mut self, surface_mm: f64) {
        self.surface_mm = surface_mm;
    }

    /// Multiplies the covering's response by `stiffness`; 1 at first.
    pub fn set_stiffness(&mut self, stiffness: f64) {
        self.stiffness = stiffness;
    }
}

impl Effect {
    /// True if a frame alone does not determine what it does: it depends on the time, or on the moments before.
    pub fn acts_in_time(&self) -> bool {
        Stages::of(slice::from_ref(self)).act_in_time()
    }
}

impl Stages {
    fn of(effects: &[Effect]) -> Self {
        let mut stages = Self::default();
        for effect in effects {
            let values = effect.values();
            let is_tabled = effect.tables().next().is_some();
            match effect.definition().make {
                Make::Motion(make) if is_tabled => stages.motion.push(Box::new(Tabled::of(make, values))),
                Make::Contact(make) if is_tabled => stages.contact.push(Box::new(Tabled::of(make, values))),
                Make::Covering(make) if is_tabled => stages.covering.push(Box::new(Tabled::of(make, values))),
                Make::Motion(make) => stages.motion.push(make(values)),
                Make::Contact(make) => stages.contact.push(make(values)),
                Make::Covering(make) => stages.covering.push(make(values)),
                Make::Element(make) => stages.element.push(make(values)),
                Make::Readout(make) => stages.readout.push(make(values)),
                Make::Draft(draft) => {
                    let drafted = Box::new(Drafted::of(draft, values));
                    match draft.stage() {
                        PipelineStage::Motion | PipelineStage::Contact => stages.motion.push(drafted),
                        PipelineStage::Covering => stages.covering.push(drafted),
                        PipelineStage::Element => stages.element.push(drafted),
                        PipelineStage::Readout => stages.readout.push(drafted),
                    }
                }
            }
        }
        stages.remember = stages.last_that_remembers();
        stages.press_is_timed = stages.contact.iter().any(|effect| effect.is_timed())
            || stages.covering.iter().any(|effect| effect.spreads() && effect.is_timed());
        stages
    }

    /// True if a moment alone does not determine what they do.
    fn act_in_time(&self) -> bool {
        let Self { motion, contact, covering, element, readout, remember, press_is_timed: _ } = self;
        remember.is_some()
            || motion.iter().any(|effect| effect.is_timed())
            || contact.iter().any(|effect| effect.is_timed())
            || covering.iter().any(|effect| effect.is_timed())
            || element.iter().any(|effect| effect.is_timed())
            || readout.iter().any(|effect| effect.is_timed())
    }

    fn last_that_remembers(&self) -> Option<PipelineStage> {
        let Self { motion, contact: _, covering, element, readout, .. } = self;
        let stages = [
            (PipelineStage::Readout, readout.iter().any(|effect| effect.remembers())),
            (PipelineStage::Element, element.iter().any(|effect| effect.remembers())),
            (PipelineStage::Covering, covering.iter().any(|effect| effect.remembers())),
            (PipelineStage::Motion, motion.iter().any(|effect| effect.remembers())),
        ];
        stages.into_iter().find(|(_, remembers)| *remembers).map(|(stage, _)| stage)
    }
}

impl Pressed {
    fn press(
        &mut self,
        tip: &TipState,
        indenter: &Indenter,
        now: Now<'_>,
        stages: &Stages,
        Ready { table, images }: Ready<'_>,
    ) {
        let base = now.base;
        let contact = tip.contact(indenter.clone());
        let t_s = stages.press_is_timed.then_some(now.t_s);
        let at = (contact.position_mm, contact.rotation_deg, contact.depth_mm, t_s);
        if self.at == Some(at) {
            return;
        }
        self.at = Some(at);
        self.contact = contact;
        let mut lean = [0.0; 2];
        for effect in &stages.contact {
            let [x, y] = effect.lean(now, &self.contact);
            effect.touch(now, &mut self.contact);
            lean = [lean[0] + x, lean[1] + y];
        }
        if lean.iter().any(|by| *by != 0.0) {
            self.contact.depth_mm += self.contact.indenter.lowered_mm(lean);
        }
        self.loads.clear();
        let (contact, sigma_mm) = (self.contact.clone(), [base.sigma_mm(); 2]);
        self.loads.push(Load { weight: 1.0, contact, lean, sigma_mm });
        for effect in &stages.covering {
            effect.spread(now, &mut self.loads);
        }
        self.reached_mm.fill(0.0);
        // A press table holds for the tool and the spread as declared.
        let table = table.filter(|_| stages.contact.is_empty());
        self.shares.resize_with(self.loads.len().max(self.shares.len()), Shares::default);
        let loads = self.loads.iter().zip(&mut self.shares);
        for (load, shares) in loads.filter(|(load, _)| load.contact.depth_mm > 0.0) {
            let tabulated = table.is_some_and(|table| load.tabulated(table, base, &mut self.of_one_mm));
            if !tabulated {
                let mut compute =
                    |load: &Load, image_mm: &mut [f64]| load.indentation(base, shares, image_mm);
                match images {
                    Some(images) => images.recall(base, load, &mut self.of_one_mm, &mut compute),
                    None => compute(load, &mut self.of_one_mm),
                }
            }
            for (reached, of_one) in self.reached_mm.iter_mut().zip(&self.of_one_mm) {
                *reached += load.weight * of_one;
            }
        }
    }
}

impl Load {
    /// As [`Load::indentation`], from a press table; false if the table does not hold for this load.
    fn tabulated(&self, table: &PressTable, base: BaseModel<'_>, indentation_mm: &mut [f64]) -> bool {
        let Contact { position_mm, rotation_deg, depth_mm, .. } = self.contact;
        let mut single_mm = vec![0.0_f32; indentation_mm.len()];
        let is_bases = self.sigma_mm.map(f64::to_bits) == [base.sigma_mm().to_bits(); 2];
        if !is_bases || table.indentation(position_mm, rotation_deg, depth_mm, &mut single_mm).is_err() {
            return false;
        }
        for (wide_mm, single_mm) in indentation_mm.iter_mut().zip(single_mm) {
            *wide_mm = f64::from(single_mm);
        }
        true
    }

    /// The signal of every element, in units of the base model's reference press; 0 for an impossible spread.
    fn indentation(&self, base: BaseModel<'_>, shares: &mut Shares, indentation_mm: &mut [f64]) {
        if self.sigma_mm.iter().all(|sigma_mm| *sigma_mm > 0.0) {
            base.model.indentation_again(self, base.covering, shares, indentation_mm);
        } else {
            indentation_mm.fill(0.0);
        }
    }
}

#[cfg(test)]
#[path = "pipeline_tests.rs"]
mod tests;
