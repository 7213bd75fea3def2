//! Ctrl-C.

use std::{
    io,
    panic::resume_unwind,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
        mpsc::{RecvTimeoutError, channel},
    },
    thread,
    time::Duration,
};

use signal_hook::{
    consts::{SIGINT, SIGTERM},
    flag,
};

/// The wish that work ends soon.
#[derive(Debug, Clone, Default)]
pub struct Stop(Arc<AtomicBool>);

/// How soon the wish is seen.
const LOOK_AGAIN: Duration = Duration::from_millis(20);

impl Stop {
    /// From now on Ctrl-C and SIGTERM are this wish. The second one ends the process at once.
    ///
    /// # Errors
    /// If the system refuses a handler.
    pub fn on_signals() -> io::Result<Self> {
        let stop = Self::default();
        for signal in [SIGINT, SIGTERM] {
            flag::register_conditional_shutdown(signal, 128 + signal, Arc::clone(&stop.0))?;
            flag::register(signal, Arc::clone(&stop.0))?;
        }
        Ok(stop)
    }

    /// Work is to end soon.
    pub fn set(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// True if work is to end soon.
    pub fn is_set(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// Computes something that cannot be stopped, on a thread of its own. `None` if the wish came before the end: the thread then ends with
    /// the process.
    ///
    /// # Panics
    /// If the computation does.
    pub fn unless_set<T: Send + 'static>(&self, compute: impl FnOnce() -> T + Send + 'static) -> Option<T> {
        let (tell, told) = channel();
        // Whoever waited may be gone.
        let computation = thread::spawn(move || drop(tell.send(compute())));
        while !self.is_set() {
            match told.recv_timeout(LOOK_AGAIN) {
                Ok(result) => return Some(result),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => match computation.join() {
                    Ok(()) => return None,
                    Err(panic) => resume_unwind(panic),
                },
            }
        }
        None
    }
}
