//! `devices`: lists the devices, their rig-file entries, their access and the rigs that use them.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Context;
use serde_json::{Value, json};
use tactus_device::{Access, FoundDevice, inventory};
use tactus_runner::config::{self, RigFiles, ServiceConfig};
use tactus_schema::Rig;
use tactus_schema::rig::{SerialPort, Transport};

use crate::cli::{Common, DevicesArgs};
use crate::exit::{Exit, Failure};
use crate::output::{print_table, say, say_next};

pub(crate) fn devices(common: &Common, args: &DevicesArgs) -> anyhow::Result<Exit> {
    let rigs = Rigs::find(common.rig.as_deref(), args.config.as_deref())?;
    let found = inventory().context("the devices of this machine cannot be listed")?;
    if common.json {
        say(&to_json(&found, &rigs).to_string());
    } else {
        print(&found, &rigs);
    }
    let is_missing = rigs.presences(&found).iter().any(|(_, presence)| *presence == Presence::Missing);
    Ok(if is_missing { Exit::Degraded } else { Exit::Done })
}

/// Folders searched for rig files if none is given.
const FOLDERS: [&str; 2] = ["config/rigs", "/etc/tactus/rigs"];

/// The devices that rig files name.
#[derive(Debug, Default)]
struct Rigs {
    links: Vec<Link>,
    /// Errors of files that cannot be read as rig files.
    notes: Vec<String>,
    /// True if the user named a rig or a file: each of its devices is then reported.
    are_named: bool,
}

/// Whether the device of a link is there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Presence {
    There,
    Missing,
    /// It is simulated.
    Embedded,
    /// It is behind a network address, which is not looked at.
    Remote,
}

#[derive(Debug)]
struct Link {
    rig: String,
    /// `sensor` or `stage`.
    role: &'static str,
    transport: Transport,
}

impl Rigs {
    fn find(rig: Option<&str>, config: Option<&Path>) -> anyhow::Result<Self> {
        let mut rigs = Self { are_named: rig.is_some() || config.is_some(), ..Self::default() };
        let file =
            rig.map(Path::new).filter(|rig| rig.extension().is_some_and(|extension| extension == "toml"));
        if let Some(file) = file {
            rigs.add(&config::load_rig(file)?.rig);
        }
        if let Some(config) = config {
            let of_service = ServiceConfig::load(config)?.rigs;
            of_service.served.iter().for_each(|files| rigs.add(&files.rig));
            rigs.notes.extend(of_service.refused.iter().map(ToString::to_string));
        }
        if file.is_none() && config.is_none() {
            rigs.search(rig)?;
        }
        Ok(rigs)
    }

    /// Adds the rigs of the folders, or the one that has this name.
    fn search(&mut self, name: Option<&str>) -> anyhow::Result<()> {
        let mut names = Vec::new();
        for file in rig_files() {
            match config::load_rig(&file) {
                Ok(RigFiles { rig, .. }) => {
                    if name.is_none_or(|name| name == rig.name) {
                        self.add(&rig);
                    }
                    names.push(rig.name);
                }
                Err(error) => self.notes.push(error.to_string()),
            }
        }
        match name.filter(|name| !names.iter().any(|one| one == name)) {
            Some(name) => Err(Failure::new(Exit::Usage, unknown_rig(name, &names)).into()),
            None => Ok(()),
        }
    }

    fn add(&mut self, rig: &Rig) {
        let Some(service) = &rig.service else { return };
        for (role, transport) in [("sensor", &service.sensor.transport), ("stage", &service.stage.transport)]
        {
            self.links.push(Link { rig: rig.name.clone(), role, transport: transport.clone() });
        }
    }

    fn using<'a>(&'a self, found: &'a FoundDevice) -> impl Iterator<Item = &'a Link> {
        self.links.iter().filter(|link| found.is_meant_by(&link.transport))
    }

