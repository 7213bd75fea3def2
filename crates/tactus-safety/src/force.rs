//! Loads on the elements: zeros, and rises above them.

use tactus_schema::rig::Service;
use tactus_schema::{Frame, MonoTime, Rig};

use crate::Violation;
use crate::limits::Limits;

/// Readings without load, in counts; `None` for an element that was not read then.
type Zero = Vec<Option<f64>>;

/// The array's elements as the supervisor knows them.
#[derive(Debug)]
pub(crate) struct Elements {
    rig: Expected,
    /// The run's first zero. It limits the load beside the tare, so that repeated taring cannot raise the limit step by step.
    reference: Option<Zero>,
    tare: Option<Zero>,
    /// By index; as many as the last frame had.
    states: Vec<ElementState>,
    last_frame: Option<MonoTime>,
    /// Silences before this were dealt with.
    excused: Option<MonoTime>,
}

#[derive(Debug, Clone, Copy)]
struct ElementState {
    counts: f64,
    last_read: Option<MonoTime>,
    /// In the last frame.
    is_read: bool,
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
            |(element, counts): (usize, &f64)| Some(*counts).filter(|_| !unwatched.contains(&element));
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
            states: Vec::new(),
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
        self.reference.as_ref().is_some_and(|zero| zero.iter().any(Option::is_some))
    }

    /// Discards the zeros: until new ones are taken, loads are held against the rig file's baseline.
    pub(crate) fn forget_zeros(&mut self) {
        self.reference = None;
        self.tare = None;
    }

    /// Takes a frame. Elements that were not read are ignored: their value in the frame is an earlier one. False if it reads
    /// no watched element: it shows no load, and counts as none.
    pub(crate) fn take(&mut self, frame: &Frame) -> bool {
        let at = frame.received.mono;
        let unread = ElementState { counts: 0.0, last_read: None, is_read: false };
        self.states.resize(frame.counts.len(), unread);
        for (state, counts) in self.states.iter_mut().zip(frame.counts.iter()) {
            state.is_read = counts.is_finite();
            state.counts = f64::from(*counts);
        }
        for element in frame.bad_elements.iter() {
            let state = usize::try_from(*element).ok().and_then(|element| self.states.get_mut(element));
            if let Some(state) = state {
                state.is_read = false;
            }
        }
        let unwatched = &self.rig.unwatched;
        let mut is_one = false;
        for (element, state) in self.states.iter_mut().enumerate().filter(|(_, state)| state.is_read) {
            state.last_read = Some(at);
            is_one |= !unwatched.contains(&element);
        }
        if is_one {
            self.last_frame = Some(at);
        }
        is_one
    }

    /// Sets the run's first zero, which is the tare, too.
    ///
    /// # Errors
    /// [`Violation::Zero`] if an element reads far from its baseline, [`Violation::Unread`] if one is not read. The zeros are
    /// unchanged then.
    pub(crate) fn set_reference(&mut self, counts: &[f64], limits: &Limits) -> Result<(), Violation> {
        let zero = self.checked_zero(counts, limits)?;
        let is_unread = |element: &usize| {
            zero.get(*element).is_none_or(Option::is_none) && !self.rig.unwatched.contains(element)
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
        for (element, (counts, baseline_counts)) in pairs {
            if let (Some(counts), Some(baseline_counts)) = (*counts, *baseline_counts)
                && (counts - baseline_counts).abs() > self.rig.band_counts
            {
                let band_counts = self.rig.band_counts;
                return Err(Violation::Zero { element, counts, baseline_counts, band_counts });
            }
        }
        Ok(zero)
    }

    /// An element that has been silent for long has no zero.
    fn zero(&self, element: usize, counts: &[f64], limits: &Limits) -> Option<f64> {
        let was_read = self.states.get(element).is_none_or(|state| {
            let silent_s = Limits::silence_s(self.last_frame.unwrap_or_default(), state.last_read);
            silent_s <= limits.silence_max_s()
        });
        let is_watched = was_read && !self.rig.unwatched.contains(&element);
        counts.get(element).copied().filter(|counts| is_watched && counts.is_finite())
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
        for (element, rise_counts) in self.rises(zero) {
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

    /// Rises of the elements that were read both now and for the zero.
    fn rises<'a>(&'a self, zero: &'a Zero) -> impl Iterator<Item = (usize, f64)> + 'a {
        let pairs = self.states.iter().zip(zero).zip(&self.rig.signs).enumerate();
        pairs.filter_map(|(element, ((state, zero), sign))| {
            let zero = zero.filter(|_| state.is_read)?;
            let rise_counts = state.counts - zero;
            Some((element, if self.rig.is_signed { rise_counts.abs() } else { rise_counts * sign }))
        })
    }

    /// Greatest rise above the tare; `None` without a zero.
    pub(crate) fn greatest_rise_counts(&self) -> Option<f64> {
        let rises = self.rises(self.tare.as_ref()?).map(|(_, rise_counts)| rise_counts);
        Some(rises.fold(0.0, f64::max))
    }

    /// An element that has a zero and has not been read for too long: its index and its silence.
    pub(crate) fn silent_element(&self, now: MonoTime, limits: &Limits) -> Option<(usize, f64)> {
        let zeros = self.reference.as_ref()?.iter();
        zeros.zip(&self.states).enumerate().find_map(|(element, (zero, state))| {
            let silent_s = Limits::silence_s(now, state.last_read.max(self.excused));
            let is_silent = zero.is_some() && !state.is_read && silent_s > limits.silence_max_s();
            is_silent.then_some((element, silent_s))
        })
    }
}
