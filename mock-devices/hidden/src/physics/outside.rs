//! Physics that the effect library has nothing like: what discovery is to call unexplained.

use std::f64::consts::TAU;

use super::{Definition, Knobs, Now, PipelineHook, dot, left, minus, scale};

pub(super) const SUPPLY_DROOP: Definition = Definition {
    id: "supply-droop",
    effect: None,
    is_library_point: false,
    about: "s' = s (1 - a (sum of s / S)^2): one supply feeds all elements and sags when many signals are high",
    is_fine: false,
    make: |knobs| {
        let droop = knobs.scaled("droop", 0.06);
        let scale_counts = knobs.between("scale_counts", 5000.0, 9000.0);
        PipelineHook::element(move |_, signal| {
            let by = (1.0 - droop * (signal.iter().sum::<f64>() / scale_counts).powi(2)).max(0.0);
            scale(signal, by);
        })
    },
};

pub(super) const DRAGGED_SPREAD: Definition = Definition {
    id: "dragged-spread",
    effect: None,
    is_library_point: false,
    about: "u' = u (1 + a (q^3 - 3 q)), q = n . (p_e - p)/sigma, n the last lateral travel: a skew without a shift (Hermite H3)",
    is_fine: false,
    make: |knobs| {
        let skew = knobs.scaled("skew", 0.02);
        let sigma_mm = knobs.sigma_mm();
        let centres_mm = knobs.centres_mm();
        let mut travel = [0.0; 2];
        PipelineHook::covering(move |now, indentation_mm| {
            let [vx, vy, _] = now.velocity_mm_per_s;
            if vx.hypot(vy) > 0.1 {
                travel = [vx / vx.hypot(vy), vy / vx.hypot(vy)];
            }
            for (value, centre_mm) in indentation_mm.iter_mut().zip(&centres_mm) {
                let q = dot(travel, minus(*centre_mm, now.touch.point_mm)) / sigma_mm;
                *value *= 1.0 + skew * (q * q * q - 3.0 * q).clamp(-10.0, 10.0);
            }
        })
    },
};

pub(super) const STICK_SLIP: Definition = Definition {
    id: "stick-slip",
    effect: None,
    is_library_point: false,
    about: "depth' = depth + a saw(travel/L): the tool's rim sticks to the covering and slips once every L of travel",
    is_fine: false,
    make: |knobs| {
        let length_mm = knobs.between("length_mm", 0.05, 0.11);
        let slip_mm = knobs.scaled("slip_mm", 0.03);
        let (mut travel_mm, mut last_mm) = (0.0, 0.0_f64);
        PipelineHook::depth(move |_, depth_mm| {
            travel_mm += (depth_mm - last_mm).abs();
            last_mm = depth_mm;
            let phase = (travel_mm / length_mm).fract();
            depth_mm + slip_mm * (phase - 0.5) * (depth_mm / length_mm).min(1.0)
        })
    },
};

pub(super) const ADHESION: Definition = Definition {
    id: "adhesion",
    effect: None,
    is_library_point: false,
    about: "u' = -a G(p_e - p) (1 - h/H) for heights h < H on the way up: the covering clings to the tool and is pulled",
    is_fine: false,
    make: |knobs| {
        let reach_mm = knobs.between("reach_mm", 0.5, 1.2);
        let pull_mm = knobs.scaled("pull_mm", 0.04);
        let bump = bump(knobs);
        let mut clings = false;
        PipelineHook::covering(move |now, indentation_mm| {
            let height_mm = -now.touch.depth_mm;
            clings = height_mm < 0.0 || (clings && height_mm < reach_mm && now.velocity_mm_per_s[2] >= 0.0);
            if clings && height_mm >= 0.0 {
                bump(now, -pull_mm * (1.0 - height_mm / reach_mm), indentation_mm);
            }
        })
    },
};

pub(super) const CONVERTER_RIPPLE: Definition = Definition {
    id: "converter-ripple",
    effect: None,
    is_library_point: false,
    about: "y = x + a sin(2 pi x/P): the converter's differential nonlinearity repeats every P counts",
    is_fine: false,
    make: |knobs| {
        let period_counts = knobs.between("period_counts", 40.0, 140.0);
        let amplitude_counts = knobs.scaled("amplitude_counts", 3.0);
        PipelineHook::converter(move |count| count + amplitude_counts * (TAU * count / period_counts).sin())
    },
};

pub(super) const RINGING: Definition = Definition {
    id: "ringing",
    effect: None,
    is_library_point: false,
    about: "depth' = depth + a v exp(-t/T) sin(2 pi f t) since the last stop: the column swings after every move",
    is_fine: true,
    make: |knobs| {
        let frequency_hz = knobs.between("frequency_hz", 3.0, 9.0);
        let time_s = knobs.between("time_constant_s", 0.2, 0.6);
        let swing_s = knobs.scaled("swing_s", 0.02);
        let (mut last_mm_per_s, mut since_s, mut struck_mm) = (0.0_f64, 0.0, 0.0);
        PipelineHook::depth(move |now, depth_mm| {
            let speed_mm_per_s = now.velocity_mm_per_s[2];
            since_s += now.dt_s;
            if speed_mm_per_s == 0.0 && last_mm_per_s != 0.0 {
                (since_s, struck_mm) = (0.0, swing_s * last_mm_per_s.clamp(-1.0, 1.0));
            }
            last_mm_per_s = speed_mm_per_s;
            if speed_mm_per_s != 0.0 || depth_mm <= 0.0 {
                return depth_mm;
            }
            depth_mm - struck_mm * left(since_s, time_s) * (TAU * frequency_hz * since_s).sin()
        })
    },
};

