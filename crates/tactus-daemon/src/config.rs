//! The service's configuration file, `tactusd.toml`.

use std::fs;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use tactus_schema::{Rig, RigError};

/// The checked configuration, with the rig it names.
#[derive(Debug, Clone)]
pub struct Config {
    /// The rig.
    pub rig: Rig,
    /// The rig file's text, for the recordings.
    pub rig_toml: String,
    /// Where experiment scripts are looked for, before the built-in ones.
    pub experiments: Option<PathBuf>,
    /// Where recordings go.
    pub recordings: PathBuf,
    /// Endpoints of the bus.
    pub bus: BusSection,
    /// How to log.
    pub log: LogSection,
}

/// `[bus]`: endpoints in zenoh's form, such as `tcp/127.0.0.1:7447`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BusSection {
    /// Where to listen; nothing beyond loopback unless it is named here.
    #[serde(default = "loopback")]
    pub listen: Vec<String>,
    /// Routers to connect to.
    #[serde(default)]
    pub connect: Vec<String>,
}

/// `[log]`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LogSection {
    /// Text for people, JSON for machines.
    #[serde(default)]
    pub format: LogFormat,
    /// What is logged, in the form of `RUST_LOG`, which has precedence.
    #[serde(default = "info")]
    pub filter: String,
}

/// The form of a log line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum LogFormat {
    /// One readable line each; without times under journald, which has its own.
    #[default]
    Text,
    /// One JSON object each.
    Json,
}

/// Why a configuration cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// A file could not be read.
    #[error("{}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The file is not of the right form; the text names line and key.
    #[error("{}: {source}", path.display())]
    Form {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: toml::de::Error,
    },
    /// The rig file is not a rig.
    #[error("{}: {source}", path.display())]
    Rig {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: RigError,
    },
    /// The folder of experiments is not there.
    #[error("{}: experiments = {folder:?} is no folder", path.display())]
    Experiments {
        /// The configuration.
        path: PathBuf,
        /// What it names.
        folder: PathBuf,
    },
    /// The rig describes data, not a service.
    #[error("{}: a service needs the tables envelope, motion, policy, sensor and stage", path.display())]
    NoService {
        /// The rig file.
        path: PathBuf,
    },
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawConfig {
    rig: PathBuf,
    #[serde(default)]
    experiments: Option<PathBuf>,
    #[serde(default = "runs")]
    recordings: PathBuf,
    #[serde(default)]
    bus: BusSection,
    #[serde(default)]
    log: LogSection,
}

impl Default for BusSection {
    fn default() -> Self {
        Self { listen: loopback(), connect: Vec::new() }
    }
}

impl Default for LogSection {
    fn default() -> Self {
        Self { format: LogFormat::default(), filter: info() }
    }
}

impl Config {
    /// Reads and checks the file and the rig file it names. Paths in it are relative to its own folder,
    /// but recordings: those are relative to systemd's state directory, or else to the working directory.
    ///
    /// # Errors
    /// [`ConfigError`] names the file, and the line or field in it.
    pub fn load(path: &Path) -> Result<Self, ConfigError> {
        let raw: RawConfig = toml::from_str(&read(path)?)
            .map_err(|source| ConfigError::Form { path: path.to_owned(), source })?;
        let folder = path.parent().unwrap_or(Path::new("."));
        let (rig, rig_toml) = load_rig(&folder.join(raw.rig))?;
        let experiments = raw.experiments.map(|experiments| folder.join(experiments));
        if let Some(folder) = experiments.clone().filter(|folder| !folder.is_dir()) {
            return Err(ConfigError::Experiments { path: path.to_owned(), folder });
        }
        let state = std::env::var_os("STATE_DIRECTORY").map(PathBuf::from).unwrap_or_default();
        Ok(Self {
            rig,
            rig_toml,
            experiments,
            recordings: state.join(raw.recordings),
            bus: raw.bus,
            log: raw.log,
        })
    }
}

/// Reads a rig file that a service can use, and its text.
///
/// # Errors
/// As [`Config::load`].
pub fn load_rig(path: &Path) -> Result<(Rig, String), ConfigError> {
    let text = read(path)?;
    let rig = Rig::from_toml(&text).map_err(|source| ConfigError::Rig { path: path.to_owned(), source })?;
    if rig.service.is_none() {
        return Err(ConfigError::NoService { path: path.to_owned() });
    }
    Ok((rig, text))
}

fn read(path: &Path) -> Result<String, ConfigError> {
    fs::read_to_string(path).map_err(|source| ConfigError::Read { path: path.to_owned(), source })
}

fn loopback() -> Vec<String> {
    vec!["tcp/127.0.0.1:7447".into()]
}

fn runs() -> PathBuf {
    "runs".into()
}

fn info() -> String {
    "info,zenoh=error".into()
}
