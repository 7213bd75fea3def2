//! Covering: loading and unloading differ, whatever the speed.

use super::motion::play;
use super::{Definition, PipelineHook, left};

pub(super) const PRANDTL_ISHLINSKII: Definition = Definition {
    id: "hysteresis-prandtl-ishlinskii",
    effect: Some("hysteresis"),
    is_library_point: false,
    about: "depth' = depth + sum p_i (depth - F_i[depth]), F_i plays of several widths: sliders in parallel (Iwan 1966)",
    is_fine: false,
    make: |knobs| {
        let widths_mm = [
            knobs.between("width_1_mm", 0.01, 0.03),
            knobs.between("width_2_mm", 0.03, 0.08),
            knobs.between("width_3_mm", 0.08, 0.15),
        ];
        let weight = knobs.scaled("weight", 0.15);
        let mut plays_mm = [0.0; 3];
        PipelineHook::depth(move |_, depth_mm| {
            if depth_mm <= 0.0 {
                plays_mm = [0.0; 3];
                return 0.0;
            }
            for (value, width_mm) in plays_mm.iter_mut().zip(widths_mm) {
                *value = play(*value, depth_mm, width_mm);
            }
            depth_mm + plays_mm.iter().map(|value| weight * (depth_mm - value)).sum::<f64>()
        })
    },
};

pub(super) const PREISACH: Definition = Definition {
    id: "hysteresis-preisach",
    effect: Some("hysteresis"),
    is_library_point: false,
    about: "depth' = depth - w t (f - mean branch), f = sum of Everett integrals of relays of density exp(-(a-b)/k) (Mayergoyz 1986)",
    is_fine: false,
    make: |knobs| {
        let kappa = knobs.between("relay_width", 0.05, 0.25);
        let weight = knobs.scaled("weight", 0.25);
        let thickness_mm = knobs.sensor.covering.thickness_mm;
        let mut memory = Preisach::new(kappa);
        PipelineHook::depth(move |_, depth_mm| {
            let share = (depth_mm / thickness_mm).clamp(0.0, 1.0);
            let loop_share = memory.follow(share) - memory.mean_branch(share);
            depth_mm - weight * thickness_mm * loop_share
        })
    },
};

pub(super) const BOUC_WEN: Definition = Definition {
    id: "hysteresis-bouc-wen",
    effect: Some("hysteresis"),
    is_library_point: false,
    about: "dz = dx - (b |dx| z + g dx |z|), depth' = depth + w z: Bouc-Wen (Wen 1976), n = 1, A = 1",
    is_fine: false,
    make: |knobs| {
        let limit_mm = knobs.between("limit_mm", 0.03, 0.1);
        let pinch = knobs.between("pinch", 0.5, 0.9);
        let weight = knobs.scaled("weight", 0.4);
        let [b, g] = [pinch / limit_mm, (1.0 - pinch) / limit_mm];
        let (mut z_mm, mut last_mm) = (0.0_f64, 0.0);
        PipelineHook::depth(move |_, depth_mm| {
            if depth_mm <= 0.0 {
                (z_mm, last_mm) = (0.0, 0.0);
                return 0.0;
            }
            let dx = (depth_mm - last_mm) / f64::from(SMALL_STEPS);
            for _ in 0..SMALL_STEPS {
                z_mm += dx - (b * dx.abs() * z_mm + g * dx * z_mm.abs());
            }
            last_mm = depth_mm;
            depth_mm + weight * z_mm
        })
    },
};

/// Bouc-Wen's law is integrated in this many steps of depth; it does not depend on time.
const SMALL_STEPS: u32 = 16;

/// Relays in `[0, 1]`, switching on above `a` and off below `b <= a`, as many as `exp(-(a - b)/kappa)`; all on is 1.
///
/// Its memory is the list of turning points that no greater excursion has wiped out.
#[derive(Debug)]
pub(super) struct Preisach {
    kappa: f64,
    /// Alternating: the greatest, the least after it, the greatest after that...
    turns: Vec<f64>,
    input: f64,
}

impl Preisach {
    pub(super) fn new(kappa: f64) -> Self {
        Self { kappa, turns: Vec::new(), input: 0.0 }
    }

    /// Goes on to an input and gives the share of relays that are on.
    pub(super) fn follow(&mut self, input: f64) -> f64 {
        let is_rising_now = self.turns.len().is_multiple_of(2);
        if (input > self.input && !is_rising_now) || (input < self.input && is_rising_now) {
            self.turns.push(self.input);
        }
        self.input = input;
        // An excursion beyond the turn before last wipes both out.
        loop {
            let is_rising = self.turns.len().is_multiple_of(2);
            let outdone = match self.turns.len() {
                0 => false,
                1 => input <= 0.0,
                count if is_rising => input >= self.turns[count - 2],
                count => input <= self.turns[count - 2],
            };
            if !outdone {
                break;
            }
            self.turns.truncate(self.turns.len().saturating_sub(2));
        }
        self.on()
    }

    /// Middle of the outermost loop's two branches at an input.
    pub(super) fn mean_branch(&self, input: f64) -> f64 {
        let rising = self.between(0.0, input);
        let falling = self.between(0.0, 1.0) - self.between(input, 1.0);
        f64::midpoint(rising, falling) / self.between(0.0, 1.0)
    }

    fn on(&self) -> f64 {
        let (mut sum, mut from, mut sign) = (0.0, 0.0_f64, 1.0);
        for &turn in self.turns.iter().chain([&self.input]) {
            sum += sign * self.between(from.min(turn), from.max(turn));
            (from, sign) = (turn, -sign);
        }
        sum / self.between(0.0, 1.0)
    }

    /// The Everett integral: relays with both thresholds between two inputs.
    fn between(&self, least: f64, greatest: f64) -> f64 {
        let (apart, kappa) = (greatest - least, self.kappa);
        kappa * apart - kappa * kappa * (1.0 - left(apart, kappa))
    }
}
