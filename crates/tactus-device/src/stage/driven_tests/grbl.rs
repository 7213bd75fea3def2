//! A controller that answers at once and moves at constant speed, with faults.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream};
use tokio::time::{Instant, sleep};

use crate::transport::memory::MemoryPort;

const BANNER: &str = "Grbl 1.1h ['$' for help]\r\n";

/// What it does wrong when told to move.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Fault {
    None,
    /// Stands idle a millimetre short of the target.
    StopsShort,
    /// Arrives and goes on saying that it moves.
    NeverIdle,
    /// Hits a hard limit.
    HardLimit,
    /// Resets itself.
    Resets,
    /// Says nothing more.
    FallsSilent,
    /// Takes a tenth of a second to tell its modes.
    TellsSlowly,
}

/// What the test and the controller share.
#[derive(Debug, Clone)]
pub(super) struct Shared(Arc<Mutex<State>>);

#[derive(Debug)]
struct State {
    fault: Fault,
    heard: Vec<(Instant, String)>,
    from_mm: [f64; 3],
    to_mm: [f64; 3],
    set_out: Instant,
    feed_mm_per_min: f64,
    held: bool,
    locked: bool,
    silent: bool,
}

impl Shared {
    pub(super) fn new() -> Self {
        Self(Arc::new(Mutex::new(State {
            fault: Fault::None,
            heard: Vec::new(),
            from_mm: [0.0; 3],
            to_mm: [0.0; 3],
            set_out: Instant::now(),
            feed_mm_per_min: 60.0,
            held: false,
            locked: false,
            silent: false,
        })))
    }

    pub(super) fn set(&self, fault: Fault) {
        self.0.lock().unwrap().fault = fault;
    }

    /// Says nothing more until it is reset.
    pub(super) fn fall_silent(&self) {
        self.0.lock().unwrap().silent = true;
    }

    /// Puts it somewhere by hand.
    pub(super) fn place(&self, at_mm: [f64; 3]) {
        self.0.lock().unwrap().stand(at_mm);
    }

    /// When a byte or line was heard first.
    pub(super) fn first_heard(&self, what: &str) -> Option<Instant> {
        self.0.lock().unwrap().heard.iter().find(|(_, heard)| heard == what).map(|(at, _)| *at)
    }

    /// How many lines began so.
    pub(super) fn count(&self, beginning: &str) -> usize {
        self.0.lock().unwrap().heard.iter().filter(|(_, heard)| heard.starts_with(beginning)).count()
    }

    /// Where it truly stands.
    pub(super) fn position_mm(&self) -> [f64; 3] {
        self.0.lock().unwrap().position_mm()
    }
}

/// Serves one connection after the other.
pub(super) async fn run(mut port: MemoryPort, shared: Shared) {
    loop {
        serve(port.accept().await, &shared).await;
    }
}

/// Serves until the host goes.
pub(super) async fn serve(mut stream: DuplexStream, shared: &Shared) {
    let mut line = String::new();
    let mut buffer = [0; 64];
    while let Ok(count @ 1..) = stream.read(&mut buffer).await {
        for byte in &buffer[..count] {
            let reply = match byte {
                b'?' | b'!' | 0x18 => shared.0.lock().unwrap().hear_byte(*byte),
                b'\n' => shared.0.lock().unwrap().hear_line(&std::mem::take(&mut line)),
                _ => {
                    line.push(char::from(*byte));
                    String::new()
                }
            };
            if reply.starts_with("[GC:") && shared.0.lock().unwrap().fault == Fault::TellsSlowly {
                sleep(Duration::from_millis(100)).await;
            }
            if stream.write_all(reply.as_bytes()).await.is_err() {
                return;
            }
        }
    }
}

impl State {
    fn hear_byte(&mut self, byte: u8) -> String {
        self.heard.push((Instant::now(), char::from(byte).to_string()));
        if byte == b'!' && !self.locked {
            self.stand(self.position_mm());
            self.held = true;
        }
        if byte == 0x18 {
            self.stand(self.position_mm());
            (self.held, self.silent, self.fault) = (false, false, Fault::None);
            return BANNER.to_owned();
        }
        if byte == b'!' || self.silent { String::new() } else { self.status() }
    }