pub(super) const STAGE_PICKUP: Definition = Definition {
    id: "stage-pickup",
    effect: None,
    is_library_point: false,
    about: "y = x + a w_e |v|/10 mm/s, in contact or not: the motors' currents couple into the array while the stage moves",
    is_fine: false,
    make: |knobs| {
        let counts = knobs.scaled("counts_at_10_mm_per_s", 6.0);
        let weights = knobs.per_element(-0.5, 1.5);
        PipelineHook::readout(move |now, readings| {
            let speed = now.velocity_mm_per_s.map(|v| v * v).iter().sum::<f64>().sqrt() / 10.0;
            readings.iter_mut().zip(&weights).for_each(|(count, weight)| *count += counts * weight * speed);
        })
    },
};

pub(super) const PROXIMITY: Definition = Definition {
    id: "proximity",
    effect: None,
    is_library_point: false,
    about: "u' = u + a G(p_e - p) exp(-h/H) at heights h > 0: a metal tool changes the capacitance before it touches",
    is_fine: false,
    make: |knobs| {
        let scale_mm = knobs.between("scale_mm", 0.3, 1.0);
        let near_mm = knobs.scaled("near_mm", 0.03);
        let bump = bump(knobs);
        PipelineHook::covering(move |now, indentation_mm| {
            bump(now, near_mm * left((-now.touch.depth_mm).max(0.0), scale_mm), indentation_mm);
        })
    },
};

pub(super) const GROUNDING: Definition = Definition {
    id: "grounding",
    effect: None,
    is_library_point: false,
    about: "y = x + a w_e while the tool touches, whatever its depth and place: touching grounds the shield",
    is_fine: false,
    make: |knobs| {
        let shift_counts = knobs.sign("side") * knobs.scaled("shift_counts", 8.0);
        let weights = knobs.per_element(0.7, 1.3);
        PipelineHook::readout(move |now, counts| {
            if now.touch.depth_mm > 0.0 {
                counts.iter_mut().zip(&weights).for_each(|(count, weight)| *count += shift_counts * weight);
            }
        })
    },
};

pub(super) const ELECTRODE_TEXTURE: Definition = Definition {
    id: "electrode-texture",
    effect: None,
    is_library_point: false,
    about: "u' = u (1 + a cos(2 pi x/L) cos(2 pi y/L)): a woven fabric in the covering, finer than the elements",
    is_fine: false,
    make: |knobs| {
        let length_mm = knobs.between("length_mm", 1.1, 1.7);
        let phase = knobs.between("phase_rad", 0.0, TAU);
        let contrast = knobs.scaled("contrast", 0.12);
        PipelineHook::depth(move |now, depth_mm| {
            let [x, y] = now.touch.point_mm.map(|at_mm| (TAU * at_mm / length_mm + phase).cos());
            depth_mm * (1.0 + contrast * x * y)
        })
    },
};

pub(super) const BULGE: Definition = Definition {
    id: "bulge",
    effect: None,
    is_library_point: false,
    about: "u' = u - a depth exp(-((r - r0)/w)^2): an incompressible covering rises in a ring about the tool, which lifts off the elements there",
    is_fine: false,
    make: |knobs| {
        let radius_mm = knobs.between("radius_mm", 4.0, 5.5);
        let width_mm = knobs.between("width_mm", 0.8, 1.5);
        let lift = knobs.scaled("lift", 0.06);
        let centres_mm = knobs.centres_mm();
        PipelineHook::covering(move |now, indentation_mm| {
            let depth_mm = now.touch.depth_mm.max(0.0);
            for (value, centre_mm) in indentation_mm.iter_mut().zip(&centres_mm) {
                let [x, y] = minus(*centre_mm, now.touch.point_mm);
                *value -= lift * depth_mm * (-((x.hypot(y) - radius_mm) / width_mm).powi(2)).exp();
            }
        })
    },
};

/// Adds a Gaussian of a height in mm about the tool's place.
fn bump(knobs: &Knobs<'_>) -> impl Fn(&Now, f64, &mut [f64]) + Send + use<> {
    let centres_mm = knobs.centres_mm();
    let sigma_mm = knobs.sigma_mm();
    move |now, height_mm, indentation_mm| {
        for (value, centre_mm) in indentation_mm.iter_mut().zip(&centres_mm) {
            let away_mm = minus(*centre_mm, now.touch.point_mm);
            *value += height_mm * (-dot(away_mm, away_mm) / (2.0 * sigma_mm * sigma_mm)).exp();
        }
    }
}
