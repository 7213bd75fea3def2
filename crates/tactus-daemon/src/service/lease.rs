//! The lease: one holder commands the rig. Times go in, decisions come out; there is no clock here.
//!
//! Run, pause, resume and reset need the caller's lease; status and STOP need none. A lease ends [`EXPIRY`] after its
//! last renewal. A run in progress goes on without it: another client may then take the lease, and pause or resume the run.

use std::fmt;
use std::time::Duration;

use tactus_schema::MonoTime;

/// How long a lease holds without a renewal.
pub(super) const EXPIRY: Duration = Duration::from_secs(5);

/// What proves that a client holds the lease. Only its holder knows it.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) struct Secret(pub(super) [u8; 16]);

/// Who holds the lease.
#[derive(Debug, Default)]
pub(super) struct Lease {
    last: Option<Holding>,
}

#[derive(Debug)]
struct Holding {
    who: String,
    secret: Secret,
    until: MonoTime,
}

/// The lease is somebody else's, or nobody's.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(super) enum NotHolder {
    /// Another client holds it.
    #[error("{holder} holds the lease: wait, or take it over with a reason")]
    Held { holder: String },
    /// It has ended, or was never taken.
    #[error("the lease has ended: take it again")]
    Stale,
    /// The request had none.
    #[error("this command wants the lease: take it first")]
    Missing,
}

impl Lease {
    /// Gives the lease to a client.
    ///
    /// # Errors
    /// [`NotHolder::Held`] if somebody has it.
    pub(super) fn acquire(&mut self, who: &str, secret: Secret, now: MonoTime) -> Result<(), NotHolder> {
        if let Some(holding) = self.holding(now) {
            return Err(NotHolder::Held { holder: holding.who.clone() });
        }
        self.give(who, secret, now);
        Ok(())
    }

    /// Gives the lease to a client, whoever has it; returns who had it.
    pub(super) fn take_over(&mut self, who: &str, secret: Secret, now: MonoTime) -> Option<String> {
        let from = self.holding(now).map(|holding| holding.who.clone());
        self.give(who, secret, now);
        from
    }

    /// Keeps the lease for another [`EXPIRY`].
    ///
    /// # Errors
    /// As [`Lease::check`].
    pub(super) fn renew(&mut self, secret: &[u8], now: MonoTime) -> Result<(), NotHolder> {
        self.check(secret, now)?;
        if let Some(holding) = &mut self.last {
            holding.until = now.after(EXPIRY);
        }
        Ok(())
    }

    /// Ends the lease.
    ///
    /// # Errors
    /// As [`Lease::check`].
    pub(super) fn release(&mut self, secret: &[u8], now: MonoTime) -> Result<(), NotHolder> {
        self.check(secret, now)?;
        self.last = None;
        Ok(())
    }

    /// Accepts a command of the holder.
    ///
    /// # Errors
    /// [`NotHolder`] says whose the lease is instead.
    pub(super) fn check(&self, secret: &[u8], now: MonoTime) -> Result<(), NotHolder> {
        match self.holding(now) {
            Some(holding) if holding.secret.is(secret) => Ok(()),
            Some(holding) => Err(NotHolder::Held { holder: holding.who.clone() }),
            None if secret.is_empty() => Err(NotHolder::Missing),
            None => Err(NotHolder::Stale),
        }
    }

    /// The holder, and the time left without a renewal.
    pub(super) fn holder(&self, now: MonoTime) -> Option<(&str, Duration)> {
        self.holding(now).map(|holding| (holding.who.as_str(), holding.until.since(now)))
    }

    fn holding(&self, now: MonoTime) -> Option<&Holding> {
        self.last.as_ref().filter(|holding| now < holding.until)
    }

    fn give(&mut self, who: &str, secret: Secret, now: MonoTime) {
        self.last = Some(Holding { who: who.to_owned(), secret, until: now.after(EXPIRY) });
    }
}

impl Secret {
    /// Takes as long for a wrong guess as for a right one.
    fn is(&self, given: &[u8]) -> bool {
        let differences = self.0.iter().zip(given).fold(0, |all, (own, other)| all | (own ^ other));
        given.len() == self.0.len() && differences == 0
    }
}

impl fmt::Debug for Secret {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Secret")
    }
}

#[cfg(test)]
#[path = "lease_tests.rs"]
mod tests;