    fn hear_line(&mut self, line: &str) -> String {
        self.heard.push((Instant::now(), line.to_owned()));
        match line {
            // Some firmware reports by itself, and nobody has asked for that.
            "$I" => return format!("{}[VER:1.1h.20190830:]\r\nok\r\n", self.status()),
            "$$" => return "$20=1\r\n$22=1\r\n$23=3\r\n$100=250.000\r\nok\r\n".to_owned(),
            "$X" => self.locked = false,
            "$H" => {
                self.stand([1.0, 1.0, 5.0]);
                self.locked = false;
            }
            "$G" => {
                return format!(
                    "[GC:G1 G54 G17 G21 G91 G94 M5 M9 T0 F{:.0} S0]\r\nok\r\n",
                    self.feed_mm_per_min
                );
            }
            _ if self.locked => return "error:9\r\n".to_owned(),
            _ if line.starts_with("G91") => {
                let feed = line.split_once('F').and_then(|(_, feed)| feed.parse().ok());
                self.feed_mm_per_min = feed.unwrap();
            }
            _ => return self.set_out(line),
        }
        "ok\r\n".to_owned()
    }

    fn set_out(&mut self, line: &str) -> String {
        let word = |letter| {
            let (_, rest) = line.split_once(letter)?;
            let end = rest.find(|c: char| c.is_ascii_uppercase()).unwrap_or(rest.len());
            Some(rest[..end].parse::<f64>().unwrap())
        };
        let is_absolute = line.starts_with("G53");
        self.from_mm = self.position_mm();
        self.to_mm = self.from_mm;
        for (place, letter) in self.to_mm.iter_mut().zip(['X', 'Y', 'Z']) {
            let from = if is_absolute { 0.0 } else { *place };
            *place = word(letter).map_or(*place, |number| from + number);
        }
        self.set_out = Instant::now();
        match self.fault {
            Fault::None | Fault::NeverIdle | Fault::TellsSlowly => {}
            Fault::StopsShort => self.to_mm[0] -= 1.0,
            Fault::HardLimit => {
                self.locked = true;
                self.stand(self.from_mm);
                return "ok\r\nALARM:1\r\n".to_owned();
            }
            Fault::Resets => {
                self.stand(self.from_mm);
                return format!("ok\r\n{BANNER}");
            }
            Fault::FallsSilent => self.silent = true,
        }
        "ok\r\n".to_owned()
    }

    fn stand(&mut self, at_mm: [f64; 3]) {
        (self.from_mm, self.to_mm) = (at_mm, at_mm);
    }

    fn status(&self) -> String {
        let [x, y, z] = self.position_mm();
        let moves = self.fault == Fault::NeverIdle || self.set_out.elapsed() < self.duration();
        let state = match (self.locked, self.held, moves && self.from_mm != self.to_mm) {
            (true, _, _) => "Alarm",
            (_, true, _) => "Hold:0",
            (_, _, true) => "Run",
            _ => "Idle",
        };
        format!("<{state}|MPos:{x:.3},{y:.3},{z:.3}|FS:0,0>\r\n")
    }

    fn duration(&self) -> Duration {
        let squares: f64 = self.from_mm.iter().zip(self.to_mm).map(|(a, b)| (a - b) * (a - b)).sum();
        Duration::from_secs_f64(squares.sqrt() * 60.0 / self.feed_mm_per_min)
    }

    fn position_mm(&self) -> [f64; 3] {
        let duration_s = self.duration().as_secs_f64();
        let share =
            if duration_s > 0.0 { (self.set_out.elapsed().as_secs_f64() / duration_s).min(1.0) } else { 1.0 };
        std::array::from_fn(|axis| self.from_mm[axis] + share * (self.to_mm[axis] - self.from_mm[axis]))
    }
}
