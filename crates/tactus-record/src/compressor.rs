//! Compressors, which recordings share. Each needs one for less than a millisecond, twice a second, and its tables are larger than all else that a
//! recording keeps in memory: a service of many rigs would have hundreds of them.

use std::{
    io,
    sync::{Mutex, MutexGuard, PoisonError},
};

use zstd::bulk::Compressor;

/// A higher level gains hardly anything on chunks this small: see [`crate::channel`].
const LEVEL: i32 = 1;

/// Compressors that are kept for the next chunk: more recordings than this seldom close one at the same moment.
const IDLE_MAX: usize = 4;

/// Compressors that nobody uses now. The lock is held to take one or to give it back, never to compress: no recording waits for another.
static IDLE: Mutex<Vec<Compressor<'static>>> = Mutex::new(Vec::new());

/// The bytes as a zstd frame.
///
/// # Errors
/// If there is no memory for a compressor.
pub(crate) fn compress(bytes: &[u8]) -> io::Result<Vec<u8>> {
    let kept = idle().pop();
    let mut compressor = match kept {
        Some(compressor) => compressor,
        None => Compressor::new(LEVEL)?,
    };
    let packed = compressor.compress(bytes)?;
    let mut idle = idle();
    if idle.len() < IDLE_MAX {
        idle.push(compressor);
    }
    Ok(packed)
}

fn idle() -> MutexGuard<'static, Vec<Compressor<'static>>> {
    // Nothing panics under this lock.
    IDLE.lock().unwrap_or_else(PoisonError::into_inner)
}
