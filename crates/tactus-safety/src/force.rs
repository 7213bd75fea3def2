//! Loads on the elements: zeros, and rises above them.

use tactus_schema::rig::Service;
use tactus_schema::{Frame, MonoTime, Rig};

use crate::Violation;
use crate::limits::Limits;

/// Readings without load, in counts, by element; NaN for an element that has none. A rise above it is NaN, which is over no limit:
/// plain numbers, because every frame of every rig is held against them.
type Zero = Vec<f64>;

/// The array's elements as the supervisor knows them.
#[derive(Debug)]
pub(crate) struct Elements {
    rig: Expected,
    /// The run's first zero. It limits the load beside the tare, so that repeated taring cannot raise the limit step by step.
    reference: Option<Zero>,
    tare: Option<Zero>,
    /// The last frame, by element; NaN for an element that was not read in it.
    counts: Vec<f64>,
    /// When each element was last read.
    last_read: Vec<Option<MonoTime>>,
    last_frame: Option<MonoTime>,
    /// Silences before this were dealt with.
    excused: Option<MonoTime>,
}

/// What the rig file says of the elements, by index.
#[derive(Debug)]
struct Expected {
    baseline_counts: Zero,
    band_counts: f64,
    /// Direction of the reading when the element is pressed.
    signs: Vec<f64>,
    /// As [`tactus_schema::rig::SensorProtocol::is_signed`].
    is_signed: bool,
    unwatched: Vec<usize>,
}

impl Elements {
    pub(crate) fn new(rig: &Rig, service: &Service) -> Self {
        let envelope = &service.envelope;
        let unwatched = envelope.unwatched_elements.clone();
        let baseline =
            |(element, counts): (usize, &f64)| if unwatched.contains(&element) { f64::NAN } else { *counts };
        Self {
            rig: Expected {
                baseline_counts: rig.baseline_counts.iter().enumerate().map(baseline).collect(),
                band_counts: envelope.baseline_band_counts,
                is_signed: service.sensor.protocol.is_signed(),
                signs: rig.sensitivity_counts_per_mm.iter().map(|counts| counts.signum()).collect(),
                unwatched,
            },
            reference: None,
            tare: None,
            counts: Vec::new(),
            last_read: Vec::new(),
            last_frame: None,
            excused: None,
        }
    }

    /// When the last frame arrived.
    pub(crate) fn last_frame(&self) -> Option<MonoTime> {
        self.last_frame
    }

    /// True if any element has a zero: without one the array is blind.
    pub(crate) fn has_zero(&self) -> bool {
        self.reference.as_ref().is_some_and(|zero| zero.iter().any(|counts| !counts.is_nan()))
    }

    /// Discards the zeros: until new ones are taken, loads are held against the rig file's baseline.
    pub(crate) fn forget_zeros(&mut self) {
        self.reference = None;
        self.tare = None;
    }

    /// Takes a frame. Elements that were not read are ignored: their value in the frame is an earlier one. False if it is late or
    /// reads no watched element: its loads count, but it does not show that there are none now.
    pub(crate) fn take(&mut self, frame: &Frame, is_late: bool) -> bool {
        let at = frame.received.mono;
        self.counts.clear();
        let read = |counts: &f32| if counts.is_finite() { f64::from(*counts) } else { f64::NAN };
        self.counts.extend(frame.counts.iter().map(read));
        for element in frame.bad_elements.iter() {
            let counts = usize::try_from(*element).ok().and_then(|element| self.counts.get_mut(element));
            if let Some(counts) = counts {
                *counts = f64::NAN;
            }
        }
        self.last_read.resize(self.counts.len(), None);
        for (last_read, counts) in self.last_read.iter_mut().zip(&self.counts) {
            *last_read = if counts.is_nan() || is_late { *last_read } else { Some(at) };
        }
        let is_watched = |element: &usize| !self.rig.unwatched.contains(element);
        let is_one =
            self.counts.iter().enumerate().any(|(element, counts)| !counts.is_nan() && is_watched(&element));
        let is_fresh = is_one && !is_late;
        if is_fresh {
            self.last_frame = Some(at);
        }
        is_fresh
    }

    /// Sets the run's first zero, which is the tare, too.
    ///
    /// # Errors
    /// [`Violation::Zero`] if an element reads far from its baseline, [`Violation::Unread`] if one is not read. The zeros are
    /// unchanged then.
    pub(crate) fn set_reference(&mut self, counts: &[f64], limits: &Limits) -> Result<(), Violation> {
        let zero = self.checked_zero(counts, limits)?;
        let is_unread = |element: &usize| {
            zero.get(*element).is_none_or(|counts| counts.is_nan()) && !self.rig.unwatched.contains(element)
        };
        if let Some(element) = (0..zero.len().max(1)).find(is_unread) {
            return Err(Violation::Unread { element });
        }
        self.tare = Some(zero.clone());
        self.reference = Some(zero);
        Ok(())
    }

