//! Readout: slow, skewed, disturbed, coarse.

use std::collections::VecDeque;
use std::f64::consts::TAU;

use super::drift::normal;
use super::relaxation::{Branches, followed};
use super::{Definition, PipelineHook, shift};

pub(super) const SECOND_ORDER: Definition = Definition {
    id: "low-pass-second-order",
    effect: Some("low-pass"),
    is_library_point: false,
    about: "two poles, each dy/dt = (x - y)/T: a filter of second order, critically damped",
    is_fine: true,
    make: |knobs| {
        let time_s = knobs.scaled("time_constant_s", 0.03).max(1e-18);
        // About the baselines, where the branches begin.
        let baselines = knobs.baselines_counts();
        let mut poles = [Branches::new(vec![time_s]), Branches::new(vec![time_s])];
        PipelineHook::readout(move |now, counts| {
            counts.iter_mut().zip(&baselines).for_each(|(count, baseline)| *count -= baseline);
            if now.dt_s > 0.0 {
                for pole in &mut poles {
                    pole.follow(now.dt_s, counts);
                    counts
                        .iter_mut()
                        .enumerate()
                        .for_each(|(element, count)| *count = pole.at(element).sum());
                }
            }
            counts.iter_mut().zip(&baselines).for_each(|(count, baseline)| *count += baseline);
        })
    },
};

pub(super) const MOVING_AVERAGE: Definition = Definition {
    id: "low-pass-moving-average",
    effect: Some("low-pass"),
    is_library_point: false,
    about: "y(t) = mean of x over [t - T, t]: the converter integrates",
    is_fine: true,
    make: |knobs| {
        let window_s = knobs.scaled("window_s", 0.07);
        let mut past = ReadingHistory::default();
        PipelineHook::readout(move |now, counts| {
            past.push(now.t_s, counts, window_s);
            past.mean(now.t_s, window_s, counts);
        })
    },
};

pub(super) const UNEVEN: Definition = Definition {
    id: "low-pass-uneven",
    effect: Some("low-pass"),
    is_library_point: false,
    about: "dy_e/dt = (x_e - y_e)/T_e, T_e from 0.2 to 1.8 T: each element has a line of its own resistance",
    is_fine: true,
    make: |knobs| {
        let time_s = knobs.scaled("time_constant_s", 0.06).max(1e-18);
        let times_s: Vec<f64> = knobs.per_element(0.2, 1.8).iter().map(|share| share * time_s).collect();
        let mut settled: Option<[Vec<f64>; 2]> = None;
        PipelineHook::readout(move |now, counts| {
            let [last, values] = settled.get_or_insert_with(|| [counts.to_vec(), counts.to_vec()]);
            for (((count, last), value), time_s) in counts.iter_mut().zip(last).zip(values).zip(&times_s) {
                if now.dt_s > 0.0 {
                    *value = followed(*value, *last, *count, now.dt_s, *time_s);
                    *last = *count;
                }
                *count = *value;
            }
        })
    },
};

pub(super) const ROWS: Definition = Definition {
    id: "scan-rows",
    effect: Some("scan-skew"),
    is_library_point: true,
    about: "y_e(t) = x_e(t - S (R - 1 - row)/R): rows are sampled one after another, the last at the stamp",
    is_fine: true,
    make: |knobs| {
        let (rows, cols) = (knobs.sensor.model.array().rows(), knobs.sensor.model.array().cols());
        let scan_s = knobs.scaled("scan_s", 1.0 / knobs.sensor.model.array().rate_hz());
        let delays_s = (0..rows * cols).map(|e| scan_s * (rows - 1 - e / cols) as f64 / rows as f64);
        skewed(delays_s.collect())
    },
};

pub(super) const ELEMENTS: Definition = Definition {
    id: "scan-elements",
    effect: Some("scan-skew"),
    is_library_point: true,
    about: "y_e(t) = x_e(t - S (N - 1 - e)/N): one multiplexer goes through all elements, the last at the stamp",
    is_fine: true,
    make: |knobs| {
        let elements = knobs.elements();
        let scan_s = knobs.scaled("scan_s", 1.0 / knobs.sensor.model.array().rate_hz());
        let delays_s = (0..elements).map(|e| scan_s * (elements - 1 - e) as f64 / elements as f64);
        skewed(delays_s.collect())
    },
};

pub(super) const SINE: Definition = Definition {
    id: "hum-sine",
    effect: Some("periodic-interference"),
    is_library_point: false,
    about: "y = x + A w_e sin(2 pi f t + phase): the mains, folded to below 15 Hz",
    is_fine: false,
    make: |knobs| {
        let frequency_hz = knobs.between("frequency_hz", 0.7, 14.0);
        let phase = knobs.between("phase_rad", 0.0, TAU);
        let amplitude_counts = knobs.scaled("amplitude_counts", 3.0);
        let weights = knobs.per_element(0.6, 1.4);
        PipelineHook::readout(move |now, counts| {
            let tone = amplitude_counts * (TAU * frequency_hz * now.t_s + phase).sin();
            counts.iter_mut().zip(&weights).for_each(|(count, weight)| *count += weight * tone);
        })
    },
};