    /// The links of the named rigs, and whether their devices are there.
    fn presences(&self, found: &[FoundDevice]) -> Vec<(&Link, Presence)> {
        let links = self.links.iter().filter(|_| self.are_named);
        links.map(|link| (link, link.presence(found))).collect()
    }
}

impl Link {
    fn presence(&self, found: &[FoundDevice]) -> Presence {
        let is_there = match &self.transport {
            Transport::Embedded => return Presence::Embedded,
            Transport::Tcp { .. } => return Presence::Remote,
            // Pseudo-terminals are not in the inventory.
            Transport::Serial { port: SerialPort::Path(path), .. } => Path::new(path).exists(),
            Transport::Serial { .. } | Transport::Usb(_) | Transport::Hid(_) => {
                found.iter().any(|one| one.is_meant_by(&self.transport))
            }
        };
        if is_there { Presence::There } else { Presence::Missing }
    }

    fn in_words(&self, presence: Presence) -> String {
        let Self { rig, role, transport } = self;
        match presence {
            Presence::There => format!("The {role} of rig {rig:?} is there: {transport}"),
            Presence::Missing => format!("The {role} of rig {rig:?} is not there: {transport}"),
            Presence::Embedded => format!("The {role} of rig {rig:?} is simulated: it needs no device"),
            Presence::Remote => {
                format!(
                    "The {role} of rig {rig:?} is at a network address, which is not looked at: {transport}"
                )
            }
        }
    }
}

/// The rig files of the folders.
pub(crate) fn rig_files() -> Vec<PathBuf> {
    FOLDERS.iter().flat_map(|folder| toml_files(Path::new(folder))).collect()
}

fn unknown_rig(name: &str, names: &[String]) -> String {
    let folders = FOLDERS.join(" and ");
    let known = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
    format!(
        "no rig {name:?} in {folders}; there is: {known}. Or give its file: `tactus devices --rig FILE.toml`"
    )
}

fn toml_files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut files: Vec<_> = entries
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .collect();
    files.sort();
    files
}

const NOTHING: &str = "no device was found that a rig could use: no serial port, no vendor-specific USB interface, no \
    human interface device except keyboards and mice. Is the device switched on? Does its cable carry data? Does \
    `dmesg` show it when it is plugged in? A container or virtual machine sees only devices that are passed to it. \
    The simulated rig needs no device: `tactus run element-centres --embedded`";

const DENIED_SERIAL: &str = "No permission for a serial port: add the user to the group that owns it (`ls -l` shows it, \
    often dialout) and log in again.";

const DENIED_USB: &str = "No permission for a USB or HID device: add a line with its vendor and product to \
    /etc/udev/rules.d/70-tactus.rules, and load the rules as root with `udevadm control --reload && udevadm trigger`.";

fn print(found: &[FoundDevice], rigs: &Rigs) {
    if found.is_empty() {
        say(NOTHING);
    } else {
        let rows: Vec<_> = found.iter().map(|one| row(one, rigs)).collect();
        print_table(&["KIND", "DEVICE", "IDENTITY", "AT", "OPEN", "RIG"], &rows);
        say("");
        say("In a rig file, under [sensor] or [stage]:");
        for one in found {
            say("");
            say(&format!("    # {}", comment(one)));
            say(&format!("    transport = {}", one.transport.to_toml()));
        }
    }
    let denied = |serial: bool| {
        found.iter().any(|one| one.access == Access::Denied && (kind(one) == "serial") == serial)
    };
    for (is_so, what) in [(denied(true), DENIED_SERIAL), (denied(false), DENIED_USB)] {
        if is_so {
            say("");
            say(what);
        }
    }
    let presences = rigs.presences(found);
    if !presences.is_empty() {
        say("");
    }
    for (link, presence) in presences {
        say(&link.in_words(presence));
    }
    for note in &rigs.notes {
        eprintln!("tactus: {note}");
    }
    if found.iter().any(|one| rigs.using(one).next().is_none()) {
        say("");
        say_next("`tactus validate RIG.toml` checks a rig file with such a line");
    }
}

