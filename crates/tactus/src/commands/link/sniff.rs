//! `link sniff`: shows the bytes that a device sends and proposes a frame format.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, IsTerminal, Write, stderr, stdout};
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, anyhow};
use serde_json::{Value, json};
use tactus_runner::devices;
use tactus_schema::rig::{HidLink, SerialPort, Transport, UsbIdentity, UsbLink};
use tactus_wire::declared::{MAX_FRAME_BYTES, Proposal, propose};
use tokio::io::AsyncReadExt;
use tokio::signal::unix::{SignalKind, signal};
use tokio::time::{Instant, MissedTickBehavior, interval, sleep_until};

use crate::cli::{Common, LinkSniffArgs};
use crate::connection::runtime;
use crate::exit::{Exit, Failure};
use crate::output::{print_fields, say};

pub(crate) fn sniff(common: &Common, args: &LinkSniffArgs) -> anyhow::Result<Exit> {
    let transport = transport(&args.device, args.baud, args.interface)
        .map_err(|error| Failure::new(Exit::Usage, error))?;
    let seconds = args.seconds.map(Duration::try_from_secs_f64).transpose();
    let seconds = seconds.map_err(|error| Failure::new(Exit::Usage, format!("--seconds: {error}")))?;
    let mut capture = Capture::new(&transport, args.save.as_deref())?;
    let live = stdout().is_terminal() && !common.json;
    let ended = runtime()?.block_on(listen(&transport, args, seconds, live, &mut capture))?;
    capture.finish()?;
    // After the live output, because it takes a moment.
    let proposals = propose(&capture.head);
    if common.json {
        say(&to_json(args, &capture, &ended, &proposals).to_string());
    } else {
        print(&capture, &ended, &proposals);
    }
    Ok(match ended {
        _ if capture.bytes == 0 => Exit::Failed,
        Ended::Asked => Exit::Done,
        Ended::Broken(_) => Exit::Degraded,
    })
}

/// Parses the name of a device, such as `usb:1209:0020/A1:3:85`.
fn transport(text: &str, baud: u32, interface: Option<u8>) -> anyhow::Result<Transport> {
    let hex = |digits: &str| u8::from_str_radix(digits.strip_prefix("0x").unwrap_or(digits), 16).ok();
    if let Some(rest) = text.strip_prefix("usb:") {
        // From the end, for a serial number may have colons.
        let mut parts = rest.rsplitn(3, ':');
        let (endpoint, interface, identity) = (parts.next(), parts.next(), parts.next());
        let endpoint_in = endpoint.and_then(hex).filter(|address| (0x81..=0x8F).contains(address));
        let interface = interface.and_then(|number| number.parse().ok());
        let (Some(endpoint_in), Some(interface), Some(identity)) = (endpoint_in, interface, identity) else {
            return Err(anyhow!(
                "{text:?} is not usb:VID:PID[/SERIAL]:INTERFACE:ENDPOINT, such as usb:1209:0020/A1:3:85"
            ));
        };
        let identity = identity.parse()?;
        return Ok(Transport::Usb(UsbLink { identity, interface, endpoint_in, endpoint_out: None }));
    }
    if let Some(identity) = text.strip_prefix("hid:") {
        let identity = identity.parse()?;
        return Ok(Transport::Hid(HidLink { identity, interface, report_bytes: None }));
    }
    if let Some(address) = text.strip_prefix("tcp:") {
        return Ok(Transport::Tcp { address: address.to_owned() });
    }
    let port = match text.strip_prefix("serial:").map(str::parse::<UsbIdentity>) {
        Some(identity) => SerialPort::Usb(identity?),
        None => SerialPort::Path(text.to_owned()),
    };
    Ok(Transport::Serial { port, baud })
}

/// Why listening ended.
#[derive(Debug, PartialEq, Eq)]
enum Ended {
    /// Ctrl-C, or the requested time or number of bytes.
    Asked,
    /// The device or the link failed.
    Broken(String),
}

/// Period of the live output.
const REDRAW: Duration = Duration::from_millis(200);

