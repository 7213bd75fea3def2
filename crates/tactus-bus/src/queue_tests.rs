use std::sync::Arc;

use super::Queue;

#[tokio::test]
async fn the_oldest_give_way_and_are_counted() {
    let queue = Queue::new(3);
    let displaced: Vec<_> = (0..5).map(|n| queue.push(n)).collect();
    assert_eq!(displaced, [None, None, None, Some(0), Some(1)]);
    assert_eq!(queue.dropped(), 2);
    queue.close();
    let mut left = Vec::new();
    while let Some(n) = queue.pop().await {
        left.push(n);
    }
    assert_eq!(left, [2, 3, 4]);
}

#[tokio::test]
async fn a_waiting_reader_is_woken_by_an_item_and_by_the_end() {
    let queue = Arc::new(Queue::new(1));
    let reader = tokio::spawn({
        let queue = queue.clone();
        async move { (queue.pop().await, queue.pop().await) }
    });
    tokio::task::yield_now().await;
    assert_eq!(queue.push(7), None);
    tokio::task::yield_now().await;
    queue.close();
    assert_eq!(reader.await.unwrap(), (Some(7), None));
}

#[tokio::test]
async fn a_closed_queue_takes_nothing_in() {
    let queue = Queue::new(1);
    queue.close();
    assert_eq!(queue.push(1), Some(1));
    assert_eq!(queue.pop().await, None);
    assert_eq!(queue.dropped(), 0);
}

#[tokio::test]
async fn bytes_are_bounded_too_and_one_item_always_fits() {
    let queue = Queue::bounded(10, 8, Vec::len);
    for item in [vec![1; 4], vec![2; 4], vec![3; 3]] {
        queue.push(item);
    }
    assert_eq!(queue.dropped(), 1);
    assert_eq!(queue.push(vec![4; 100]), Some(vec![3; 3]));
    assert_eq!((queue.pop().await, queue.dropped()), (Some(vec![4; 100]), 3));
    queue.push(vec![5; 8]);
    assert_eq!((queue.pop().await, queue.dropped()), (Some(vec![5; 8]), 3));
}
