//! The devices of all rigs. They are not what is measured, so they cost little: one thread serves them, and sensors that
//! sample at the same time send the same bytes.

use std::io::{self, Read as _, Write as _};
use std::net::{TcpListener, TcpStream};
use std::os::fd::{AsFd, OwnedFd};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use anyhow::Result;
use rustix::buffer::spare_capacity;
use rustix::event::Timespec;
use rustix::event::epoll::{self, CreateFlags, EventData, EventFlags};
use tactus_virtual::VirtualStage;
use tactus_virtual::cable::Device as _;
use tactus_wire::weiss::{
    ControllerInfo, Decoder, ErrorCode, HostCommand, MatrixInfo, SensorInfo, acknowledge, encode_frame, id,
};
use tokio::time::Instant;

use super::sent::{SLOTS, SentTimes, slot};

/// Events that one call of the system returns at most.
const EVENTS_MAX: usize = 256;
const ROWS: u8 = 6;
const COLS: u8 = 8;
const ELEMENTS: usize = 48;
/// Reading of an element that nothing presses, in counts; noise is added.
const BASELINE_COUNTS: u16 = 100;

/// Devices that are served until this is dropped.
#[derive(Debug)]
pub struct Devices {
    /// Addresses of each rig's sensor and stage.
    pub(super) addresses: Vec<[String; 2]>,
    pub(super) sent: Arc<SentTimes>,
    /// So many of the first rigs have no devices any more.
    dead: Arc<AtomicUsize>,
    ends: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

/// The thread's state.
struct Server {
    epoll: OwnedFd,
    ports: Vec<Port>,
    /// When each port's device has something to do.
    wakes: Vec<Option<Instant>>,
    sent: Arc<SentTimes>,
    dead: Arc<AtomicUsize>,
    ends: Arc<AtomicBool>,
}

/// A device and where its host connects.
struct Port {
    listener: TcpListener,
    line: Option<TcpStream>,
    device: Device,
}

enum Device {
    Sensor(Sensor),
    Stage(Box<VirtualStage>),
}

/// A `weiss-dsa` controller.
#[derive(Default)]
struct Sensor {
    heard: Decoder,
    acquires: bool,
}

impl Devices {
    /// Serves a sensor and the stage of each rig at ports of their own on loopback.
    pub(super) fn start(stages: Vec<VirtualStage>) -> Result<Self> {
        let (dead, ends) = (Arc::<AtomicUsize>::default(), Arc::<AtomicBool>::default());
        let sent = Arc::new(SentTimes::new(stages.len()));
        let mut server = Server {
            epoll: epoll::create(CreateFlags::CLOEXEC)?,
            ports: Vec::new(),
            wakes: Vec::new(),
            sent: Arc::clone(&sent),
            dead: Arc::clone(&dead),
            ends: Arc::clone(&ends),
        };
        let mut addresses = Vec::new();
        for stage in stages {
            let sensor = server.listen(Device::Sensor(Sensor::default()))?;
            addresses.push([sensor, server.listen(Device::Stage(Box::new(stage)))?]);
        }
        let thread = thread::Builder::new().name("devices".into()).spawn(move || server.serve())?;
        Ok(Self { addresses, sent, dead, ends, thread: Some(thread) })
    }

    /// Addresses of the sensors.
    pub fn sensors(&self) -> Vec<&str> {
        self.addresses.iter().map(|[sensor, _]| sensor.as_str()).collect()
    }

    /// Both devices of the first rigs hang up, and take no call any more.
    pub(super) fn kill(&self, rigs: usize) {
        self.dead.store(rigs, Ordering::Relaxed);
    }
}

impl Drop for Devices {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // A device that broke off has sent no frames, which was counted.
            drop(thread.join());
        }
    }
}

impl Server {
    fn listen(&mut self, device: Device) -> Result<String> {
        let listener = TcpListener::bind("127.0.0.1:0")?;
        listener.set_nonblocking(true)?;
        let address = listener.local_addr()?.to_string();
        watch(&self.epoll, &listener, self.ports.len(), false)?;
        self.ports.push(Port { listener, line: None, device });
        self.wakes.push(None);
        Ok(address)
    }

    fn serve(mut self) {
        let slot = slot();
        let began = Instant::now();
        for number in 0_u32.. {
            if self.ends.load(Ordering::Relaxed) {
                return;
            }
            self.attend_until(began + slot * number);
            let dead = self.dead();
            for port in self.ports.iter_mut().take(dead) {
                port.line = None;
            }
            self.send_frames(number, slot * number);
            self.wake_stages(Instant::now());
        }
    }

    /// Answers hosts until it is time to sample.
    fn attend_until(&mut self, due: Instant) {
        let mut events = Vec::<epoll::Event>::with_capacity(EVENTS_MAX);
        loop {
            let left = due.saturating_duration_since(Instant::now());
            let timeout = Timespec::try_from(left).unwrap_or_default();
            if epoll::wait(&self.epoll, spare_capacity(&mut events), Some(&timeout)).is_err() {
                // A signal.
                continue;
            }
            for event in events.drain(..) {
                let (number, is_line) = (event.data.u64() / 2, event.data.u64() % 2 == 1);
                if let Ok(number) = usize::try_from(number) {
                    self.attend(number, is_line);
                }
            }
            if left.is_zero() {
                return;
            }
        }
    }

