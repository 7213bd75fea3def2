//! Element: wiring and amplifiers, on the signal above the baseline.

use super::{Definition, PipelineHook, minus};

pub(super) const LADDER: Definition = Definition {
    id: "crosstalk-ladder",
    effect: Some("crosstalk"),
    is_library_point: false,
    about: "s' = s + sum over the row of s_k r^|k - c|: each row is a resistive ladder that leaks from column to column",
    is_fine: false,
    make: |knobs| {
        let leak = knobs.scaled("leak", 0.05).min(0.9);
        let cols = knobs.sensor.model.array().cols();
        let reaches: Vec<f64> = (0..cols).map(|apart| leak.powf(apart as f64)).collect();
        PipelineHook::element(move |_, signal| {
            for row in signal.chunks_exact_mut(cols) {
                let clean = row.to_vec();
                for (col, value) in row.iter_mut().enumerate() {
                    let others = clean.iter().enumerate().filter(|(other, _)| *other != col);
                    *value += others.map(|(other, s)| s * reaches[other.abs_diff(col)]).sum::<f64>();
                }
            }
        })
    },
};

pub(super) const NEIGHBOURS: Definition = Definition {
    id: "crosstalk-neighbours",
    effect: Some("crosstalk"),
    is_library_point: true,
    about: "s' = s + c (sum of the four beside + d of the four across corners): stray capacitance between electrodes",
    is_fine: false,
    make: |knobs| {
        let across = knobs.between("across_corners", 0.2, 0.6);
        let share = knobs.scaled("share", 0.03);
        let (rows, cols) = knobs.grid();
        PipelineHook::element(move |_, signal| {
            let clean = signal.to_vec();
            for (element, value) in signal.iter_mut().enumerate() {
                let (row, col) = (element / cols, element % cols);
                for near_row in row.saturating_sub(1)..=(row + 1).min(rows - 1) {
                    for near_col in col.saturating_sub(1)..=(col + 1).min(cols - 1) {
                        let weight = match near_row.abs_diff(row) + near_col.abs_diff(col) {
                            0 => 0.0,
                            1 => share,
                            _ => share * across,
                        };
                        *value += weight * clean[near_row * cols + near_col];
                    }
                }
            }
        })
    },
};

pub(super) const COLUMN_SUM: Definition = Definition {
    id: "crosstalk-column",
    effect: Some("crosstalk"),
    is_library_point: true,
    about: "s' = s + c sum of the column's others: the sense amplifier's finite gain, shared by a column",
    is_fine: false,
    make: |knobs| {
        let share = knobs.scaled("share", 0.03);
        let (_, cols) = knobs.grid();
        PipelineHook::element(move |_, signal| {
            let mut sums = vec![0.0; cols];
            for row in signal.chunks_exact(cols) {
                row.iter().zip(&mut sums).for_each(|(value, sum)| *sum += value);
            }
            for row in signal.chunks_exact_mut(cols) {
                row.iter_mut().zip(&sums).for_each(|(value, sum)| *value += share * (sum - *value));
            }
        })
    },
};

pub(super) const GHOST: Definition = Definition {
    id: "crosstalk-ghost",
    effect: Some("crosstalk"),
    is_library_point: false,
    about: "s_e' = s_e + c s_(e-1), the element sampled before: the multiplexer carries charge on",
    is_fine: false,
    make: |knobs| {
        let share = knobs.scaled("share", 0.05);
        PipelineHook::element(move |_, signal| {
            for element in (1..signal.len()).rev() {
                signal[element] += share * signal[element - 1];
            }
        })
    },
};

pub(super) const STRAY_FIELD: Definition = Definition {
    id: "crosstalk-stray-field",
    effect: Some("crosstalk"),
    is_library_point: false,
    about: "s' = s + c sum of all others s_k (P/r)^3, P the pitch: the stray field of a dipole",
    is_fine: false,
    make: |knobs| {
        let share = knobs.scaled("share", 0.02);
        let centres_mm = knobs.centres_mm();
        let pitch_mm = knobs.sensor.model.array().element_mm()[0];
        let nearness = |one: &[f64; 2], other: &[f64; 2]| {
            let [x, y] = minus(*one, *other);
            let distance_mm = x.hypot(y);
            if distance_mm > 0.0 { (pitch_mm / distance_mm).powi(3) } else { 0.0 }
        };
        let reaches: Vec<Vec<f64>> = centres_mm
            .iter()
            .map(|one| centres_mm.iter().map(|other| share * nearness(one, other)).collect())
            .collect();
        PipelineHook::element(move |_, signal| {
            let clean = signal.to_vec();
            for (value, reaches) in signal.iter_mut().zip(&reaches) {
                *value += reaches.iter().zip(&clean).map(|(reach, s)| reach * s).sum::<f64>();
            }
        })
    },
};

pub(super) const DEAD: Definition = Definition {
    id: "dead-element",
    effect: Some("miswired"),
    is_library_point: true,
    about: "s' = 0 of one element, of two above strength 1, ...: broken traces",
    is_fine: false,
    make: |knobs| {
        let count = knobs.scaled("elements", 1.0).ceil();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a strength, rounded up")]
        let dead = knobs.several("element", count as usize);
        PipelineHook::element(move |_, signal| dead.iter().for_each(|element| signal[*element] = 0.0))
    },
};

pub(super) const ANSWERS_FOR_NEIGHBOUR: Definition = Definition {
    id: "answers-for-neighbour",
    effect: Some("miswired"),
    is_library_point: true,
    about: "s_e' = (1 - a) s_e + a s_n, a = 1 at strength 1: the paper's two faulty elements",
    is_fine: false,
    make: |knobs| {
        let element = knobs.which("element");
        let (_, cols) = knobs.grid();
        let beside = if element % cols + 1 < cols { element + 1 } else { element - 1 };
        let swapped = knobs.share("swapped", 1.0);
        PipelineHook::element(move |_, signal| {
            signal[element] += swapped * (signal[beside] - signal[element]);
        })
    },
};

pub(super) const RATIONAL: Definition = Definition {
    id: "saturation-rational",
    effect: Some("saturation"),
    is_library_point: false,
    about: "s' = s / (1 + |s|/S): a capacitive divider",
    is_fine: false,
    make: |knobs| {
        let limit_counts = knobs.shrinking("limit_counts", 3000.0);
        PipelineHook::Element(PipelineHook::each(move |s| s / (1.0 + s.abs() / limit_counts)))
    },
};

pub(super) const EXPONENTIAL: Definition = Definition {
    id: "saturation-exponential",
    effect: Some("saturation"),
    is_library_point: false,
    about: "s' = S (1 - exp(-s/S)): an amplifier that runs out of supply",
    is_fine: false,
    make: |knobs| {
        let limit_counts = knobs.shrinking("limit_counts", 1500.0);
        PipelineHook::Element(PipelineHook::each(move |s| -limit_counts * (-s / limit_counts).exp_m1()))
    },
};

pub(super) const KNEE: Definition = Definition {
    id: "saturation-knee",
    effect: Some("saturation"),
    is_library_point: false,
    about: "s' = s below a knee, K + c (s - K) above it: a protection diode begins to conduct",
    is_fine: false,
    make: |knobs| {
        let beyond = knobs.between("slope_beyond", 0.0, 0.4);
        let knee_counts = knobs.shrinking("knee_counts", 350.0);
        PipelineHook::Element(PipelineHook::each(move |s| {
            if s > knee_counts { knee_counts + beyond * (s - knee_counts) } else { s }
        }))
    },
};
