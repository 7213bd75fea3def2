//! The traits of the stages: what an effect receives and what it may change.

use std::fmt::Debug;

use crate::{Contact, Covering, ForwardModel, Indenter, Registration};

/// The base model with the covering in place.
#[derive(Debug, Clone, Copy)]
pub struct BaseModel<'a> {
    /// The base model.
    pub model: &'a ForwardModel,
    /// The covering in place.
    pub covering: Covering,
}

/// An instant, for effects that depend on time.
#[derive(Debug, Clone, Copy)]
pub struct Now<'a> {
    /// Time since the start, in s.
    pub t_s: f64,
    /// Time since the moment before, in s; 0 at the first, and never negative.
    pub dt_s: f64,
    /// Temperature of the sensor, where it is known.
    pub temperature_c: Option<f64>,
    /// The base model and the covering.
    pub base: BaseModel<'a>,
    /// The contact, after the effects of motion and contact; `None` before it is known.
    pub contact: Option<&'a Contact>,
    /// Signals that reach the elements, in mm, after the effects of the covering; empty before they are known.
    pub signal_mm: &'a [f64],
}

/// Position of the tip, registration of the sensor and height of the surface; all in the robot frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TipState {
    /// Position of the tip.
    pub tip_mm: [f64; 3],
    /// Registration of the sensor.
    pub registration: Registration,
    /// Height of the covering's surface under the tip.
    pub surface_mm: f64,
}

/// A contact and how the covering spreads it; what the elements measure is the weighted sum of all loads.
///
/// The spread conserves volume: a load with another width has the same volume.
#[derive(Debug, Clone, PartialEq)]
pub struct Load {
    /// Weight in the sum.
    pub weight: f64,
    /// The tool in the covering.
    pub contact: Contact,
    /// Lean of the tool's face, as in [`OnContact::lean`].
    pub lean: [f64; 2],
    /// Standard deviations of its Gaussian along the sensor's x and y.
    pub sigma_mm: [f64; 2],
}

/// An effect between the reported position of the stage and the contact.
pub trait OnMotion: Debug + Send + Sync {
    /// The instant whose place on the path counts at `t_s`.
    fn instant_s(&self, t_s: f64) -> f64 {
        t_s
    }

    /// Changes the position of the tip, the registration or the surface.
    fn place(&mut self, _now: Now<'_>, _tip: &mut TipState) {}

    /// True if what it does depends on the time.
    fn is_timed(&self) -> bool {
        false
    }

    /// True if what it does depends on the moments before.
    fn remembers(&self) -> bool {
        false
    }

    /// Forgets the past.
    fn reset(&mut self) {}
}

/// An effect on the tool and how it stands; without memory.
pub trait OnContact: Debug + Send + Sync {
    /// Changes the contact.
    fn touch(&self, _now: Now<'_>, _contact: &mut Contact) {}

    /// Lean of the tool about the foot of its axis: the increase of a flat face's depth per mm along the tool's own x and
    /// y, for the contact before [`OnContact::touch`]. A [`Contact`] is always upright, so the lean is separate. The leans of several effects
    /// add.
    fn lean(&self, _now: Now<'_>, _contact: &Contact) -> [f64; 2] {
        [0.0; 2]
    }

    /// True if what it does depends on the time.
    fn is_timed(&self) -> bool {
        false
    }
}

/// An effect of the covering.
pub trait OnCovering: Debug + Send + Sync {
    /// Changes how the loads spread, before the elements integrate them; without memory. The list starts with one load
    /// of weight 1 with the base model's spread, the same along x and y.
    fn spread(&self, _now: Now<'_>, _loads: &mut Vec<Load>) {}

    /// True if it changes how the loads spread.
    fn spreads(&self) -> bool {
        false
    }

    /// Changes the signal that reaches the elements: equivalent indentations in mm, row-major.
    fn signal(&mut self, _now: Now<'_>, _contact: &Contact, _signal_mm: &mut [f64]) {}

    /// True if what it does depends on the time.
    fn is_timed(&self) -> bool {
        false
    }

    /// True if what it does depends on the moments before.
    fn remembers(&self) -> bool {
        false
    }

    /// Forgets the past.
    fn reset(&mut self) {}
}

/// An effect in the elements.
pub trait OnElement: Debug + Send + Sync {
    /// Changes the elements' signals before their response: equivalent indentations in mm, row-major.
    /// `input_mm` is the signal that reached each element, before any effect of this stage.
    fn signal(&mut self, _now: Now<'_>, _input_mm: &[f64], _signal_mm: &mut [f64]) {}

    /// Changes counts after the response.
    fn counts(&self, _base: BaseModel<'_>, _counts: &mut [f64]) {}

    /// True if what it does depends on the time.
    fn is_timed(&self) -> bool {
        false
    }

    /// True if what it does depends on the moments before.
    fn remembers(&self) -> bool {
        false
    }

    /// Forgets the past.
    fn reset(&mut self) {}
}

/// An effect in the readout.
pub trait OnReadout: Debug + Send + Sync {
    /// Changes counts, row-major, before noise is added.
    fn counts(&mut self, _now: Now<'_>, _counts: &mut [f64]) {}

    /// Changes a noisy reading before the converter.
    fn convert(&self, counts: f64) -> f64 {
        counts
    }

    /// True if what it does depends on the time.
    fn is_timed(&self) -> bool {
        false
    }

    /// True if what it does depends on the moments before.
    fn remembers(&self) -> bool {
        false
    }

    /// Forgets the past.
    fn reset(&mut self) {}
}

impl BaseModel<'_> {
    /// The base model's spread under the covering in place.
    pub fn sigma_mm(&self) -> f64 {
        self.model.psf().sigma_mm(self.covering)
    }
}

impl TipState {
    /// The tip in the sensor's plane.
    pub fn position_mm(&self) -> [f64; 2] {
        let [x_mm, y_mm, _] = self.tip_mm;
        self.registration.to_sensor([x_mm, y_mm])
    }

    /// The contact of a tool at this state.
    pub fn contact(&self, indenter: Indenter) -> Contact {
        let [_, _, z_mm] = self.tip_mm;
        Contact {
            indenter,
            position_mm: self.position_mm(),
            // The tool's sides run along the robot's axes.
            rotation_deg: -self.registration.rotation_deg,
            depth_mm: self.surface_mm - z_mm,
        }
    }
}
