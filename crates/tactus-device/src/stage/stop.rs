//! The stop that is never queued.

use std::sync::atomic::{AtomicU64, Ordering};

use tokio::sync::Notify;

/// Pressed from anywhere, at any time, without waiting.
#[derive(Debug, Default)]
pub(super) struct StopSwitch {
    count: AtomicU64,
    pressed: Notify,
}

impl StopSwitch {
    pub(super) fn press(&self) {
        self.count.fetch_add(1, Ordering::SeqCst);
        self.pressed.notify_one();
    }

    /// How often it was pressed so far.
    pub(super) fn count(&self) -> u64 {
        self.count.load(Ordering::SeqCst)
    }

    /// Waits until it is pressed, or returns at once if it was since the last time. Cancel-safe.
    pub(super) async fn pressed(&self) {
        self.pressed.notified().await;
    }
}
