//! The stop switch: a stop is never queued behind commands.

use std::sync::atomic::{AtomicU64, Ordering};

use tokio::sync::Notify;

/// Can be pressed from any task at any time, without waiting.
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

    /// How often it has been pressed.
    pub(super) fn count(&self) -> u64 {
        self.count.load(Ordering::SeqCst)
    }

    /// Waits until it is pressed; returns at once if it was pressed since the last call. Cancel-safe.
    pub(super) async fn pressed(&self) {
        self.pressed.notified().await;
    }
}
