//! The rigs of a service: their files, each checked by itself and against the others.

use std::collections::BTreeMap;
use std::fmt;
use std::fs;
use std::path::{Path, PathBuf};

use tactus_schema::rig::{SerialPort, Transport};

use super::{ConfigError, RigFiles, load_rig};

/// The rigs of a service.
#[derive(Debug, Clone)]
pub struct Rigs {
    /// Those that can be served, in the order of their names.
    pub served: Vec<RigFiles>,
    /// Those that cannot.
    pub refused: Vec<RefusedRig>,
    /// The files of all.
    pub files: Vec<PathBuf>,
    /// The configuration names a folder or a list. Then each rig has a folder of recordings, and one that fails harms no other.
    pub are_several: bool,
}

/// A rig that is not served.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RefusedRig {
    /// Its file.
    pub path: PathBuf,
    /// Its name or, if the file does not say it, the file's name without its ending.
    pub name: String,
    /// Why. It names the files.
    pub problem: String,
}

impl fmt::Display for RefusedRig {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "rig {:?}: {}", self.name, self.problem)
    }
}

impl Rigs {
    /// The only rig of a service.
    pub(super) fn one(rig: RigFiles) -> Self {
        let files = vec![rig.path.clone()];
        Self { served: vec![rig], refused: Vec::new(), files, are_several: false }
    }

    /// Reads the files. Rigs that have one name, or that name one device, are all refused: nobody could tell which was meant.
    ///
    /// # Errors
    /// [`ConfigError::AllRefused`] if no rig can be served.
    pub fn load(mut files: Vec<PathBuf>) -> Result<Self, ConfigError> {
        files.sort();
        files.dedup();
        let (mut served, mut refused) = (Vec::new(), Vec::new());
        for path in &files {
            match load_rig(path) {
                Ok(rig) => served.push(rig),
                Err(error) => {
                    let (path, name) = (path.clone(), name_in(path));
                    refused.push(RefusedRig { path, name, problem: error.to_string() });
                }
            }
        }
        let mut conflicts = conflicts(&served);
        served.retain(|rig| match conflicts.remove(&rig.path) {
            Some(problem) => {
                refused.push(RefusedRig { path: rig.path.clone(), name: rig.rig.name.clone(), problem });
                false
            }
            None => true,
        });
        if served.is_empty() {
            return Err(ConfigError::AllRefused { refused });
        }
        served.sort_by(|one, other| one.rig.name.cmp(&other.rig.name));
        // A name that is served is no other rig's.
        for one in &mut refused {
            if served.iter().any(|rig| rig.rig.name == one.name) {
                one.name = format!("{}-refused", one.name);
            }
        }
        Ok(Self { served, refused, files, are_several: true })
    }
}

/// The rig files of a folder, sorted.
///
/// # Errors
/// [`ConfigError::Read`] if it cannot be listed, [`ConfigError::NoRigs`] if it has none.
pub fn files_in_folder(folder: &Path) -> Result<Vec<PathBuf>, ConfigError> {
    let entries = fs::read_dir(folder)
        .and_then(Iterator::collect::<Result<Vec<_>, _>>)
        .map_err(|source| ConfigError::Read { path: folder.to_owned(), source })?;
    let mut files: Vec<_> = entries
        .into_iter()
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .collect();
    if files.is_empty() {
        return Err(ConfigError::NoRigs { path: folder.to_owned() });
    }
    files.sort();
    Ok(files)
}

/// What is wrong between rigs, by their files.
fn conflicts(rigs: &[RigFiles]) -> BTreeMap<PathBuf, String> {
    let mut names: BTreeMap<&str, Vec<&RigFiles>> = BTreeMap::new();
    let mut devices: BTreeMap<String, Vec<(&'static str, &RigFiles)>> = BTreeMap::new();
    for rig in rigs {
        names.entry(&rig.rig.name).or_default().push(rig);
        let Some(service) = &rig.rig.service else { continue };
        for (role, transport) in [("sensor", &service.sensor.transport), ("stage", &service.stage.transport)]
        {
            if let Some(device) = device(transport) {
                devices.entry(device).or_default().push((role, rig));
            }
        }
    }
    let mut found = BTreeMap::new();
    for (name, of_name) in names.iter().filter(|(_, of_name)| of_name.len() > 1) {
        let files: Vec<_> = of_name.iter().map(|rig| rig.path.display().to_string()).collect();
        for rig in of_name {
            let files = files.join(" and ");
            let problem =
                format!("{files} have one name, {name:?}: give each rig its own; none of them is served");
            found.insert(rig.path.clone(), problem);
        }
    }
    for (device, users) in devices.iter().filter(|(_, users)| users.len() > 1) {
        let of: Vec<_> = users.iter().map(|(role, rig)| format!("{} ({role})", rig.path.display())).collect();
        for (_, rig) in users {
            let of = of.join(" and ");
            let problem =
                format!("{of} name one device, {device}: it can be only one rig's; none of them is served");
            found.entry(rig.path.clone()).or_insert(problem);
        }
    }
    found
}

/// What distinguishes the device of a link from others; `None` for a simulated one, which each rig has for itself.
fn device(transport: &Transport) -> Option<String> {
    Some(match transport {
        Transport::Embedded => return None,
        // Links such as those of /dev/serial/by-id lead to one port.
        Transport::Serial { port: SerialPort::Path(path), .. } => {
            let path = Path::new(path);
            path.canonicalize().unwrap_or_else(|_| path.to_owned()).display().to_string()
        }
        Transport::Serial { .. } | Transport::Usb(_) | Transport::Hid(_) | Transport::Tcp { .. } => {
            transport.to_string()
        }
    })
}

/// The name in a rig file that cannot be read as one; without it, the file's.
fn name_in(path: &Path) -> String {
    let text = fs::read_to_string(path).unwrap_or_default();
    let top = text.lines().take_while(|line| !line.trim_start().starts_with('['));
    let named = top
        .filter_map(|line| line.trim_start().strip_prefix("name")?.trim_start().strip_prefix('='))
        .find_map(|value| value.split(['"', '\'']).nth(1).map(str::to_owned));
    let stem = || path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let fits = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    let name: String = named.unwrap_or_else(stem).chars().map(|c| if fits(c) { c } else { '_' }).collect();
    if name.is_empty() { "_".to_owned() } else { name }
}
