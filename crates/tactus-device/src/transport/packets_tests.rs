use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};

use tokio::io::{AsyncReadExt, AsyncWriteExt};

use super::*;

/// Gives what it is told; ends when nobody tells it any more.
struct Scripted {
    script: Receiver<io::Result<Option<Vec<u8>>>>,
    held_up: Arc<AtomicUsize>,
}

impl PacketSource for Scripted {
    fn next(&mut self) -> io::Result<Option<Vec<u8>>> {
        self.script.recv().unwrap_or_else(|_| Err(io::ErrorKind::BrokenPipe.into()))
    }

    fn was_held_up(&mut self) {
        self.held_up.fetch_add(1, Ordering::SeqCst);
    }
}

#[derive(Clone, Default)]
struct Written(Arc<Mutex<Vec<Vec<u8>>>>);

impl PacketSink for Written {
    fn send(&mut self, packet: &[u8]) -> io::Result<()> {
        if packet == b"refuse" {
            return Err(io::ErrorKind::TimedOut.into());
        }
        self.0.lock().unwrap().push(packet.to_vec());
        Ok(())
    }
}

struct Bench {
    script: Sender<io::Result<Option<Vec<u8>>>>,
    stream: PacketStream,
    held_up: Arc<AtomicUsize>,
    last: LastReader,
}

fn bench(sink: Option<Box<dyn PacketSink>>) -> Bench {
    let ((script, told), last) = (channel(), LastReader::default());
    let held_up = Arc::<AtomicUsize>::default();
    let source = Scripted { script: told, held_up: held_up.clone() };
    let stream = stream("toy", source, sink, &last).unwrap();
    Bench { script, stream, held_up, last }
}

impl Bench {
    fn tell(&self, packet: &[u8]) {
        self.script.send(Ok(Some(packet.to_vec()))).unwrap();
    }
}

#[tokio::test]
async fn each_packet_is_one_read() {
    let mut bench = bench(None);
    for packet in [b"one".as_slice(), b"", b"two", b"three"] {
        bench.tell(packet);
    }
    bench.script.send(Ok(None)).unwrap();
    bench.tell(b"four");
    let mut buffer = [0; 64];
    for packet in [b"one".as_slice(), b"two", b"three", b"four"] {
        let count = bench.stream.read(&mut buffer).await.unwrap();
        assert_eq!(&buffer[..count], packet);
    }
}

#[tokio::test]
async fn of_a_packet_that_is_too_long_the_rest_comes_next() {
    let mut bench = bench(None);
    bench.tell(b"abcde");
    bench.tell(b"f");
    let mut buffer = [0; 3];
    for piece in [b"abc".as_slice(), b"de", b"f"] {
        let count = bench.stream.read(&mut buffer).await.unwrap();
        assert_eq!(&buffer[..count], piece);
    }
}

/// Packets in a row, until somebody has been held up once too often.
struct Numbered {
    next: u32,
    given: Sender<u32>,
    held_up: Arc<AtomicUsize>,
}

impl PacketSource for Numbered {
    fn next(&mut self) -> io::Result<Option<Vec<u8>>> {
        self.next += 1;
        self.given.send(self.next).map_err(io::Error::other)?;
        Ok(Some(self.next.to_le_bytes().to_vec()))
    }

    fn was_held_up(&mut self) {
        self.held_up.fetch_add(1, Ordering::SeqCst);
    }
}

#[tokio::test]
async fn a_slow_reader_gets_every_packet_in_order() {
    let ((given, count), held_up) = (channel(), Arc::<AtomicUsize>::default());
    let source = Numbered { next: 0, given, held_up: held_up.clone() };
    let mut stream = stream("toy", source, None, &LastReader::default()).unwrap();
    let full = u32::try_from(PACKETS_MAX).unwrap() + 1;
    // So many are read before anybody takes one, and no more: the last waits for room.
    for number in 1..=full {
        assert_eq!(count.recv().unwrap(), number);
    }
    let mut packet = [0; 4];
    for number in 1..=4 * full {
        assert_eq!(stream.read(&mut packet).await.unwrap(), 4);
        assert_eq!(u32::from_le_bytes(packet), number);
    }
    assert!(held_up.load(Ordering::SeqCst) > 0, "the source was not told that it had been held up");
}

#[tokio::test]
async fn a_link_that_breaks_gives_what_was_read_then_the_error_then_the_end() {
    let mut bench = bench(None);
    bench.tell(b"last");
    bench.script.send(Err(io::ErrorKind::NotConnected.into())).unwrap();
    let mut buffer = [0; 8];
    assert_eq!(bench.stream.read(&mut buffer).await.unwrap(), 4);
    let error = bench.stream.read(&mut buffer).await.unwrap_err();
    assert_eq!(error.kind(), io::ErrorKind::NotConnected);
    assert_eq!(bench.stream.read(&mut buffer).await.unwrap(), 0);
    assert_eq!(bench.held_up.load(Ordering::SeqCst), 0);
}

#[test]
fn a_dropped_stream_ends_its_thread() {
    let Bench { script, stream, last, .. } = bench(None);
    assert_eq!(last.wait(), Err(StillOpen));
    drop(stream);
    // The read in hand ends without a packet; there is no other after it.
    script.send(Ok(None)).unwrap();
    assert_eq!(last.wait(), Ok(()));
    assert!(script.send(Ok(None)).is_err(), "the source is still there");
    assert_eq!(last.wait(), Ok(()));
}

#[test]
fn a_dropped_stream_ends_a_thread_that_waits_for_room() {
    let ((given, count), last) = (channel(), LastReader::default());
    let source = Numbered { next: 0, given, held_up: Arc::default() };
    let stream = stream("toy", source, None, &last).unwrap();
    for _ in 0..=PACKETS_MAX {
        count.recv().unwrap();
    }
    drop(stream);
    assert_eq!(last.wait(), Ok(()));
}

#[tokio::test]
async fn each_write_is_one_packet() {
    let written = Written::default();
    let mut bench = bench(Some(Box::new(written.clone())));
    bench.stream.write_all(b"first").await.unwrap();
    bench.stream.write_all(b"second").await.unwrap();
    bench.stream.flush().await.unwrap();
    assert_eq!(*written.0.lock().unwrap(), [b"first".to_vec(), b"second".to_vec()]);
}

#[tokio::test]
async fn a_packet_that_was_not_taken_is_told_and_the_next_is_written() {
    let written = Written::default();
    let mut bench = bench(Some(Box::new(written.clone())));
    bench.stream.write_all(b"refuse").await.unwrap();
    let error = bench.stream.write_all(b"lost").await.unwrap_err();
    assert_eq!(error.kind(), io::ErrorKind::TimedOut);
    bench.stream.write_all(b"again").await.unwrap();
    bench.stream.flush().await.unwrap();
    assert_eq!(*written.0.lock().unwrap(), [b"again".to_vec()]);
}

#[tokio::test]
async fn what_is_only_read_cannot_be_written() {
    let mut bench = bench(None);
    let error = bench.stream.write_all(b"?").await.unwrap_err();
    assert_eq!(error.kind(), io::ErrorKind::Unsupported);
    assert!(error.to_string().contains("endpoint_out"), "{error}");
}