    /// Sets the script's new zero. An element that is not read at the time keeps the limit above the run's first zero.
    ///
    /// # Errors
    /// [`Violation::Zero`] if an element reads far from its baseline. The tare is unchanged then.
    pub(crate) fn set_tare(&mut self, counts: &[f64], limits: &Limits) -> Result<(), Violation> {
        self.tare = Some(self.checked_zero(counts, limits)?);
        Ok(())
    }

    fn checked_zero(&self, counts: &[f64], limits: &Limits) -> Result<Zero, Violation> {
        let zero: Zero = (0..counts.len()).map(|element| self.zero(element, counts, limits)).collect();
        let pairs = zero.iter().zip(&self.rig.baseline_counts).enumerate();
        let band_counts = self.rig.band_counts;
        for (element, (&counts, &baseline_counts)) in pairs {
            if (counts - baseline_counts).abs() > band_counts {
                return Err(Violation::Zero { element, counts, baseline_counts, band_counts });
            }
        }
        Ok(zero)
    }

    /// An element that has been silent for long has no zero.
    fn zero(&self, element: usize, counts: &[f64], limits: &Limits) -> f64 {
        let was_read = self.last_read.get(element).is_none_or(|last_read| {
            let silent_s = Limits::silence_s(self.last_frame.unwrap_or_default(), *last_read);
            silent_s <= limits.silence_max_s()
        });
        let is_watched = was_read && !self.rig.unwatched.contains(&element);
        counts.get(element).copied().filter(|counts| is_watched && counts.is_finite()).unwrap_or(f64::NAN)
    }

    /// Counts silences from `now` at the earliest.
    pub(crate) fn excuse_silence(&mut self, now: MonoTime) {
        self.excused = Some(now);
    }

    /// Time without a frame, excused times left out.
    pub(crate) fn silence_s(&self, now: MonoTime) -> f64 {
        Limits::silence_s(now, self.last_frame.max(self.excused))
    }

    /// Greatest load, if it is over a limit.
    pub(crate) fn overload(&self, limits: &Limits) -> Option<Violation> {
        let Some(reference) = &self.reference else {
            let band_counts = self.rig.band_counts;
            return self.over(&self.rig.baseline_counts, band_counts, limits, "the rig's baseline");
        };
        let against_tare = self.tare.as_ref().and_then(|tare| self.over(tare, 0.0, limits, "the tare"));
        against_tare.or_else(|| self.over(reference, 0.0, limits, "the run's first zero"))
    }

    fn over(
        &self,
        zero: &Zero,
        band_counts: f64,
        limits: &Limits,
        against: &'static str,
    ) -> Option<Violation> {
        let envelope = &limits.envelope;
        let limit_counts = envelope.element_max_counts + band_counts;
        let mut sum_counts = 0.0;
        for (element, rise_counts) in self.rises(zero).enumerate() {
            if rise_counts > limit_counts {
                return Some(Violation::ElementForce { element, rise_counts, limit_counts, against });
            }
            // Elements that fall must not hide the load on those that rise.
            sum_counts += (rise_counts - band_counts).max(0.0);
        }
        let limit_counts = envelope.sum_max_counts;
        (sum_counts > limit_counts).then_some(Violation::SumForce {
            rise_counts: sum_counts,
            limit_counts,
            against,
        })
    }

    /// Rises by element; NaN for one that was not read both now and for the zero.
    fn rises<'a>(&'a self, zero: &'a Zero) -> impl Iterator<Item = f64> + 'a {
        self.counts.iter().zip(zero).zip(&self.rig.signs).map(|((counts, zero), sign)| {
            let rise_counts = counts - zero;
            if self.rig.is_signed { rise_counts.abs() } else { rise_counts * sign }
        })
    }

    /// Greatest rise above the tare; `None` without a zero.
    pub(crate) fn greatest_rise_counts(&self) -> Option<f64> {
        // The greater of a number and NaN is the number.
        Some(self.rises(self.tare.as_ref()?).fold(0.0, f64::max))
    }

    /// An element that has a zero and has not been read for too long: its index and its silence.
    pub(crate) fn silent_element(&self, now: MonoTime, limits: &Limits) -> Option<(usize, f64)> {
        let reference = self.reference.as_ref()?;
        let elements = reference.iter().zip(&self.counts).zip(&self.last_read).enumerate();
        let unread = elements.filter(|(_, ((zero, counts), _))| !zero.is_nan() && counts.is_nan());
        unread
            .map(|(element, (_, last_read))| {
                (element, Limits::silence_s(now, (*last_read).max(self.excused)))
            })
            .find(|(_, silent_s)| *silent_s > limits.silence_max_s())
    }
}
