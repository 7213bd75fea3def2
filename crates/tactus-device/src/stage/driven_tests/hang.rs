//! A driver that hangs or panics in a move.

use std::fmt;
use std::io;
use std::pin::Pin;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::task::{Context, Poll};
use std::time::Duration;

use futures_util::FutureExt;
use futures_util::future::BoxFuture;
use tactus_schema::pb::StageStatus;
use tactus_schema::rig::{GrblAxes, StageProtocol};
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::time::sleep;

use super::fake::{self, Shared};
use super::{OPTIONS, drain, homing, permit, to, until};
use crate::stage::guard::tests::Device;
use crate::transport::memory::{MemoryConnector, pair};
use crate::transport::{ByteStream, Connect};
use crate::{Clock, DeviceError, Stage, StageError};

/// What the next read does.
enum Trouble {
    /// Blocks its thread until the other end is dropped.
    Hang(Receiver<()>),
    Panic,
}

/// What the next read does, and all that the driver has sent.
#[derive(Clone, Default)]
struct Next {
    trouble: Arc<Mutex<Option<Trouble>>>,
    sent: Arc<Mutex<Vec<u8>>>,
}

/// A link whose reads hang or panic when they are told to.
struct Troubled {
    inner: MemoryConnector,
    next: Next,
    /// What the guard wrote.
    written: Sender<Vec<u8>>,
}

struct TroubledStream {
    inner: Box<dyn ByteStream>,
    next: Next,
    written: Sender<Vec<u8>>,
}

impl fmt::Display for Troubled {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.inner.fmt(f)
    }
}

impl Connect for Troubled {
    fn connect(&self) -> BoxFuture<'_, Result<Box<dyn ByteStream>, DeviceError>> {
        async {
            let inner = self.inner.connect().await?;
            let stream = TroubledStream { inner, next: self.next.clone(), written: self.written.clone() };
            Ok(Box::new(stream) as Box<dyn ByteStream>)
        }
        .boxed()
    }
}

impl ByteStream for TroubledStream {
    fn second_writer(&self) -> Option<Box<dyn io::Write + Send>> {
        Some(Box::new(Device(self.written.clone())))
    }
}

impl AsyncRead for TroubledStream {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let trouble = self.next.trouble.lock().unwrap().take();
        match trouble {
            Some(Trouble::Hang(released)) => assert!(released.recv().is_err()),
            Some(Trouble::Panic) => panic!("a driver that panics, for a test"),
            None => {}
        }
        Pin::new(&mut self.inner).poll_read(context, buffer)
    }
}

impl AsyncWrite for TroubledStream {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        self.next.sent.lock().unwrap().extend_from_slice(bytes);
        Pin::new(&mut self.inner).poll_write(context, bytes)
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.inner).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.inner).poll_shutdown(context)
    }
}

/// A homed stage, its controller, what its link does next, and what the guard writes.
async fn homed(clock: Clock) -> (Arc<super::DrivenStage>, Shared, Next, Receiver<Vec<u8>>) {
    let (inner, port) = pair("stage");
    let (written, guarded) = channel();
    let next = Next::default();
    let link = Troubled { inner, next: next.clone(), written };
    let protocol = StageProtocol::Grbl(GrblAxes::default());
    let (stage, reports) = super::DrivenStage::start(Box::new(link), &protocol, OPTIONS, clock);
    let shared = Shared::new();
    tokio::spawn(fake::run(port, shared.clone()));
    tokio::spawn(drain(reports));
    until(&stage, StageStatus::Unhomed).await;
    stage.home(homing()).await.unwrap();
    (stage, shared, next, guarded)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 3)]
async fn a_driver_that_hangs_in_a_move_is_stopped_for_by_the_guard() {
    let (stage, shared, next, guarded) = homed(Clock::real()).await;
    let moving = tokio::spawn({
        let stage = Arc::clone(&stage);
        async move { stage.move_to(permit(to(21.0, 1.0))).await }
    });
    until(&stage, StageStatus::Moving).await;
    let (release, released) = channel::<()>();
    *next.trouble.lock().unwrap() = Some(Trouble::Hang(released));
    let written = tokio::task::spawn_blocking(move || guarded.recv_timeout(Duration::from_mins(1)).unwrap())
        .await
        .unwrap();
    assert_eq!(written, b"!");
    drop(release);
    // Alive again, the driver stops the move itself.
    let result = moving.await.unwrap();
    assert!(matches!(result, Err(StageError::Unwatched { .. })), "{result:?}");
    assert!(shared.first_heard("!").is_some());
}

#[tokio::test(start_paused = true)]
async fn a_driver_that_panics_in_a_move_stops_the_stage_and_connects_anew() {
    let (stage, _shared, next, _guarded) = homed(Clock::paused()).await;
    let moving = tokio::spawn({
        let stage = Arc::clone(&stage);
        async move { stage.move_to(permit(to(21.0, 1.0))).await }
    });
    sleep(Duration::from_millis(500)).await;
    assert!(!next.sent.lock().unwrap().contains(&b'!'));
    *next.trouble.lock().unwrap() = Some(Trouble::Panic);
    let result = moving.await.unwrap();
    let Err(StageError::Device(error)) = result else { panic!("{result:?}") };
    assert!(error.to_string().contains("its driver panicked, and the stage was stopped"), "{error}");
    assert!(next.sent.lock().unwrap().ends_with(b"!"));
    until(&stage, StageStatus::Unhomed).await;
    stage.home(homing()).await.unwrap();
}
