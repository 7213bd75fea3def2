//! The bar of a discovery. How long that takes depends on what the data hold, so the time left is a range.

use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};

use indicatif::{ProgressBar, ProgressFinish, ProgressState, ProgressStyle};
use tactus_discover::{Progress, TimeLeft};

use super::{STEPS, TICK, set_share, target};

/// Progress bar of a discovery: the share that is probably done, the time so far and left, the current activity. Hidden where
/// [`RunProgress`](super::RunProgress) is; ends with this.
#[derive(Debug)]
pub(crate) struct DiscoveryProgress {
    bar: ProgressBar,
    left: Arc<Mutex<Option<TimeLeft>>>,
    /// The greatest share that was told.
    share: Mutex<f64>,
}

impl DiscoveryProgress {
    /// Time begins now.
    pub(crate) fn new(silent: bool) -> Self {
        let bar =
            ProgressBar::with_draw_target(Some(STEPS), target(silent)).with_finish(ProgressFinish::AndClear);
        let left = Arc::<Mutex<Option<TimeLeft>>>::default();
        let shown = Arc::clone(&left);
        let range = move |state: &ProgressState, to: &mut dyn fmt::Write| {
            if let Some(left) = *shown.lock().unwrap_or_else(PoisonError::into_inner) {
                // Nothing can be done about a line that does not fit.
                let _full = write!(to, "{}", in_words(left.range_s(state.elapsed().as_secs_f64())));
            }
        };
        if let Ok(style) = ProgressStyle::with_template(
            "{bar:20.cyan/dim} {percent:>3} %  {elapsed:>4}  {range}  {wide_msg}",
        ) {
            bar.set_style(style.with_key("range", range));
        }
        bar.enable_steady_tick(TICK);
        Self { bar, left, share: Mutex::new(0.0) }
    }

    /// Shows the current activity. The share never falls, also where the search goes back.
    pub(crate) fn show(&self, now: &Progress) {
        if let Some(left) = now.stage.left() {
            *self.left.lock().unwrap_or_else(PoisonError::into_inner) = Some(left);
            let mut share = self.share.lock().unwrap_or_else(PoisonError::into_inner);
            *share = share.max(left.share_done());
            set_share(&self.bar, *share);
        }
        self.bar.set_message(now.what.clone());
    }
}

/// `40 s to 2 min left`, at least as wide as the range.
fn in_words([least_s, most_s]: [f64; 2]) -> String {
    let ([from, from_unit], [to, to_unit]) = (rounded(least_s, f64::floor), rounded(most_s, f64::ceil));
    if from == "0" {
        format!("up to {to} {to_unit} left")
    } else if from_unit == to_unit {
        format!("{from} to {to} {to_unit} left")
    } else {
        format!("{from} {from_unit} to {to} {to_unit} left")
    }
}

/// A rough time and its unit.
fn rounded(time_s: f64, round: impl Fn(f64) -> f64) -> [String; 2] {
    let (unit_s, unit, step) = match time_s {
        ..10.0 => (1.0, "s", 1.0),
        ..120.0 => (1.0, "s", 5.0),
        ..7200.0 => (60.0, "min", 1.0),
        _ => (3600.0, "h", 1.0),
    };
    let time = step * round(time_s / (unit_s * step));
    [format!("{time:.0}"), unit.to_owned()]
}

#[cfg(test)]
#[path = "discovery_tests.rs"]
mod tests;
