use tokio::io::{AsyncReadExt, AsyncWriteExt, duplex};
use tokio::time::Instant;

use super::*;

#[tokio::test(start_paused = true)]
async fn a_connection_whose_headers_never_end_is_closed() {
    let (mut client, server) = duplex(1024);
    client.write_all(b"GET / HTTP/1.1\r\nHost: 127.0.0.1").await.unwrap();
    let begun = Instant::now();
    answer(server, Router::new(), Arc::default()).await;
    assert_eq!(begun.elapsed().as_secs(), HEADER_TIMEOUT.as_secs());
    let mut said = Vec::new();
    client.read_to_end(&mut said).await.unwrap();
    assert!(!said.starts_with(b"HTTP/1.1 200"), "{said:?}");
}