fn row(one: &FoundDevice, rigs: &Rigs) -> Vec<String> {
    let or_dash = |text: Option<String>| text.unwrap_or_else(|| "-".to_owned());
    let rigs: Vec<_> = rigs.using(one).map(|Link { rig, role, .. }| format!("{rig} ({role})")).collect();
    vec![
        kind(one).to_owned(),
        or_dash(one.product.clone()),
        or_dash(one.identity.as_ref().map(ToString::to_string)),
        one.by_id.as_ref().unwrap_or(&one.node).display().to_string(),
        match &one.access {
            Access::Free => "yes".to_owned(),
            Access::Denied => "no permission".to_owned(),
            Access::Held(None) => "in use".to_owned(),
            Access::Held(Some(holder)) => format!("in use by {} ({})", holder.name, holder.pid),
        },
        or_dash((!rigs.is_empty()).then(|| rigs.join(", "))),
    ]
}

fn comment(one: &FoundDevice) -> String {
    let name = one.product.as_deref().unwrap_or("A port");
    let place = one.node.display();
    if one.is_stable {
        format!("{name}, now at {place}")
    } else {
        format!(
            "{name}, now at {place}; it cannot be distinguished from others of its kind: plug in only one"
        )
    }
}

fn kind(one: &FoundDevice) -> &'static str {
    match one.transport {
        Transport::Serial { .. } => "serial",
        Transport::Usb(_) => "usb",
        Transport::Hid(_) => "hid",
        Transport::Embedded | Transport::Tcp { .. } => "none",
    }
}

fn to_json(found: &[FoundDevice], rigs: &Rigs) -> Value {
    let link = |Link { rig, role, .. }: &Link| json!({ "rig": rig, "role": role });
    let device = |one: &FoundDevice| {
        let (interface, endpoint_in, endpoint_out) = match &one.transport {
            Transport::Usb(link) => (Some(link.interface), Some(link.endpoint_in), link.endpoint_out),
            Transport::Hid(link) => (link.interface, None, None),
            Transport::Embedded | Transport::Serial { .. } | Transport::Tcp { .. } => (None, None, None),
        };
        let (access, held_by) = match &one.access {
            Access::Free => ("free", None),
            Access::Denied => ("denied", None),
            Access::Held(holder) => ("held", holder.as_ref()),
        };
        let identity = one.identity.as_ref();
        json!({
            "kind": kind(one),
            "product": one.product,
            "vid": identity.map(|own| own.vid),
            "pid": identity.map(|own| own.pid),
            "serial": identity.and_then(|own| own.serial.as_ref()),
            "interface": interface,
            "endpoint_in": endpoint_in,
            "endpoint_out": endpoint_out,
            "node": one.node,
            "by_id": one.by_id,
            "transport": one.transport.to_toml(),
            "stable": one.is_stable,
            "access": access,
            "held_by": held_by.map(|holder| json!({ "pid": holder.pid, "name": holder.name })),
            "rigs": rigs.using(one).map(link).collect::<Vec<_>>(),
        })
    };
    let presences = rigs.presences(found);
    json!({
        "devices": found.iter().map(device).collect::<Vec<_>>(),
        "missing": presences.iter().filter(|(_, is)| *is == Presence::Missing).map(|(of, _)| link(of)).collect::<Vec<_>>(),
        "named": presences.iter().map(|(of, is)| json!({
            "rig": of.rig,
            "role": of.role,
            "transport": of.transport.to_toml(),
            "there": match is {
                Presence::There => Some(true),
                Presence::Missing => Some(false),
                Presence::Embedded | Presence::Remote => None,
            },
        })).collect::<Vec<_>>(),
        "notes": rigs.notes,
        "hint": found.is_empty().then_some(NOTHING),
    })
}

#[cfg(test)]
#[path = "devices_tests.rs"]
mod tests;
