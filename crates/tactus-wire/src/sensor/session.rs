//! The interface between a sensor protocol and its driver.

use core::time::Duration;

use super::Action;

/// The host's side of a sensor protocol over one connection.
///
/// Call [`start`](Self::start) once, [`receive`](Self::receive) with each read, and [`timer`](Self::timer) when
/// [`deadline`](Self::deadline) is reached. Carry out the actions in their order. Times never decrease. After
/// [`Action::Failed`] the session does nothing more.
pub trait Session {
    /// Name of the format, as `SensorInfo.link` on the bus reports it.
    fn name(&self) -> String;

    /// Length of a tick of [`Reading::tick`](super::Reading::tick) in ns; 0 without a clock.
    fn tick_ns(&self) -> u64;

    /// Length of a packet in bytes where each read must return one whole packet; `None` where bytes are a stream.
    fn packet_bytes(&self) -> Option<usize> {
        None
    }

    /// Opens the conversation.
    fn start(&mut self, now: Duration) -> Vec<Action>;

    /// Takes the bytes of one read, and appends the actions that follow to `actions`, which is empty.
    fn receive_into(&mut self, now: Duration, bytes: &[u8], actions: &mut Vec<Action>);

    /// As [`receive_into`](Self::receive_into), with a new list.
    fn receive(&mut self, now: Duration, bytes: &[u8]) -> Vec<Action> {
        let mut actions = Vec::new();
        self.receive_into(now, bytes, &mut actions);
        actions
    }

    /// Does what is due at [`deadline`](Self::deadline). Before that it does nothing.
    fn timer(&mut self, now: Duration) -> Vec<Action>;

    /// When [`timer`](Self::timer) is due; `None` before the start and after the end.
    fn deadline(&self) -> Option<Duration>;

    /// Counts of everything received besides good frames, in words, for the log.
    fn quality(&self) -> String;
}