pub(super) const HARMONICS: Definition = Definition {
    id: "hum-harmonics",
    effect: Some("periodic-interference"),
    is_library_point: false,
    about: "y = x + A (sin p + h sin 2p), p = 2 pi f t + phase_row: a dimmed lamp, rows at different phases",
    is_fine: false,
    make: |knobs| {
        let frequency_hz = knobs.between("frequency_hz", 0.7, 6.5);
        let harmonic = knobs.between("harmonic", 0.2, 0.5);
        let step = knobs.between("phase_per_row_rad", 0.0, 0.5);
        let amplitude_counts = knobs.scaled("amplitude_counts", 3.0);
        let cols = knobs.sensor.model.array().cols();
        PipelineHook::readout(move |now, counts| {
            for (row, of_row) in counts.chunks_exact_mut(cols).enumerate() {
                let angle = TAU * frequency_hz * now.t_s + step * row as f64;
                let tone = amplitude_counts * (angle.sin() + harmonic * (2.0 * angle).sin());
                shift(of_row, tone);
            }
        })
    },
};

pub(super) const WANDERING: Definition = Definition {
    id: "hum-wandering",
    effect: Some("periodic-interference"),
    is_library_point: false,
    about: "y = x + A w_e sin(2 pi f t + W(t)), W a Wiener process: a motor nearby does not hold its speed",
    is_fine: false,
    make: |knobs| {
        let frequency_hz = knobs.between("frequency_hz", 0.7, 14.0);
        let rad_per_root_s = knobs.between("rad_per_root_s", 0.1, 0.4);
        let amplitude_counts = knobs.scaled("amplitude_counts", 4.0);
        let weights = knobs.per_element(0.6, 1.4);
        let (mut rng, mut phase) = (knobs.rng(), 0.0);
        PipelineHook::readout(move |now, counts| {
            phase += rad_per_root_s * now.dt_s.sqrt() * normal(&mut rng);
            let tone = amplitude_counts * (TAU * frequency_hz * now.t_s + phase).sin();
            counts.iter_mut().zip(&weights).for_each(|(count, weight)| *count += weight * tone);
        })
    },
};

pub(super) const COARSE_STEPS: Definition = Definition {
    id: "coarse-steps",
    effect: Some("quantisation"),
    is_library_point: true,
    about: "y = q round(x/q), q whole counts: the converter's low bits are lost",
    is_fine: false,
    make: |knobs| {
        let declared = knobs.sensor.model.array().step_counts();
        let steps = (16.0 * knobs.strength).round();
        knobs.keep("step_counts", steps * declared);
        PipelineHook::converter(move |count| {
            if steps > 1.0 { (count / (steps * declared)).round() * (steps * declared) } else { count }
        })
    },
};

/// Past readings, linear between steps: time, counts, and their integral since the first step.
#[derive(Debug, Default)]
struct ReadingHistory(VecDeque<(f64, Vec<f64>, Vec<f64>)>);

impl ReadingHistory {
    fn push(&mut self, t_s: f64, counts: &[f64], kept_s: f64) {
        let integral = match self.0.back() {
            Some((last_s, last, integral)) => {
                let piece = |(element, sum): (usize, &f64)| {
                    sum + (t_s - last_s) * f64::midpoint(last[element], counts[element])
                };
                integral.iter().enumerate().map(piece).collect()
            }
            None => vec![0.0; counts.len()],
        };
        self.0.push_back((t_s, counts.to_vec(), integral));
        while self.0.get(1).is_some_and(|(second_s, ..)| *second_s <= t_s - kept_s) {
            self.0.pop_front();
        }
    }

    /// Reading of an element at an earlier time; the earliest known one before that.
    fn at(&self, t_s: f64, element: usize) -> f64 {
        let after = self.after(t_s);
        let (after_s, later, _) = &self.0[after];
        if after == 0 {
            return later[element];
        }
        let (before_s, earlier, _) = &self.0[after - 1];
        earlier[element] + (later[element] - earlier[element]) * (t_s - before_s) / (after_s - before_s)
    }

    /// Writes the means over the last `window_s` into `means`.
    fn mean(&self, t_s: f64, window_s: f64, means: &mut [f64]) {
        let Some((_, _, until)) = self.0.back().filter(|_| window_s > 0.0) else { return };
        let from_s = t_s - window_s;
        let after = self.after(from_s);
        let (after_s, later, integral) = &self.0[after];
        for (element, mean) in means.iter_mut().enumerate() {
            let first_piece = (after_s - from_s) * f64::midpoint(self.at(from_s, element), later[element]);
            *mean = (until[element] - integral[element] + first_piece) / window_s;
        }
    }

    /// The first step at or after a time.
    fn after(&self, t_s: f64) -> usize {
        self.0.partition_point(|(at_s, ..)| *at_s < t_s).min(self.0.len() - 1)
    }
}

pub(super) fn skewed(delays_s: Vec<f64>) -> PipelineHook {
    let kept_s = delays_s.iter().copied().fold(0.0, f64::max);
    let mut past = ReadingHistory::default();
    PipelineHook::readout(move |now, counts| {
        past.push(now.t_s, counts, kept_s);
        for ((element, count), delay_s) in counts.iter_mut().enumerate().zip(&delays_s) {
            *count = past.at(now.t_s - delay_s, element);
        }
    })
}