async fn listen(
    transport: &Transport,
    args: &LinkSniffArgs,
    seconds: Option<Duration>,
    live: bool,
    capture: &mut Capture,
) -> anyhow::Result<Ended> {
    // Before the device is opened, so that a signal always ends it cleanly.
    let mut interrupted = signal(SignalKind::interrupt()).context("cannot wait for Ctrl-C")?;
    let mut terminated = signal(SignalKind::terminate()).context("cannot wait for signals")?;
    let connect = devices::physical(transport).context("an embedded device has no link")?;
    let mut stream = connect.connect().await?;
    // At once: log lines may come in between.
    stderr().write_all(format!("listening to {connect}; Ctrl-C stops\n").as_bytes())?;
    // A time beyond the clock's range means no limit.
    let deadline = seconds.and_then(|seconds| Instant::now().checked_add(seconds));
    let mut redraw = interval(REDRAW);
    redraw.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut view = HexView::default();
    let mut buffer = vec![0; MAX_FRAME_BYTES];
    let ended = loop {
        let left = args.bytes.map(|bytes| (bytes.get() as u64).saturating_sub(capture.bytes));
        if left == Some(0) {
            break Ended::Asked;
        }
        tokio::select! {
            biased;
            _ = interrupted.recv() => break Ended::Asked,
            _ = terminated.recv() => break Ended::Asked,
            () = until(deadline) => break Ended::Asked,
            _ = redraw.tick(), if live => view.print(),
            read = stream.read(&mut buffer) => match read {
                Ok(0) => break Ended::Broken("the device disconnected".to_owned()),
                Ok(count) => {
                    let read = buffer.get(..count).unwrap_or_default();
                    let read = left.and_then(|left| read.get(..usize::try_from(left).ok()?)).unwrap_or(read);
                    if live {
                        view.take(capture.bytes, read, capture.are_packets);
                    }
                    capture.take(read)?;
                }
                Err(error) => break Ended::Broken(format!("the link broke: {error}")),
            },
        }
    };
    view.end_line();
    view.print();
    Ok(ended)
}

async fn until(deadline: Option<Instant>) {
    match deadline {
        Some(deadline) => sleep_until(deadline).await,
        None => std::future::pending().await,
    }
}

/// Bytes kept in memory, from which a format is proposed.
const HEAD_BYTES: usize = 1 << 16;

/// Packet lengths that are counted; further lengths are ignored.
const LENGTHS_MAX: usize = 64;

/// The bytes received.
#[derive(Debug)]
struct Capture {
    head: Vec<u8>,
    bytes: u64,
    /// Each read is one packet.
    are_packets: bool,
    reads: u64,
    /// How often packets of each length came.
    lengths: BTreeMap<usize, u64>,
    save: Option<(PathBuf, BufWriter<File>)>,
}

impl Capture {
    fn new(transport: &Transport, save: Option<&Path>) -> anyhow::Result<Self> {
        let open = |path: &Path| {
            let file = File::create(path).with_context(|| format!("{} cannot be written", path.display()))?;
            anyhow::Ok((path.to_owned(), BufWriter::new(file)))
        };
        Ok(Self {
            head: Vec::new(),
            bytes: 0,
            are_packets: matches!(transport, Transport::Usb(_) | Transport::Hid(_)),
            reads: 0,
            lengths: BTreeMap::new(),
            save: save.map(open).transpose()?,
        })
    }

    fn take(&mut self, read: &[u8]) -> anyhow::Result<()> {
        let room = HEAD_BYTES.saturating_sub(self.head.len());
        self.head.extend_from_slice(read.get(..room).unwrap_or(read));
        self.bytes += read.len() as u64;
        self.reads += 1;
        if self.lengths.len() < LENGTHS_MAX || self.lengths.contains_key(&read.len()) {
            *self.lengths.entry(read.len()).or_default() += 1;
        }
        match &mut self.save {
            Some((path, file)) => {
                file.write_all(read).with_context(|| format!("{} cannot be written", path.display()))
            }
            None => Ok(()),
        }
    }

    fn finish(&mut self) -> anyhow::Result<()> {
        match &mut self.save {
            Some((path, file)) => {
                file.flush().with_context(|| format!("{} cannot be written", path.display()))
            }
            None => Ok(()),
        }
    }

    /// The common length of all packets, if there is one.
    fn packet_bytes(&self) -> Option<usize> {
        let mut lengths = self.lengths.keys();
        lengths.next().copied().filter(|_| self.are_packets && lengths.next().is_none())
    }

    fn saved(&self) -> Option<&Path> {
        self.save.as_ref().map(|(path, _)| path.as_path())
    }
}

/// Lines shown at once; for more, only the number of bytes.
const LINES_MAX: usize = 8;

const LINE_BYTES: usize = 16;

/// Hexadecimal lines waiting to be shown.
#[derive(Debug, Default)]
struct HexView {
    lines: Vec<String>,
    /// The incomplete line and the offset of its first byte.
    begun: (u64, Vec<u8>),
    hidden_bytes: u64,
}

impl HexView {
    /// Adds bytes that begin at offset `at`. A packet starts a new line.
    fn take(&mut self, at: u64, read: &[u8], is_packet: bool) {
        for (at, byte) in (at..).zip(read) {
            if self.begun.1.is_empty() {
                self.begun.0 = at;
            }
            self.begun.1.push(*byte);
            if self.begun.1.len() == LINE_BYTES {
                self.end_line();
            }
        }
        if is_packet {
            self.end_line();
        }
    }

    fn end_line(&mut self) {
        let (at, bytes) = std::mem::take(&mut self.begun);
        if self.lines.len() < LINES_MAX && !bytes.is_empty() {
            self.lines.push(line(at, &bytes));
        } else {
            self.hidden_bytes += bytes.len() as u64;
        }
    }

