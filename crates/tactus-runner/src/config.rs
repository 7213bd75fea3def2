//! The service's configuration file, `tactusd.toml`.

use std::fs;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use tactus_device::{LinkFileError, SensorCodec};
use tactus_schema::{Rig, RigError};

use crate::order::Texts;

/// The checked configuration, with the rig it names.
#[derive(Debug, Clone)]
pub struct Config {
    /// The rig.
    pub rig: RigFiles,
    /// Where experiment scripts are looked for, before the built-in ones.
    pub experiments: Option<PathBuf>,
    /// Where recordings go.
    pub recordings: PathBuf,
    /// Endpoints of the bus.
    pub bus: BusSection,
    /// How to log.
    pub log: LogSection,
}

/// A rig, how its sensor is spoken to, and the texts of the files that say so.
#[derive(Debug, Clone)]
pub struct RigFiles {
    /// The rig.
    pub rig: Rig,
    /// How its sensor is spoken to.
    pub codec: SensorCodec,
    /// For the recordings.
    pub texts: RigTexts,
}

/// What was read of a rig, as it was read.
#[derive(Debug, Clone)]
pub struct RigTexts {
    /// The rig file.
    pub rig_toml: String,
    /// The description of the sensor's frames, if the rig file names one.
    pub link_toml: Option<String>,
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
    /// The description of the sensor's frames that the rig file names.
    #[error(transparent)]
    Link(#[from] LinkFileError),
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
    /// Reads and checks the file, the rig file it names, and the files that this one names. Paths in it are relative to its own folder,
    /// but recordings: those are relative to systemd's state directory, or else to the working directory.
    ///
    /// # Errors
    /// [`ConfigError`] names the file, and the line or field in it.
    pub fn load(path: &Path) -> Result<Self, ConfigError> {
        let raw: RawConfig = toml::from_str(&read(path)?)
            .map_err(|source| ConfigError::Form { path: path.to_owned(), source })?;
        let folder = path.parent().unwrap_or(Path::new("."));
        let rig = load_rig(&folder.join(raw.rig))?;
        let experiments = raw.experiments.map(|experiments| folder.join(experiments));
        if let Some(folder) = experiments.clone().filter(|folder| !folder.is_dir()) {
            return Err(ConfigError::Experiments { path: path.to_owned(), folder });
        }
        let state = std::env::var_os("STATE_DIRECTORY").map(PathBuf::from).unwrap_or_default();
        Ok(Self { rig, experiments, recordings: state.join(raw.recordings), bus: raw.bus, log: raw.log })
    }
}

impl RigFiles {
    /// A rig that a service can use, from the text of its file; a description of frames is looked for relative to
    /// `path`.
    ///
    /// # Errors
    /// As [`Config::load`].
    pub fn of(text: &str, path: &Path) -> Result<Self, ConfigError> {
        let rig =
            Rig::from_toml(text).map_err(|source| ConfigError::Rig { path: path.to_owned(), source })?;
        if rig.service.is_none() {
            return Err(ConfigError::NoService { path: path.to_owned() });
        }
        let (codec, link) = SensorCodec::load(&rig, path)?;
        let texts = RigTexts { rig_toml: text.to_owned(), link_toml: link.map(|link| link.text) };
        Ok(Self { rig, codec, texts })
    }
}

impl RigTexts {
    /// All that was read.
    pub fn all(&self) -> Texts<'_> {
        Texts { rig_toml: Some(&self.rig_toml), link_toml: self.link_toml.as_deref() }
    }

    /// Without the rig file, what of it says of simulated devices being otherwise.
    pub fn without_rig(&self) -> Texts<'_> {
        Texts { rig_toml: None, ..self.all() }
    }
}

/// Reads a rig file that a service can use, and the description of its sensor's frames if it names one.
///
/// # Errors
/// As [`Config::load`].
pub fn load_rig(path: &Path) -> Result<RigFiles, ConfigError> {
    RigFiles::of(&read(path)?, path)
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
