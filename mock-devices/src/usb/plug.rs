//! A USB device on its cable: plugged into the kernel, pulled out, plugged in again.

use futures_util::FutureExt;
use futures_util::future::select_all;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::UnixStream;
use tokio::sync::{mpsc, oneshot};
use tokio::time::{Instant, sleep_until};

use super::behind::Behind;
use super::command::{Command, CommandError};
use super::gadget::Gadget;
use super::peer::Peer;
use super::vhci::{Vhci, VhciError, Wish};
use crate::faults::CableFault;

/// Something is to be done to a function or to the plug.
#[derive(Debug)]
pub(super) struct Order {
    pub(super) function: usize,
    pub(super) command: Command,
    /// Told when it is done.
    pub(super) done: oneshot::Sender<Result<(), CommandError>>,
}

/// A USB device with its cable.
pub(super) struct Plug {
    vhci: Vhci,
    /// A device that has just got power.
    make: Box<dyn Fn() -> Gadget + Send>,
    /// Behind each function, one.
    behind: Vec<Behind>,
    orders: mpsc::Receiver<Order>,
    link: Link,
    /// Where it was last.
    port: u32,
}

enum Link {
    In(Box<Connection>),
    /// Pulled out; it goes in again then, or when it is told to.
    Out(Option<Instant>),
}

struct Connection {
    peer: Peer,
    stream: UnixStream,
}

enum Event {
    Bytes(usize),
    /// The kernel let go of the device.
    Closed,
    /// It is time to plug it in again.
    Replug,
    Ordered(Order),
    Cable(CableFault),
    Struck,
    Woken,
}

impl Plug {
    /// Plugs a device in; behind each of its functions there is to be one device.
    ///
    /// # Errors
    /// If the system refuses.
    pub(super) async fn new(
        vhci: Vhci,
        make: Box<dyn Fn() -> Gadget + Send>,
        behind: Vec<Behind>,
        orders: mpsc::Receiver<Order>,
    ) -> Result<Self, VhciError> {
        let mut plug = Self { vhci, make, behind, orders, link: Link::Out(None), port: 0 };
        plug.plug_in(Wish::Any).await?;
        Ok(plug)
    }

    /// The port in which it is.
    pub(super) fn port(&self) -> u32 {
        self.port
    }

    /// Runs for ever: the devices' time goes on whether or not they are plugged in.
    ///
    /// # Errors
    /// If it cannot be plugged in again.
    pub(super) async fn run(mut self) -> Result<(), VhciError> {
        let mut buffer = vec![0; 16 * 1024];
        loop {
            self.settle(Instant::now());
            let is_up = self.flush().await;
            let event = if is_up { self.next_event(&mut buffer).await } else { Event::Closed };
            let now = Instant::now();
            match event {
                Event::Bytes(count) => self.receive(buffer.get(..count).unwrap_or_default(), now),
                Event::Closed => self.pull_out(None),
                Event::Replug => self.plug_in_again(Wish::Port(self.port)).await?,
                Event::Cable(CableFault::Disconnect(duration)) => self.pull_out(Some(now + duration)),
                Event::Cable(CableFault::Renumber) => {
                    self.pull_out(None);
                    self.plug_in_again(Wish::NotPort(self.port)).await?;
                }
                Event::Ordered(Order { function, command, done }) => {
                    let outcome = self.obey(function, command, now).await;
                    // Whoever ordered may have gone meanwhile.
                    drop(done.send(outcome));
                }
                Event::Struck | Event::Woken => {}
            }
        }
    }

    /// Lets the devices and the peer do what they can do now.
    fn settle(&mut self, now: Instant) {
        let Link::In(connection) = &mut self.link else {
            for device in &mut self.behind {
                // What leaves a device that is not plugged in is lost.
                drop(device.wake(now));
            }
            return;
        };
        let peer = &mut connection.peer;
        loop {
            for (function, device) in self.behind.iter_mut().enumerate() {
                let bytes = device.wake(now);
                if !bytes.is_empty() {
                    peer.send(function, &bytes, now);
                }
            }
            let heard = peer.take_heard();
            if heard.is_empty() {
                break;
            }
            for (function, bytes) in heard {
                if let Some(device) = self.behind.get_mut(function) {
                    device.receive(&bytes, now);
                }
            }
        }
        peer.wake(now);
    }

