//! A cache of computed images.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use crate::effect::{BaseModel, Load};
use crate::{Contact, Indenter};

/// A cache of images, shared by [`Pipeline`](crate::Pipeline)s with the same array and reference press that follow the
/// same path with different effects. Most effects do not change the contact and its spread, so these images recur.
///
/// The image of an upright tool with a flat face is proportional to its depth: one image serves all depths and agrees
/// with the computed one to rounding. That of one that leans grows in proportion from the depth on at which its whole face touches, so that two
/// images serve all depths from there. Other images are equal to the computed ones to the bit. Meshes are not cached.
#[derive(Debug)]
pub struct Images {
    held: Mutex<HashMap<Key, Arc<[f64]>>>,
    most: usize,
}

/// Everything that an image depends on, bit by bit.
type Key = [u64; 14];

impl Images {
    /// A cache of at most this many images. It is cleared when full.
    pub fn new(most: usize) -> Self {
        Self { held: Mutex::new(HashMap::new()), most }
    }

    /// The image of a load, from the cache or by `compute`.
    pub(crate) fn recall(
        &self,
        base: BaseModel<'_>,
        press: &Load,
        image_mm: &mut [f64],
        compute: &mut impl FnMut(&Load, &mut [f64]),
    ) {
        let thickness_mm = base.covering.thickness_mm;
        let depth_mm = press.contact.depth_mm;
        if !is_even(press) {
            let whole_mm = press.contact.whole_from_mm(press.lean);
            let Some(whole_mm) = whole_mm.filter(|whole_mm| (*whole_mm..=thickness_mm).contains(&depth_mm))
            else {
                return self.recall_as_it_is(base, press, image_mm, compute);
            };
            let at = |depth_mm: f64, lean| {
                let contact = Contact { depth_mm, ..press.contact.clone() };
                Load { contact, lean, ..press.clone() }
            };
            self.recall(base, &at(depth_mm - whole_mm, [0.0; 2]), image_mm, compute);
            let mut leaning_mm = vec![0.0; image_mm.len()];
            self.recall_as_it_is(base, &at(whole_mm, press.lean), &mut leaning_mm, compute);
            image_mm.iter_mut().zip(leaning_mm).for_each(|(even, leaning)| *even += leaning);
            return;
        }
        let contact = Contact { depth_mm: thickness_mm, ..press.contact.clone() };
        let deepest = Load { contact, ..press.clone() };
        self.recall_as_it_is(base, &deepest, image_mm, compute);
        let share = press.contact.depth_mm.min(thickness_mm) / thickness_mm;
        for of_element in image_mm {
            *of_element *= share;
        }
    }

    fn recall_as_it_is(
        &self,
        base: BaseModel<'_>,
        press: &Load,
        image_mm: &mut [f64],
        compute: &mut impl FnMut(&Load, &mut [f64]),
    ) {
        let Some(key) = key(base, press) else { return compute(press, image_mm) };
        let known = self.held.lock().unwrap_or_else(PoisonError::into_inner).get(&key).cloned();
        if let Some(known) = known.filter(|known| known.len() == image_mm.len()) {
            image_mm.copy_from_slice(&known);
            return;
        }
        compute(press, image_mm);
        let mut held = self.held.lock().unwrap_or_else(PoisonError::into_inner);
        if held.len() >= self.most {
            held.clear();
        }
        held.insert(key, Arc::from(&*image_mm));
    }
}

/// True if the penetration is uniform over the tool's face. The image is then proportional to it, up to the covering's
/// thickness.
fn is_even(press: &Load) -> bool {
    press.contact.indenter.is_flat() && press.lean.iter().all(|by| *by == 0.0)
}

fn key(base: BaseModel<'_>, press: &Load) -> Option<Key> {
    let Load { weight: _, contact, lean, sigma_mm } = press;
    let Contact { indenter, position_mm: [x, y], rotation_deg, depth_mm } = contact;
    let (shape, [size, other]) = match indenter {
        Indenter::Cylinder { diameter_mm } => (0, [*diameter_mm, 0.0]),
        Indenter::Sphere { diameter_mm } => (1, [*diameter_mm, 0.0]),
        Indenter::Cone { diameter_mm, apex_deg } => (2, [*diameter_mm, *apex_deg]),
        Indenter::Box { size_mm } => (3, *size_mm),
        Indenter::Mesh(_) => return None,
    };
    let psf = base.model.psf();
    let numbers = [
        size,
        other,
        *x,
        *y,
        *rotation_deg,
        *depth_mm,
        lean[0],
        lean[1],
        sigma_mm[0],
        sigma_mm[1],
        psf.sigma_intercept_mm,
        psf.sigma_per_mm,
        base.covering.thickness_mm,
    ];
    let mut key = [shape; 14];
    for (bits, number) in key[1..].iter_mut().zip(numbers) {
        *bits = number.to_bits();
    }
    Some(key)
}