    /// Number of the first ports whose device is dead.
    fn dead(&self) -> usize {
        2 * self.dead.load(Ordering::Relaxed)
    }

    fn attend(&mut self, number: usize, is_line: bool) {
        let is_dead = number < self.dead();
        let Some(port) = self.ports.get_mut(number) else { return };
        if !is_line {
            // Whoever calls a dead one is hung up on.
            port.line = port.accept(&self.epoll, number).ok().filter(|_| !is_dead);
            return;
        }
        if !port.hear() {
            port.line = None;
        }
        if let (Device::Stage(stage), Some(wake)) = (&port.device, self.wakes.get_mut(number)) {
            *wake = stage.next_wake();
        }
    }

    /// Sends the frame of this time of sampling from all its sensors.
    fn send_frames(&mut self, number: u32, at: Duration) {
        let counts: [u16; ELEMENTS] = std::array::from_fn(|element| {
            // Two counts of noise, without a pattern that compression could use.
            let mixed = (u64::from(number) * 64 + element as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15);
            BASELINE_COUNTS + u16::try_from(mixed >> 62).unwrap_or_default()
        });
        let ms = u32::try_from(at.as_millis()).unwrap_or(u32::MAX);
        let frame = encode_frame(ms, &counts, false);
        // Every second port is a sensor's.
        let first = (number % SLOTS) as usize;
        let sensors = self.ports.iter_mut().step_by(2).enumerate();
        for (sensor, port) in sensors.skip(first).step_by(SLOTS as usize) {
            if let Device::Sensor(Sensor { acquires: true, .. }) = port.device {
                self.sent.note(sensor, number);
                port.say(&frame);
            }
        }
    }

    fn wake_stages(&mut self, now: Instant) {
        for (port, wake) in self.ports.iter_mut().zip(&mut self.wakes) {
            if wake.is_some_and(|wake| wake <= now)
                && let Device::Stage(stage) = &mut port.device
            {
                stage.wake(now);
                let bytes = stage.output(now);
                *wake = stage.next_wake();
                port.say(&bytes);
            }
        }
    }
}

impl Port {
    fn accept(&self, epoll: &OwnedFd, number: usize) -> io::Result<TcpStream> {
        let (line, _) = self.listener.accept()?;
        line.set_nonblocking(true)?;
        line.set_nodelay(true)?;
        watch(epoll, &line, number, true)?;
        Ok(line)
    }

    /// Answers what the host says; false once it has hung up.
    fn hear(&mut self) -> bool {
        let mut buffer = [0; 1024];
        let Some(line) = &mut self.line else { return true };
        let bytes = match line.read(&mut buffer) {
            Ok(0) => return false,
            Ok(count) => buffer.get(..count).unwrap_or_default(),
            Err(error) => return error.kind() == io::ErrorKind::WouldBlock,
        };
        let answer = match &mut self.device {
            Device::Sensor(sensor) => sensor.answer(bytes),
            Device::Stage(stage) => {
                let now = Instant::now();
                stage.receive(bytes, now);
                stage.wake(now);
                stage.output(now)
            }
        };
        self.say(&answer);
        true
    }

    /// Sends bytes; what a host that does not read has no room for is lost, as at a serial port.
    fn say(&mut self, bytes: &[u8]) {
        if let Some(line) = self.line.as_mut().filter(|_| !bytes.is_empty()) {
            // The host may have hung up.
            drop(line.write(bytes));
        }
    }
}

impl Sensor {
    fn answer(&mut self, bytes: &[u8]) -> Vec<u8> {
        self.heard.push(bytes);
        let mut answer = Vec::new();
        while let Some(packet) = self.heard.next_packet() {
            let Some(command) = packet.ok().and_then(|packet| HostCommand::parse(&packet).ok()) else {
                continue;
            };
            answer.extend(match command {
                HostCommand::QueryController => ControllerInfo::default().encode(),
                HostCommand::QuerySensor => SensorInfo { matrices: 1, ..SensorInfo::default() }.encode(),
                HostCommand::QueryMatrix { .. } => {
                    MatrixInfo { cells_x: COLS.into(), cells_y: ROWS.into(), ..MatrixInfo::default() }
                        .encode()
                }
                HostCommand::Acquire { run, .. } => {
                    self.acquires = run;
                    acknowledge(id::ACQUIRE, ErrorCode::SUCCESS)
                }
            });
        }
        answer
    }
}

/// Has the system say when somebody connects to a port, or writes to its line.
fn watch(epoll: &OwnedFd, source: impl AsFd, number: usize, is_line: bool) -> io::Result<()> {
    let data = EventData::new_u64(2 * number as u64 + u64::from(is_line));
    Ok(epoll::add(epoll, source, data, EventFlags::IN)?)
}
