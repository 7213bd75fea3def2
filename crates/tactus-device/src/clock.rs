//! The host's clocks, real or virtual.

use std::time::{Duration, SystemTime};

use tactus_schema::{MonoTime, TimeStamp, WallTime};
use tokio::time::Instant;

/// The host's monotonic and wall clock, read together.
///
/// Monotonic time is tokio's. In a runtime with paused time it jumps to the next timer whenever every task waits, so
/// tests do not wait.
#[derive(Debug, Clone, Copy)]
pub struct Clock {
    start: Instant,
    wall_start: WallTime,
    is_virtual: bool,
}

impl Clock {
    /// A clock that starts now and follows real time.
    pub fn real() -> Self {
        Self { start: Instant::now(), wall_start: wall_now(), is_virtual: false }
    }

    /// A clock for a runtime with paused time. Its wall time starts at the present and advances with the virtual time.
    pub fn paused() -> Self {
        Self { is_virtual: true, ..Self::real() }
    }

    /// True if time is simulated.
    pub fn is_virtual(&self) -> bool {
        self.is_virtual
    }

    /// The present instant. A real clock reads the system's wall time at each call: a step of the system clock shows
    /// in the wall time and not in the monotonic time.
    pub fn now(&self) -> TimeStamp {
        let elapsed = self.start.elapsed();
        let wall = if self.is_virtual { self.wall_start.after(elapsed) } else { wall_now() };
        TimeStamp { mono: MonoTime::default().after(elapsed), wall }
    }

    /// The tokio instant of a monotonic time.
    pub fn instant(&self, mono: MonoTime) -> Instant {
        self.start + mono.since(MonoTime::default())
    }
}

fn wall_now() -> WallTime {
    let since_1970 = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or(Duration::ZERO);
    WallTime::default().after(since_1970)
}
