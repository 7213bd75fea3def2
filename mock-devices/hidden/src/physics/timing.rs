//! Motion and readout: lags that change from frame to frame, scans in other orders.

use rand::RngExt;

use super::readout::skewed;
use super::{Definition, PipelineHook};

pub(super) const JITTER: Definition = Definition {
    id: "late-frames-jitter",
    effect: Some("time-lag"),
    is_library_point: false,
    about: "p'(t) = p(t - l), l drawn for each frame evenly from 0 to 2 L: the host stamps frames when it gets round to it",
    is_fine: false,
    make: |knobs| {
        let lag_s = knobs.scaled("mean_lag_s", 0.04);
        let mut rng = knobs.rng();
        PipelineHook::path(move |now, path, tip_mm| {
            *tip_mm = path.at(now.t_s - 2.0 * lag_s * rng.random::<f64>());
        })
    },
};

pub(super) const CLOCKS_APART: Definition = Definition {
    id: "late-frames-clock",
    effect: Some("time-lag"),
    is_library_point: false,
    about: "p'(t) = p(t - e t): the clocks of sensor and stage differ in rate",
    is_fine: false,
    make: |knobs| {
        let rate = knobs.sign("side") * knobs.scaled("rate", 4e-4);
        PipelineHook::path(move |now, path, tip_mm| *tip_mm = path.at(now.t_s - rate * now.t_s))
    },
};

pub(super) const BUNDLES: Definition = Definition {
    id: "late-frames-bundles",
    effect: Some("time-lag"),
    is_library_point: false,
    about: "p'(t) = p(t - L (1 - frac(t/P))): frames travel in bundles, the first of each waits longest",
    is_fine: false,
    make: |knobs| {
        let frames = knobs.between("frames", 2.5, 8.0);
        let period_s = frames / knobs.sensor.model.array().rate_hz();
        let lag_s = knobs.scaled("longest_lag_s", 0.08);
        PipelineHook::path(move |now, path, tip_mm| {
            *tip_mm = path.at(now.t_s - lag_s * (1.0 - (now.t_s / period_s).fract()));
        })
    },
};

pub(super) const INTERLEAVED: Definition = Definition {
    id: "scan-interleaved",
    effect: Some("scan-skew"),
    is_library_point: false,
    about: "y_e(t) = x_e(t - S (R - 1 - place of row)/R): even rows are sampled first, then odd ones, as in old television",
    is_fine: true,
    make: |knobs| {
        let (rows, cols) = knobs.grid();
        let place = |row: usize| row / 2 + (row % 2) * rows.div_ceil(2);
        let scan_s = knobs.scaled("scan_s", 1.0 / knobs.sensor.model.array().rate_hz());
        let delay_s = |element: usize| scan_s * (rows - 1 - place(element / cols)) as f64 / rows as f64;
        skewed((0..rows * cols).map(delay_s).collect())
    },
};

pub(super) const SERPENTINE: Definition = Definition {
    id: "scan-serpentine",
    effect: Some("scan-skew"),
    is_library_point: false,
    about: "y_e(t) = x_e(t - S (N - 1 - place)/N): every second row is sampled from right to left",
    is_fine: true,
    make: |knobs| {
        let (rows, cols) = knobs.grid();
        let count = rows * cols;
        let place = |element: usize| {
            let (row, col) = (element / cols, element % cols);
            row * cols + if row % 2 == 0 { col } else { cols - 1 - col }
        };
        let scan_s = knobs.scaled("scan_s", 1.0 / knobs.sensor.model.array().rate_hz());
        let delay_s = |element: usize| scan_s * (count - 1 - place(element)) as f64 / count as f64;
        skewed((0..count).map(delay_s).collect())
    },
};

pub(super) const HALVES: Definition = Definition {
    id: "scan-halves",
    effect: Some("scan-skew"),
    is_library_point: false,
    about: "y_e(t) = x_e(t - S) for x left of the seam: the two sensors are read one after the other, each at once",
    is_fine: true,
    make: |knobs| {
        let (rows, cols) = knobs.grid();
        let scan_s = knobs.scaled("scan_s", 1.0 / knobs.sensor.model.array().rate_hz());
        let delay_s = |element: usize| if element % cols < cols / 2 { scan_s } else { 0.0 };
        skewed((0..rows * cols).map(delay_s).collect())
    },
};
