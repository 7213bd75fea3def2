//! Covering: response that depends on the speed of loading.

use super::{Definition, Now, PipelineHook};

pub(super) const POWER: Definition = Definition {
    id: "rate-power",
    effect: Some("rate-stiffening"),
    is_library_point: false,
    about: "u' = u (1 + a (v/v0)^n) while going in, v0 = 1 mm/s: a power-law dashpot beside the spring (Cowper-Symonds)",
    is_fine: false,
    make: |knobs| {
        let exponent = knobs.between("exponent", 0.25, 0.6);
        let share = knobs.scaled("share_at_1_mm_per_s", 0.12);
        PipelineHook::depth(move |now, depth_mm| {
            depth_mm * (1.0 + share * inward_mm_per_s(now).powf(exponent))
        })
    },
};

pub(super) const LOGARITHMIC: Definition = Definition {
    id: "rate-logarithmic",
    effect: Some("rate-stiffening"),
    is_library_point: true,
    about: "u' = u (1 + a ln(1 + v/v0)), v the speed at which this depth was reached: Johnson-Cook's rate law",
    is_fine: false,
    make: |knobs| {
        let scale_mm_per_s = knobs.decade("scale_mm_per_s", 0.05, 0.5);
        let share = knobs.scaled("share", 0.05);
        let mut loading = Loading::default();
        PipelineHook::depth(move |now, depth_mm| {
            let loaded_mm_per_s = loading.mm_per_s(now, depth_mm);
            depth_mm * (1.0 + share * (loaded_mm_per_s / scale_mm_per_s).ln_1p())
        })
    },
};

pub(super) const EYRING: Definition = Definition {
    id: "rate-eyring",
    effect: Some("rate-stiffening"),
    is_library_point: false,
    about: "u' = u (1 + a asinh(v/v0)) while going in: thermally activated flow (Eyring 1936)",
    is_fine: false,
    make: |knobs| {
        let scale_mm_per_s = knobs.decade("scale_mm_per_s", 0.1, 1.0);
        let share = knobs.scaled("share", 0.06);
        PipelineHook::depth(move |now, depth_mm| {
            depth_mm * (1.0 + share * (inward_mm_per_s(now) / scale_mm_per_s).asinh())
        })
    },
};

pub(super) const SATURATING: Definition = Definition {
    id: "rate-saturating",
    effect: Some("rate-stiffening"),
    is_library_point: false,
    about: "u' = u (1 + a v/(v + v0)), v the speed at which this depth was reached: fast loading is all glassy, slow all rubbery",
    is_fine: false,
    make: |knobs| {
        let scale_mm_per_s = knobs.decade("scale_mm_per_s", 0.3, 2.0);
        let share = knobs.scaled("share", 0.15);
        let mut loading = Loading::default();
        PipelineHook::depth(move |now, depth_mm| {
            let loaded_mm_per_s = loading.mm_per_s(now, depth_mm);
            depth_mm * (1.0 + share * loaded_mm_per_s / (loaded_mm_per_s + scale_mm_per_s))
        })
    },
};

/// The speed at which the tip goes into the covering; 0 while it rests or goes out.
fn inward_mm_per_s(now: &Now) -> f64 {
    (-now.velocity_mm_per_s[2]).max(0.0)
}

/// The speed of the present contact's last loading.
#[derive(Default)]
struct Loading {
    last_mm_per_s: f64,
}

impl Loading {
    fn mm_per_s(&mut self, now: &Now, depth_mm: f64) -> f64 {
        let inward_mm_per_s = inward_mm_per_s(now);
        if depth_mm <= 0.0 {
            self.last_mm_per_s = 0.0;
        } else if inward_mm_per_s > 0.0 {
            self.last_mm_per_s = inward_mm_per_s;
        }
        self.last_mm_per_s
    }
}
