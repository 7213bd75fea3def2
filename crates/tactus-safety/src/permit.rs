//! Permits for motion.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use tactus_schema::MonoTime;

use crate::Fault;

/// The target of a move, in the stage's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target {
    /// x, y, z in mm; z = 0 is the covering's nominal surface.
    pub position_mm: [f64; 3],
    /// Speed along the straight line to the target.
    pub speed_mm_per_s: f64,
}

/// Leave to make one move. Only a [`crate::Supervisor`] makes one, and it is used up by the move.
#[derive(Debug)]
pub struct Permit {
    target: Target,
    terms: Terms,
}

/// Leave to home the stage once.
#[derive(Debug)]
pub struct HomingPermit {
    terms: Terms,
}

/// Voids permits. Clones void the same permits.
#[derive(Debug, Clone, Default)]
pub struct Revocation(Arc<AtomicU64>);

/// How long a permit is valid.
#[derive(Debug)]
struct Terms {
    /// `None` for a way up, which is never more dangerous than to stay.
    expires: Option<MonoTime>,
    revocation: Revocation,
    /// Revocations before the permit was given.
    revocations: u64,
}

/// Why a permit is not valid any more.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Void {
    /// The time between the permit and the command was too long.
    #[error("the permit to move is too old: the computer was too slow")]
    Expired,
    /// Something was stopped, moved or permitted after the permit was given.
    #[error("a stop, or another motion, came between the permit to move and the move")]
    Revoked,
}

/// Why a motion is not permitted.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum Denied {
    /// A fault allows only the way up.
    #[error("{0}: `tactus reset` first")]
    Fault(Fault),
    /// The supervisor has seen no recent frame.
    #[error("the last frame is {age_s:.3} s old; a step down needs one of the last {limit_s:.3} s")]
    NoFreshFrame { age_s: f64, limit_s: f64 },
    /// Frames arrive, and wait too long on their way.
    #[error(
        "frames arrive {late_s:.3} s late by the sensor's own clock: its link or this computer is too slow, or its clock stood still or goes \
         wrong; a new connection begins anew (unplug the sensor for a moment, or restart the service)"
    )]
    LateFrames { late_s: f64 },
    /// The last report of the stage is old.
    #[error("the stage's last report is {age_s:.3} s old; a step down needs one of the last {limit_s:.3} s")]
    NoFreshReport { age_s: f64, limit_s: f64 },
    /// Elements have no zero since the sensor connected, so a load would not be seen.
    #[error("no zero was taken since the sensor connected")]
    NoZero,
    /// The stage moves.
    #[error("the stage does not stand still: {status}")]
    NotStanding { status: &'static str },
    /// The stage does not answer.
    #[error("the stage does not answer: is it plugged in and switched on?")]
    NoStage,
    /// The stage's report has no position.
    #[error("the stage says that it stands, but not where")]
    NoPlace,
    /// Deeper than the covering in place allows.
    #[error("{depth_mm:.3} mm is too deep: the limit is {limit_mm:.3} mm")]
    TooDeep { depth_mm: f64, limit_mm: f64 },
    /// Too far down in one step near the covering.
    #[error("{step_mm:.3} mm down is too far for one step near the covering: the limit is {limit_mm} mm")]
    TooFarDown { step_mm: f64, limit_mm: f64 },
    /// Sideways below the approach height.
    #[error("no move sideways at z = {z_mm:.3} mm: the limit is {limit_mm} mm (motion.approach_height_mm)")]
    Sideways { z_mm: f64, limit_mm: f64 },
    /// Outside the envelope.
    #[error("{axis} = {value_mm:.3} mm is outside {least_mm} to {greatest_mm} mm (envelope.{axis}_mm)")]
    Outside {
        /// x, y or z.
        axis: &'static str,
        value_mm: f64,
        least_mm: f64,
        greatest_mm: f64,
    },
    /// Faster than the envelope allows.
    #[error("{speed_mm_per_s} mm/s is too fast: the limit is {limit_mm_per_s} mm/s")]
    TooFast { speed_mm_per_s: f64, limit_mm_per_s: f64 },
}

impl Denied {
    /// True if a later try may be permitted without anything else changing: the next frame or report may cure it.
    pub fn may_pass(&self) -> bool {
        matches!(
            self,
            Self::NoFreshFrame { .. }
                | Self::LateFrames { .. }
                | Self::NoFreshReport { .. }
                | Self::NotStanding { .. }
        )
    }
}

impl Revocation {
    /// Voids all permits that were given before.
    pub fn revoke(&self) {
        self.0.fetch_add(1, Ordering::SeqCst);
    }

    fn count(&self) -> u64 {
        self.0.load(Ordering::SeqCst)
    }

    fn terms(&self, expires: Option<MonoTime>) -> Terms {
        Terms { expires, revocation: self.clone(), revocations: self.count() }
    }

    /// A permit. It voids all others: there is one motion at a time, from where the stage stands now.
    pub(crate) fn permit(&self, target: Target, expires: Option<MonoTime>) -> Permit {
        self.revoke();
        Permit { target, terms: self.terms(expires) }
    }

    /// A permit to home. It voids all others.
    pub(crate) fn homing_permit(&self, expires: MonoTime) -> HomingPermit {
        self.revoke();
        HomingPermit { terms: self.terms(Some(expires)) }
    }
}

impl Permit {
    /// The permitted target.
    pub fn target(&self) -> Target {
        self.target
    }

    /// Checks that the permit is still valid.
    ///
    /// # Errors
    /// [`Void`] if it is not.
    pub fn check(&self, now: MonoTime) -> Result<(), Void> {
        self.terms.check(now)
    }
}

impl HomingPermit {
    /// Checks that the permit is still valid.
    ///
    /// # Errors
    /// [`Void`] if it is not.
    pub fn check(&self, now: MonoTime) -> Result<(), Void> {
        self.terms.check(now)
    }
}

impl Terms {
    fn check(&self, now: MonoTime) -> Result<(), Void> {
        if self.revocation.count() != self.revocations {
            return Err(Void::Revoked);
        }
        if self.expires.is_some_and(|expires| now > expires) {
            return Err(Void::Expired);
        }
        Ok(())
    }
}
