//! Element: faults that come and go.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::{Definition, Knobs, PipelineHook, left};

pub(super) const LOOSE_CONTACT: Definition = Definition {
    id: "loose-contact",
    effect: Some("miswired"),
    is_library_point: false,
    about: "s' = (1 - a) s of one element, now and then: its trace opens for some seconds (random telegraph)",
    is_fine: false,
    make: |knobs| {
        let element = knobs.which("element");
        let mut is_open = telegraph(knobs);
        let lost = knobs.share("lost", 1.0);
        PipelineHook::element(move |now, signal| {
            if is_open(now.dt_s) {
                signal[element] *= 1.0 - lost;
            }
        })
    },
};

pub(super) const FLICKERING_ADDRESS: Definition = Definition {
    id: "flickering-address",
    effect: Some("miswired"),
    is_library_point: false,
    about: "s_e' = (1 - a) s_e + a s_n, now and then: a line of the multiplexer's address is loose",
    is_fine: false,
    make: |knobs| {
        let element = knobs.which("element");
        let (_, cols) = knobs.grid();
        let beside = if element % cols + 1 < cols { element + 1 } else { element - 1 };
        let mut is_off = telegraph(knobs);
        let swapped = knobs.share("swapped", 1.0);
        PipelineHook::element(move |now, signal| {
            if is_off(now.dt_s) {
                signal[element] += swapped * (signal[beside] - signal[element]);
            }
        })
    },
};

pub(super) const OPENS_WHEN_PRESSED: Definition = Definition {
    id: "opens-when-pressed",
    effect: Some("miswired"),
    is_library_point: false,
    about: "s' = (1 - a) s of one element where s > S: a crack in its trace opens under load",
    is_fine: false,
    make: |knobs| {
        let element = knobs.which("element");
        let limit_counts = knobs.between("limit_counts", 40.0, 120.0);
        let lost = knobs.share("lost", 1.0);
        PipelineHook::element(move |_, signal| {
            if signal[element] > limit_counts {
                signal[element] *= 1.0 - lost;
            }
        })
    },
};

/// A random telegraph: tells after each step of time whether it is on. It begins off.
pub(super) fn telegraph(knobs: &mut Knobs<'_>) -> impl FnMut(f64) -> bool + Send + use<> {
    let times_s = [knobs.decade("mean_off_s", 3.0, 10.0), knobs.decade("mean_on_s", 1.0, 4.0)];
    let mut rng: ChaCha8Rng = knobs.rng();
    let mut is_on = false;
    move |dt_s| {
        if rng.random::<f64>() > left(dt_s, times_s[usize::from(is_on)]) {
            is_on = !is_on;
        }
        is_on
    }
}
