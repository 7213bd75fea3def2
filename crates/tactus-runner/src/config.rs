//! The service's configuration file, `tactusd.toml`, and the rig files that it names.

mod rigs;

use std::fs;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use tactus_device::{LinkFileError, SensorCodec};
use tactus_log::LogFormat;
use tactus_schema::{Rig, RigError};

use crate::order::Texts;

pub use rigs::{RefusedRig, Rigs, files_in_folder};

/// The checked configuration, with the rigs that it names.
#[derive(Debug, Clone)]
pub struct ServiceConfig {
    /// The rigs.
    pub rigs: Rigs,
    /// Folder of experiment scripts, searched before the built-in ones.
    pub experiments: Option<PathBuf>,
    /// Folder of recordings.
    pub recordings: PathBuf,
    /// Endpoints of the bus.
    pub bus: BusSection,
    /// Format and filter of the log.
    pub log: LogSection,
}

/// A rig, the format of its sensor, and the texts of their files.
#[derive(Debug, Clone)]
pub struct RigFiles {
    /// The rig file.
    pub path: PathBuf,
    /// The checked rig.
    pub rig: Rig,
    /// Protocol of its sensor.
    pub codec: SensorCodec,
    /// The files as they were read, for recordings.
    pub texts: RigTexts,
}

/// The texts of a rig's files, as they were read.
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
    /// Endpoints on which to listen. Default: only loopback.
    #[serde(default = "loopback")]
    pub listen: Vec<String>,
    /// Zenoh routers to connect to, which join the services of several machines. A router that is not there is tried again every few
    /// seconds; the service works without it.
    #[serde(default)]
    pub connect: Vec<String>,
    /// Names of rigs whose services connect to this one.
    #[serde(default)]
    pub guests: Vec<String>,
    /// Frames that are kept in memory of each rig, for clients that join late or were cut off: 1 to 16,000, each some 250 bytes with 48
    /// elements. Default: 1,800, a minute at 30 Hz; with more than 42 rigs fewer, 76,800 of all.
    #[serde(default)]
    pub frames_kept: Option<usize>,
    /// Certificates for endpoints beyond this machine.
    #[serde(default)]
    pub tls: Option<TlsSection>,
}

/// `[bus.tls]`: PEM files, relative to the configuration's folder, and the common names of clients' certificates.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TlsSection {
    /// Authority that signs the certificates of service and clients.
    pub authority: PathBuf,
    /// The service's certificate.
    pub certificate: PathBuf,
    /// Its private key.
    pub key: PathBuf,
    /// Who may command.
    #[serde(default)]
    pub commanders: Vec<String>,
    /// Who may only read and stop.
    #[serde(default)]
    pub readers: Vec<String>,
    /// Certificate of a reader, with which the service checks at its start that a reader cannot command.
    #[serde(default)]
    pub check_certificate: Option<PathBuf>,
    /// Its private key.
    #[serde(default)]
    pub check_key: Option<PathBuf>,
}

/// `[log]`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LogSection {
    /// Text for people, JSON for machines.
    #[serde(default)]
    pub format: LogFormat,
    /// Filter in the form of `RUST_LOG`, which has precedence.
    #[serde(default = "info")]
    pub filter: String,
}