    fn print(&mut self) {
        for line in self.lines.drain(..) {
            say(&line);
        }
        if self.hidden_bytes > 0 {
            say(&format!("          ... {} bytes more", self.hidden_bytes));
            self.hidden_bytes = 0;
        }
    }
}

/// `00000010  aa 55 65 00 ...  |.Ue.|`
fn line(at: u64, bytes: &[u8]) -> String {
    let hex: Vec<_> = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
    let ascii: String =
        bytes.iter().map(|byte| if matches!(byte, b' '..=b'~') { char::from(*byte) } else { '.' }).collect();
    format!("{at:08x}  {:width$}  |{ascii}|", hex.join(" "), width = 3 * LINE_BYTES - 1)
}

/// Proposals shown.
const PROPOSALS_MAX: usize = 3;

fn print(capture: &Capture, ended: &Ended, proposals: &[Proposal]) {
    let mut fields = vec![("bytes", capture.bytes.to_string())];
    if capture.are_packets {
        let kinds = capture.lengths.iter().map(|(bytes, count)| format!("{count} of {bytes} bytes"));
        let kinds: Vec<_> = kinds.take(LINES_MAX).collect();
        fields.push(("packets", format!("{}: {}", capture.reads, kinds.join(", "))));
    }
    if let Some(path) = capture.saved() {
        fields.push(("saved", path.display().to_string()));
    }
    if let Ended::Broken(why) = ended {
        fields.push(("ended", why.clone()));
    }
    print_fields(&fields);
    for proposal in proposals.iter().take(PROPOSALS_MAX) {
        say(&format!("candidate: {}", in_words(proposal)));
    }
    say(&format!("next: {}", next(capture, proposals)));
}

fn in_words(proposal: &Proposal) -> String {
    let list = |offsets: &[usize]| {
        let shown: Vec<_> = offsets.iter().take(LINE_BYTES).map(ToString::to_string).collect();
        if offsets.len() > LINE_BYTES { format!("{}, ...", shown.join(", ")) } else { shown.join(", ") }
    };
    let Proposal { stride, likeness, sync, first_at, constant, counters } = proposal;
    let counting =
        if counters.is_empty() { String::new() } else { format!("; counter bytes: {}", list(counters)) };
    format!(
        "frames of {stride} bytes that begin with {} (first at byte {first_at}, {:.0} % alike); constant bytes: \
         {}{counting}",
        array(sync),
        100.0 * likeness,
        list(constant)
    )
}

/// `[0xAA, 0x55]`
fn array(bytes: &[u8]) -> String {
    let bytes: Vec<_> = bytes.iter().map(|byte| format!("{byte:#04X}").replace("0X", "0x")).collect();
    format!("[{}]", bytes.join(", "))
}

/// The next step for the user.
fn next(capture: &Capture, proposals: &[Proposal]) -> String {
    if capture.bytes == 0 {
        return "no bytes arrived: is the device switched on? Are bit rate and endpoint right? Does it wait for a \
                command before it sends?"
            .to_owned();
    }
    let Some(path) = capture.saved() else {
        return "record a few seconds, with nothing touching the array: repeat with --save bytes.bin"
            .to_owned();
    };
    let check = format!("tactus link check FILE --capture {}", path.display());
    match (capture.packet_bytes(), proposals.first()) {
        (Some(bytes), _) => format!(
            "in a copy of config/links/digitacts.toml, put framing = \"packet\" and frame.bytes = {bytes}; then {check}"
        ),
        (None, Some(Proposal { stride, sync, .. })) => format!(
            "in a copy of config/links/digitacts.toml, put frame.bytes = {stride} and frame.sync = {}; then {check}",
            array(sync)
        ),
        (None, None) => format!(
            "no frames of constant length were found: is the bit rate right? Record longer or, if you know the format, \
             describe it; then {check}"
        ),
    }
}

fn to_json(args: &LinkSniffArgs, capture: &Capture, ended: &Ended, proposals: &[Proposal]) -> Value {
    let packets = capture.are_packets.then(|| {
        let length = |(bytes, count): (&usize, &u64)| json!({ "bytes": bytes, "count": count });
        json!({ "count": capture.reads, "lengths": capture.lengths.iter().map(length).collect::<Vec<_>>() })
    });
    let proposal = |one: &Proposal| {
        json!({
            "stride": one.stride,
            "likeness": one.likeness,
            "sync": one.sync,
            "first_at": one.first_at,
            "constant": one.constant,
            "counters": one.counters,
        })
    };
    let broken = match ended {
        Ended::Asked => None,
        Ended::Broken(why) => Some(why),
    };
    json!({
        "device": args.device,
        "bytes": capture.bytes,
        "packets": packets,
        "saved": capture.saved(),
        "broken": broken,
        "proposals": proposals.iter().take(PROPOSALS_MAX).map(proposal).collect::<Vec<_>>(),
        "next": next(capture, proposals),
    })
}

#[cfg(test)]
#[path = "sniff_tests.rs"]
mod tests;
