use std::sync::{Arc, mpsc};

use super::Worker;
use crate::queue::Queue;

#[tokio::test(flavor = "multi_thread")]
async fn what_is_in_the_queue_is_done_before_the_end() {
    let queue = Arc::new(Queue::new(100));
    for n in 0..100 {
        assert_eq!(queue.push(n), None);
    }
    let (done, all_done) = mpsc::channel();
    let worker = Worker::start("test", queue, move |n| done.send(n).unwrap()).unwrap();
    worker.finish().await;
    assert_eq!(all_done.iter().collect::<Vec<_>>(), (0..100).collect::<Vec<_>>());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_worker_that_is_dropped_ends() {
    let queue = Arc::new(Queue::<()>::new(1));
    let (alive, ended) = mpsc::channel::<()>();
    let worker = Worker::start("test", queue, move |()| drop(alive.clone())).unwrap();
    drop(worker);
    assert!(ended.recv().is_err(), "the thread let go of its end");
}
