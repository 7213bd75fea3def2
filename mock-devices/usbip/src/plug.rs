//! A USB device on its cable: plugged into the kernel, pulled out, plugged in again.

use std::fmt;

use futures_util::FutureExt;
use futures_util::future::select_all;
use tactus_virtual::faults::CableFault;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::UnixStream;
use tokio::sync::{mpsc, oneshot};
use tokio::time::{Instant, sleep_until};

use crate::backing::BackingDevice;
use crate::command::{PlugCommand, PlugCommandError};
use crate::descriptor::Speed;
use crate::function::FunctionKind;
use crate::gadget::Gadget;
use crate::identity::Identity;
use crate::peer::Peer;
use crate::vhci::{PortChoice, Vhci, VhciError};

/// An order for a function or the plug.
#[derive(Debug)]
pub struct Order {
    /// Index of the function, as given to [`Plug::new`].
    pub function: usize,
    /// Applies to the function; `plug` and `unplug` apply to the whole device.
    pub command: PlugCommand,
    /// Gets the outcome.
    pub done: oneshot::Sender<Result<(), PlugCommandError>>,
}

/// A USB device with its cable.
pub struct Plug {
    vhci: Vhci,
    /// Makes the device anew each time it is plugged in.
    make: Box<dyn Fn() -> Gadget + Send>,
    /// One per function.
    backing: Vec<BackingDevice>,
    orders: mpsc::Receiver<Order>,
    link: Link,
    /// Port of the virtual host controller at which it is, or was last.
    port: u32,
}

enum Link {
    In(Box<Connection>),
    /// Unplugged; plugged in again at this time, or by an order.
    Out(Option<Instant>),
}

struct Connection {
    peer: Peer,
    stream: UnixStream,
}

enum PlugEvent {
    Bytes(usize),
    /// The kernel released the device.
    Closed,
    /// It is time to plug it in again.
    Replug,
    Ordered(Order),
    Cable(CableFault),
    Faulted,
    Woken,
}

impl Plug {
    /// Plugs in a device of these functions, each with the virtual device behind it. The device runs at full speed if one
    /// of the functions does, else at high speed.
    ///
    /// # Errors
    /// If the system refuses.
    pub async fn new(
        vhci: Vhci,
        identity: Identity,
        functions: Vec<(FunctionKind, BackingDevice)>,
        orders: mpsc::Receiver<Order>,
    ) -> Result<Self, VhciError> {
        let (kinds, backing): (Vec<_>, Vec<_>) = functions.into_iter().unzip();
        let speed =
            if kinds.iter().any(|kind| kind.speed() == Speed::Full) { Speed::Full } else { Speed::High };
        let make = Box::new(move || {
            Gadget::new(identity.clone(), speed, kinds.iter().map(FunctionKind::function).collect())
        });
        let mut plug = Self { vhci, make, backing, orders, link: Link::Out(None), port: 0 };
        plug.plug_in(PortChoice::Any).await?;
        Ok(plug)
    }

    /// Port of the virtual host controller.
    pub fn port(&self) -> u32 {
        self.port
    }

    /// Runs forever, whether or not the device is plugged in.
    ///
    /// # Errors
    /// If it cannot be plugged in again.
    pub async fn run(mut self) -> Result<(), VhciError> {
        let mut buffer = vec![0; 16 * 1024];
        loop {
            self.settle(Instant::now());
            let is_up = self.flush().await;
            let event = if is_up { self.next_event(&mut buffer).await } else { PlugEvent::Closed };
            let now = Instant::now();
            match event {
                PlugEvent::Bytes(count) => self.receive(buffer.get(..count).unwrap_or_default(), now),
                PlugEvent::Closed => self.pull_out(None),
                PlugEvent::Replug => self.plug_in_again(PortChoice::Port(self.port)).await?,
                PlugEvent::Cable(CableFault::Disconnect(duration)) => self.pull_out(Some(now + duration)),
                PlugEvent::Cable(CableFault::Renumber) => {
                    self.pull_out(None);
                    self.plug_in_again(PortChoice::NotPort(self.port)).await?;
                }
                PlugEvent::Ordered(Order { function, command, done }) => {
                    let outcome = self.obey(function, command, now).await;
                    // The sender may have gone meanwhile.
                    drop(done.send(outcome));
                }
                PlugEvent::Faulted | PlugEvent::Woken => {}
            }
        }
    }

