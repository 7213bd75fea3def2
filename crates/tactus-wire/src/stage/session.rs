//! The interface between a stage protocol and its driver.

use core::time::Duration;

use super::{Action, Cause, Whereabouts};

/// The host's side of a stage protocol over one connection. Positions are in the stage's frame, as the session's
/// configuration defines it.
///
/// Call [`start`](Self::start) once, [`receive`](Self::receive) with each read, and [`timer`](Self::timer) when
/// [`deadline`](Self::deadline) is reached. Carry out the actions in their order. Times never decrease.
///
/// Give one command at a time ([`home`](Self::home), [`move_to`](Self::move_to), [`look`](Self::look),
/// [`clear_alarm`](Self::clear_alarm)), while [`is_ready`](Self::is_ready) is true. Each ends with one [`Action::Done`]. [`stop`](Self::stop) may be called at
/// any time. After [`Action::Failed`] the session does nothing more, and a command under way ends without
/// [`Action::Done`]: open the link again.
///
/// No session changes settings that the controller keeps. If they do not match, the session reports it and ends.
pub trait Session {
    /// The error that ends a session.
    type Error: core::error::Error;

    /// The kind of an error.
    fn cause(error: &Self::Error) -> Cause;

    /// True if a command would be accepted: no command, stop or reset is under way.
    fn is_ready(&self) -> bool;

    /// True while a stop is under way, whether requested or caused by a failed command.
    fn is_stopping(&self) -> bool;

    /// When [`timer`](Self::timer) is due; `None` once the session is over.
    fn deadline(&self) -> Option<Duration>;

    /// Lines that could not be parsed and unexpected messages, since the start.
    fn unknown_lines(&self) -> u64;

    /// Where the stage stands, for the session of the next connection; `None` if that is not known. A protocol whose controllers
    /// remember themselves whether they are homed has no need of it.
    fn whereabouts(&self) -> Option<Whereabouts> {
        None
    }

    /// Tells, before [`start`](Self::start), what the session of the last connection knew. The position counts as known if the
    /// controller stands there and was not reset meanwhile.
    fn recall(&mut self, _known: Whereabouts) {}

    /// Queries the controller for its identity, settings and position. Moves nothing.
    fn start(&mut self, now: Duration) -> Vec<Action<Self::Error>>;

    /// Searches for the reference position.
    fn home(&mut self, now: Duration) -> Vec<Action<Self::Error>>;

    /// Moves to a target in a straight line. A move to the present position moves nothing; it becomes a
    /// [`look`](Self::look), and fails if the stage is elsewhere.
    fn move_to(
        &mut self,
        now: Duration,
        target_mm: [f64; 3],
        speed_mm_per_s: f64,
    ) -> Vec<Action<Self::Error>>;

    /// Asks the controller where it stands now, and whether it is idle. Moves nothing.
    ///
    /// Only answers to questions asked after the call count. It fails in an alarm, on a stage that is not homed, and if
    /// the stage is not idle. Its result therefore never comes from a position that was known before.
    fn look(&mut self, now: Duration) -> Vec<Action<Self::Error>>;

    /// Clears an alarm, after which the position is suspect. Does nothing without an alarm.
    fn clear_alarm(&mut self, now: Duration) -> Vec<Action<Self::Error>>;

    /// Stops motion now. The first action sends the stop, without waiting for an answer.
    fn stop(&mut self, now: Duration) -> Vec<Action<Self::Error>>;

    /// The bytes of the last [`Action::Move`] were not written: the command ends with
    /// [`Failure::Withheld`](super::Failure::Withheld).
    fn withhold(&mut self, now: Duration) -> Vec<Action<Self::Error>>;

    /// Bytes that stop what the command under way does. They are for whoever cannot call [`stop`](Self::stop) because the
    /// session does not go on.
    fn halt(&self) -> Vec<u8>;

    /// Takes the bytes of one read.
    fn receive(&mut self, now: Duration, bytes: &[u8]) -> Vec<Action<Self::Error>>;

    /// Does what is due at [`deadline`](Self::deadline). Before that it does nothing.
    fn timer(&mut self, now: Duration) -> Vec<Action<Self::Error>>;
}