/// Why a configuration cannot be used.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum ConfigError {
    /// A file could not be read.
    #[error("{}: {source}", path.display())]
    Read { path: PathBuf, source: std::io::Error },
    /// The file has a wrong form; the message names line and key.
    #[error("{}: {source}", path.display())]
    Form { path: PathBuf, source: toml::de::Error },
    /// The rig file cannot be used.
    #[error("{}: {source}", path.display())]
    Rig { path: PathBuf, source: RigError },
    /// The description of the sensor's frames cannot be used.
    #[error(transparent)]
    Link(#[from] LinkFileError),
    /// The folder of experiments does not exist.
    #[error("{}: experiments = {folder:?} is no folder", path.display())]
    Experiments { path: PathBuf, folder: PathBuf },
    /// Neither one rig nor several, or both.
    #[error("{}: name one rig (`rig = \"rig.toml\"`) or several (`rigs = \"FOLDER\"` or a list of files), and not both", path.display())]
    Rigs { path: PathBuf },
    /// There is no rig file.
    #[error("{}: no rig file (*.toml) is there", path.display())]
    NoRigs { path: PathBuf },
    /// No rig file can be used.
    #[error("no rig can be served:\n{}", refused.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    AllRefused { refused: Vec<RefusedRig> },
    /// The rig describes data, not a service.
    #[error("{}: a service needs the tables envelope, motion, policy, sensor and stage", path.display())]
    NoService { path: PathBuf },
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawConfig {
    /// The rig file, if the service has one rig.
    #[serde(default)]
    rig: Option<PathBuf>,
    /// The folder of rig files, or a list of them, if it has several. A rig whose file cannot be used is not served; the others are.
    #[serde(default)]
    rigs: Option<RawRigs>,
    /// Folder of experiment scripts, searched before the built-in ones.
    #[serde(default)]
    experiments: Option<PathBuf>,
    /// Folder of recordings, `runs` without the key; with `rigs`, each rig has a folder of its name in it. Relative to systemd's state
    /// directory if there is one, else to the working directory.
    #[serde(default = "runs")]
    recordings: PathBuf,
    /// Where the service listens, and to whom it connects.
    #[serde(default)]
    bus: BusSection,
    /// Format and filter of the log.
    #[serde(default)]
    log: LogSection,
}

#[derive(Debug, Deserialize)]
#[serde(untagged)]
enum RawRigs {
    Folder(PathBuf),
    Files(Vec<PathBuf>),
}

impl Default for BusSection {
    fn default() -> Self {
        Self { listen: loopback(), connect: Vec::new(), guests: Vec::new(), frames_kept: None, tls: None }
    }
}

impl Default for LogSection {
    fn default() -> Self {
        Self { format: LogFormat::default(), filter: info() }
    }
}

impl ServiceConfig {
    /// Reads and checks the file, the rig files that it names, and the files that they name. Paths are relative to
    /// the configuration's folder, except `recordings`: that is relative to systemd's state directory if there is one, else
    /// to the working directory.
    ///
    /// # Errors
    /// [`ConfigError`] names the file, and the line or field in it.
    pub fn load(path: &Path) -> Result<Self, ConfigError> {
        let raw: RawConfig = toml::from_str(&read(path)?)
            .map_err(|source| ConfigError::Form { path: path.to_owned(), source })?;
        let folder = path.parent().unwrap_or(Path::new("."));
        let rigs = match (raw.rig, raw.rigs) {
            (Some(rig), None) => Rigs::one(load_rig(&folder.join(rig))?),
            (None, Some(RawRigs::Folder(rigs))) => Rigs::load(files_in_folder(&folder.join(rigs))?)?,
            (None, Some(RawRigs::Files(files))) if !files.is_empty() => {
                Rigs::load(files.into_iter().map(|file| folder.join(file)).collect())?
            }
            (None | Some(_), _) => return Err(ConfigError::Rigs { path: path.to_owned() }),
        };
        let experiments = raw.experiments.map(|experiments| folder.join(experiments));
        if let Some(folder) = experiments.clone().filter(|folder| !folder.is_dir()) {
            return Err(ConfigError::Experiments { path: path.to_owned(), folder });
        }
        let state = crate::state::of_service().unwrap_or_default();
        let bus = raw.bus.beside(folder);
        Ok(Self { rigs, experiments, recordings: state.join(raw.recordings), bus, log: raw.log })
    }
}

impl ServiceConfig {
    /// Folder of a rig's recordings.
    pub fn recordings_of(&self, rig: &str) -> PathBuf {
        if self.rigs.are_several { self.recordings.join(rig) } else { self.recordings.clone() }
    }
}

impl BusSection {
    /// With the paths of certificates relative to a folder.
    fn beside(self, folder: &Path) -> Self {
        let tls = self.tls.map(|tls| TlsSection {
            authority: folder.join(tls.authority),
            certificate: folder.join(tls.certificate),
            key: folder.join(tls.key),
            check_certificate: tls.check_certificate.map(|file| folder.join(file)),
            check_key: tls.check_key.map(|file| folder.join(file)),
            ..tls
        });
        Self { tls, ..self }
    }
}

impl RigFiles {
    /// A rig that a service can use, from the text of its file. The path of a description of frames is relative to `path`.
    ///
    /// # Errors
    /// As [`ServiceConfig::load`].
    pub fn of(text: &str, path: &Path) -> Result<Self, ConfigError> {
        let rig =
            Rig::from_toml(text).map_err(|source| ConfigError::Rig { path: path.to_owned(), source })?;
        if rig.service.is_none() {
            return Err(ConfigError::NoService { path: path.to_owned() });
        }
        let (codec, link) = SensorCodec::load(&rig, path)?;
        let texts = RigTexts { rig_toml: text.to_owned(), link_toml: link.map(|link| link.text) };
        Ok(Self { path: path.to_owned(), rig, codec, texts })
    }
}

impl RigTexts {
    /// All texts.
    pub fn all(&self) -> Texts<'_> {
        Texts { rig_toml: Some(&self.rig_toml), link_toml: self.link_toml.as_deref() }
    }

    /// Without the rig file, for runs in which its `[simulation]` does not hold.
    pub fn without_rig(&self) -> Texts<'_> {
        Texts { rig_toml: None, ..self.all() }
    }
}

/// Reads a rig file that a service can use, and the description of its sensor's frames if it names one.
///
/// # Errors
/// As [`ServiceConfig::load`].
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