    /// Lets the devices and the peer do everything that is due.
    fn settle(&mut self, now: Instant) {
        let Link::In(connection) = &mut self.link else {
            for device in &mut self.backing {
                // Bytes of an unplugged device are lost.
                drop(device.wake(now));
            }
            return;
        };
        let peer = &mut connection.peer;
        loop {
            for (function, device) in self.backing.iter_mut().enumerate() {
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
                if let Some(device) = self.backing.get_mut(function) {
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
            tracing::error!(%error, "the device is unplugged");
            self.pull_out(None);
        }
    }

    /// Waits for the next event. Cancel-safe.
    async fn next_event(&mut self, buffer: &mut [u8]) -> PlugEvent {
        let wakes = self.backing.iter().filter_map(BackingDevice::next_wake).min();
        let (wake, listening) = match &mut self.link {
            Link::In(connection) => {
                let wake = [wakes, connection.peer.next_wake()].into_iter().flatten().min();
                (wake, Ok(&mut connection.stream))
            }
            Link::Out(until) => (wakes, Err(*until)),
        };
        let faults = select_all(self.backing.iter_mut().map(|device| device.next_cable_fault().boxed()));
        tokio::select! {
            biased;
            Some(order) = self.orders.recv() => PlugEvent::Ordered(order),
            (fault, _, _) = faults => fault.map_or(PlugEvent::Faulted, PlugEvent::Cable),
            event = listen(listening, buffer) => event,
            () = until(wake) => PlugEvent::Woken,
        }
    }

    async fn obey(
        &mut self,
        function: usize,
        command: PlugCommand,
        now: Instant,
    ) -> Result<(), PlugCommandError> {
        let refused = |error: VhciError| PlugCommandError::Refused(error.to_string());
        match (command, &mut self.link) {
            (PlugCommand::Unplug, Link::In(_)) => self.pull_out(None),
            (PlugCommand::Plug, Link::Out(_)) => {
                self.plug_in_again(PortChoice::Port(self.port)).await.map_err(refused)?;
            }
            (PlugCommand::PlugElsewhere, Link::Out(_)) => {
                self.plug_in_again(PortChoice::NotPort(self.port)).await.map_err(refused)?;
            }
            (PlugCommand::Halt, Link::In(connection)) => connection.peer.halt(function, now),
            (PlugCommand::Slow(slowness), Link::In(connection)) => {
                connection.peer.slow_down(function, slowness, now);
            }
            (PlugCommand::Plug | PlugCommand::PlugElsewhere, Link::In(_)) => {
                return Err(PlugCommandError::Plugged);
            }
            (PlugCommand::Unplug | PlugCommand::Halt | PlugCommand::Slow(_), Link::Out(_)) => {
                return Err(PlugCommandError::NotPlugged);
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

    async fn plug_in_again(&mut self, wish: PortChoice) -> Result<(), VhciError> {
        self.plug_in(wish).await?;
        let now = Instant::now();
        for device in &mut self.backing {
            device.plugged_in(now);
        }
        Ok(())
    }

    async fn plug_in(&mut self, wish: PortChoice) -> Result<(), VhciError> {
        let gadget = (self.make)();
        let (port, stream) = self.vhci.plug_in(wish, gadget.speed()).await?;
        tracing::info!(port, "plugged in");
        self.port = port;
        self.link = Link::In(Box::new(Connection { peer: Peer::new(gadget), stream }));
        Ok(())
    }
}

/// Waits for bytes from the kernel, or until it is time to plug the device in again. Cancel-safe.
async fn listen(listening: Result<&mut UnixStream, Option<Instant>>, buffer: &mut [u8]) -> PlugEvent {
    match listening {
        Ok(stream) => match stream.read(buffer).await {
            Ok(0) | Err(_) => PlugEvent::Closed,
            Ok(count) => PlugEvent::Bytes(count),
        },
        Err(replug) => {
            until(replug).await;
            PlugEvent::Replug
        }
    }
}

async fn until(instant: Option<Instant>) {
    match instant {
        Some(instant) => sleep_until(instant).await,
        None => std::future::pending().await,
    }
}

impl fmt::Debug for Plug {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Plug").field("port", &self.port).finish_non_exhaustive()
    }
}