    /// Sends the kernel its answers; false if it has gone.
    async fn flush(&mut self) -> bool {
        let Link::In(connection) = &mut self.link else { return true };
        let answers = connection.peer.take_answers();
        // The kernel always reads.
        connection.stream.write_all(&answers).await.is_ok()
    }

    fn receive(&mut self, bytes: &[u8], now: Instant) {
        let Link::In(connection) = &mut self.link else { return };
        if let Err(error) = connection.peer.receive(bytes, now) {
            tracing::error!(%error, "the device is pulled out");
            self.pull_out(None);
        }
    }

    /// Waits for what happens next. Cancel-safe.
    async fn next_event(&mut self, buffer: &mut [u8]) -> Event {
        let wakes = self.behind.iter().filter_map(Behind::next_wake).min();
        let (wake, listening) = match &mut self.link {
            Link::In(connection) => {
                let wake = [wakes, connection.peer.next_wake()].into_iter().flatten().min();
                (wake, Ok(&mut connection.stream))
            }
            Link::Out(until) => (wakes, Err(*until)),
        };
        let strikes = select_all(self.behind.iter_mut().map(|device| device.struck().boxed()));
        tokio::select! {
            biased;
            Some(order) = self.orders.recv() => Event::Ordered(order),
            (fault, _, _) = strikes => fault.map_or(Event::Struck, Event::Cable),
            event = listen(listening, buffer) => event,
            () = until(wake) => Event::Woken,
        }
    }

    async fn obey(&mut self, function: usize, command: Command, now: Instant) -> Result<(), CommandError> {
        let refused = |error: VhciError| CommandError::Refused(error.to_string());
        match (command, &mut self.link) {
            (Command::Unplug, Link::In(_)) => self.pull_out(None),
            (Command::Plug, Link::Out(_)) => {
                self.plug_in_again(Wish::Port(self.port)).await.map_err(refused)?;
            }
            (Command::PlugElsewhere, Link::Out(_)) => {
                self.plug_in_again(Wish::NotPort(self.port)).await.map_err(refused)?;
            }
            (Command::Halt, Link::In(connection)) => connection.peer.halt(function, now),
            (Command::Slow(slowness), Link::In(connection)) => {
                connection.peer.slow_down(function, slowness, now);
            }
            (Command::Plug | Command::PlugElsewhere, Link::In(_)) => return Err(CommandError::Plugged),
            (Command::Unplug | Command::Halt | Command::Slow(_), Link::Out(_)) => {
                return Err(CommandError::NotPlugged);
            }
        }
        Ok(())
    }

    fn pull_out(&mut self, until: Option<Instant>) {
        if let Link::In(connection) = &self.link {
            let lost = connection.peer.lost();
            tracing::info!(port = self.port, packets_nobody_fetched = lost, "unplugged");
        }
        self.link = Link::Out(until);
    }

    async fn plug_in_again(&mut self, wish: Wish) -> Result<(), VhciError> {
        self.plug_in(wish).await?;
        let now = Instant::now();
        for device in &mut self.behind {
            device.plugged_in(now);
        }
        Ok(())
    }

    async fn plug_in(&mut self, wish: Wish) -> Result<(), VhciError> {
        let gadget = (self.make)();
        let (port, stream) = self.vhci.plug_in(wish, gadget.speed()).await?;
        tracing::info!(port, "plugged in");
        self.port = port;
        self.link = Link::In(Box::new(Connection { peer: Peer::new(gadget), stream }));
        Ok(())
    }
}

/// Waits for bytes from the kernel, or until it is time to plug the device in again. Cancel-safe.
async fn listen(listening: Result<&mut UnixStream, Option<Instant>>, buffer: &mut [u8]) -> Event {
    match listening {
        Ok(stream) => match stream.read(buffer).await {
            Ok(0) | Err(_) => Event::Closed,
            Ok(count) => Event::Bytes(count),
        },
        Err(replug) => {
            until(replug).await;
            Event::Replug
        }
    }
}

async fn until(instant: Option<Instant>) {
    match instant {
        Some(instant) => sleep_until(instant).await,
        None => std::future::pending().await,
    }
}
