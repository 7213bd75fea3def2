//! The host's side of a conversation, as a driver sees it.

use core::time::Duration;

use super::{Action, Cause};

/// A conversation over one connection with the controller, or the controllers, of a stage. Positions are in the
/// stage's frame, as the session's configuration tells it.
///
/// Call [`start`](Self::start) once, [`receive`](Self::receive) with what arrives and [`timer`](Self::timer)
/// when [`deadline`](Self::deadline) has come; do what the actions say, in their order. Times never go
/// back. Commands ([`home`](Self::home), [`move_to`](Self::move_to), [`clear_alarm`](Self::clear_alarm)) are
/// given one at a time, while [`is_ready`](Self::is_ready); each ends with one [`Action::Done`].
/// [`stop`](Self::stop) may be called at any time. After [`Action::Failed`] it does nothing more: open the
/// link anew. The command in hand then ends without [`Action::Done`].
///
/// No session changes what the controller keeps for good: where its settings do not fit, it says so and ends.
pub trait Session {
    /// Why a session may be over.
    type Error: core::error::Error;

    /// What kind of thing an error is.
    fn cause(error: &Self::Error) -> Cause;

    /// True if a command would be taken: none is in hand, and no stop or reset is under way.
    fn is_ready(&self) -> bool;

    /// True while a stop, or the stop of a command that went wrong, has not come to its end.
    fn is_stopping(&self) -> bool;

    /// When [`timer`](Self::timer) is due; `None` once the session is over.
    fn deadline(&self) -> Option<Duration>;

    /// Lines that could not be read and messages that answered nothing, since the start.
    fn unknown_lines(&self) -> u64;

    /// Begins the conversation: asks who is there and where it stands. No axis is sent anywhere.
    fn start(&mut self, now: Duration) -> Vec<Action<Self::Error>>;

    /// Finds the reference position.
    fn home(&mut self, now: Duration) -> Vec<Action<Self::Error>>;

    /// Goes to a place in a straight line. A target equal to the present position is done at once.
    fn move_to(
        &mut self,
        now: Duration,
        target_mm: [f64; 3],
        speed_mm_per_s: f64,
    ) -> Vec<Action<Self::Error>>;

    /// Clears an alarm. The position is suspect after it. Without an alarm nothing is done.
    fn clear_alarm(&mut self, now: Duration) -> Vec<Action<Self::Error>>;

    /// Stops motion now: what stops it is the first action, and waits for no answer.
    fn stop(&mut self, now: Duration) -> Vec<Action<Self::Error>>;

    /// Takes what arrived.
    fn receive(&mut self, now: Duration, bytes: &[u8]) -> Vec<Action<Self::Error>>;

    /// Does what is due at [`deadline`](Self::deadline).
    fn timer(&mut self, now: Duration) -> Vec<Action<Self::Error>>;
}
