//! Threads for calls that may block in zenoh.
//!
//! A sending call blocks in zenoh while the client's link is full. Such calls have their own threads, so that they block
//! neither the service's tasks nor zenoh's receiving threads, which carry everybody's commands.

use std::{io, sync::Arc, thread};

use tokio::runtime::Handle;

use crate::queue::Queue;

/// A thread that processes the items of a queue until the queue is closed and empty.
#[derive(Debug)]
pub(crate) struct Worker<T> {
    queue: Arc<Queue<T>>,
    thread: Option<thread::JoinHandle<()>>,
}

impl<T: Send + 'static> Worker<T> {
    /// Starts the thread. It ends after [`Worker::finish`] or drop.
    pub(crate) fn start(
        name: &str,
        queue: Arc<Queue<T>>,
        mut work: impl FnMut(T) + Send + 'static,
    ) -> io::Result<Self> {
        let runtime = Handle::current();
        let thread = thread::Builder::new().name(name.to_owned()).spawn({
            let queue = queue.clone();
            move || {
                while let Some(item) = runtime.block_on(queue.pop()) {
                    work(item);
                }
            }
        })?;
        Ok(Self { queue, thread: Some(thread) })
    }

    /// Closes the queue and waits until all its items are processed.
    pub(crate) async fn finish(mut self) {
        self.queue.close();
        let Some(thread) = self.thread.take() else { return };
        let joined = tokio::task::spawn_blocking(|| thread.join()).await;
        if !matches!(joined, Ok(Ok(()))) {
            tracing::error!("a thread of the bus panicked");
        }
    }
}

impl<T> Drop for Worker<T> {
    fn drop(&mut self) {
        self.queue.close();
    }
}

#[cfg(test)]
#[path = "worker_tests.rs"]
mod tests;
