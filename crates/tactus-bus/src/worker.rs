//! Threads for what zenoh may make wait.
//!
//! A call that sends waits inside zenoh while the client's link is full. Such calls are made on threads of
//! their own: not by the service's tasks, and not by zenoh's receiving threads, which carry everybody's
//! commands.

use std::{io, sync::Arc, thread};

use tokio::runtime::Handle;

use crate::queue::Queue;

/// A thread that takes items from a queue, one by one, until the queue is closed and empty.
#[derive(Debug)]
pub(crate) struct Worker<T> {
    queue: Arc<Queue<T>>,
    thread: Option<thread::JoinHandle<()>>,
}

impl<T: Send + 'static> Worker<T> {
    /// Starts the thread. Ends when it is finished or dropped.
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

    /// Closes the queue and waits until all that is in it is done.
    pub(crate) async fn finish(mut self) {
        self.queue.close();
        let Some(thread) = self.thread.take() else { return };
        let joined = tokio::task::spawn_blocking(|| thread.join()).await;
        if !matches!(joined, Ok(Ok(()))) {
            tracing::error!("a thread of the bus broke down");
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
