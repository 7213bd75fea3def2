//! The start of a recording: the run's metadata and attached files.

use std::collections::BTreeMap;

use tactus_schema::{Rig, WallTime};

/// Name of the metadata record that distinguishes a run's recording from any other MCAP file.
pub(crate) const METADATA_NAME: &str = "tactus.run";

/// Name of the program in the file's header, before its version.
pub(crate) const LIBRARY: &str = "tactus-record";

/// Key of the checksum over the other fields of the metadata record: MCAP has none for it.
const CHECKSUM: &str = "crc32";

/// Attachment: the rig as JSON, [`tactus_schema::rig::SCHEMA`].
pub(crate) const RIG_JSON: &str = "rig.json";
/// Attachment: the rig file as it was read.
pub(crate) const RIG_TOML: &str = "rig.toml";
/// Attachment: the description of the sensor's frames (`tactus.link/1`) that the rig file names, as it was read.
pub(crate) const LINK_TOML: &str = "link.toml";
/// Attachment: name to version, as a JSON object.
pub(crate) const VERSIONS_JSON: &str = "versions.json";
/// Attachment: the parameters as the script saw them, as a JSON object.
pub(crate) const PARAMETERS_JSON: &str = "parameters.json";

/// The inputs of a run, known when it begins.
#[derive(Debug, Clone, Copy)]
pub struct Header<'a> {
    /// Id of the run.
    pub run_id: &'a str,
    /// Name of the experiment.
    pub experiment: &'a str,
    /// Who started the run.
    pub who: &'a str,
    /// The rig it runs on; its name goes into the topics.
    pub rig: &'a Rig,
    /// The rig file as it was read; `None` if its statements about simulated devices do not hold for this run.
    pub rig_toml: Option<&'a str>,
    /// The description of the sensor's frames as it was read, if the rig file names one.
    pub link_toml: Option<&'a str>,
    /// The experiment's script.
    pub script: Script<'a>,
    /// Versions, by name, of everything that takes part.
    pub versions: &'a BTreeMap<String, String>,
    /// The parameters as the script sees them, as a JSON object.
    pub parameters_json: &'a str,
    /// When it began.
    pub started: WallTime,
    /// True if no physical sensor is read.
    pub simulated: bool,
    /// Id of the earlier run that this one goes on with, if it does.
    pub continues: Option<&'a str>,
}

/// An experiment's script.
#[derive(Debug, Clone, Copy)]
pub struct Script<'a> {
    /// File name, such as `element-centres.star`; becomes the attachment's name.
    pub name: &'a str,
    /// The script's text.
    pub source: &'a str,
}

/// The metadata record `tactus.run`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RunMetadata {
    /// Id of the run.
    pub run_id: String,
    /// Name of the experiment.
    pub experiment: String,
    /// Who started the run.
    pub who: String,
    /// Name of the rig.
    pub rig: String,
    /// Name of the attachment that holds the script.
    pub script: String,
    /// True if no physical sensor was read.
    pub simulated: bool,
    /// When it began.
    pub started: WallTime,
    /// Id of the earlier run that it goes on with, if it does.
    pub continues: Option<String>,
}

/// A file attached to the recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Attachment {
    /// File name.
    pub name: String,
    /// Media type, such as `application/json`.
    pub media_type: String,
    /// When it was written.
    pub written: WallTime,
    /// Its bytes.
    pub data: Vec<u8>,
}

impl Header<'_> {
    pub(crate) fn metadata(&self) -> RunMetadata {
        RunMetadata {
            run_id: self.run_id.into(),
            experiment: self.experiment.into(),
            who: self.who.into(),
            rig: self.rig.name.clone(),
            script: self.script.name.into(),
            simulated: self.simulated,
            started: self.started,
            continues: self.continues.map(str::to_owned),
        }
    }

    pub(crate) fn attachments(&self) -> Vec<Attachment> {
        let attach = |name: &str, media_type: &str, text: String| Attachment {
            name: name.into(),
            media_type: media_type.into(),
            written: self.started,
            data: text.into_bytes(),
        };
        let versions = serde_json::Value::from_iter(self.versions.clone());
        let rig_toml = self.rig_toml.map(|text| attach(RIG_TOML, "application/toml", text.into()));
        let link_toml = self.link_toml.map(|text| attach(LINK_TOML, "application/toml", text.into()));
        let rig_json = attach(RIG_JSON, "application/json", self.rig.to_json());
        let others = [
            attach(self.script.name, "text/x-starlark", self.script.source.into()),
            attach(VERSIONS_JSON, "application/json", versions.to_string()),
            attach(PARAMETERS_JSON, "application/json", self.parameters_json.into()),
        ];
        [rig_json].into_iter().chain(rig_toml).chain(link_toml).chain(others).collect()
    }
}

impl RunMetadata {
    pub(crate) fn to_record(&self) -> mcap::records::Metadata {
        let field = |name: &str, value: String| (name.to_owned(), value);
        let mut metadata = BTreeMap::from([
            field("run_id", self.run_id.clone()),
            field("experiment", self.experiment.clone()),
            field("who", self.who.clone()),
            field("rig", self.rig.clone()),
            field("script", self.script.clone()),
            field("simulated", self.simulated.to_string()),
            field("started_wall_ns", self.started.ns().to_string()),
        ]);
        metadata.extend(self.continues.clone().map(|run_id| field("continues", run_id)));
        metadata.insert(CHECKSUM.into(), checksum(&metadata));
        mcap::records::Metadata { name: METADATA_NAME.into(), metadata }
    }

    /// False if the record has a checksum, and it is wrong.
    pub(crate) fn checked(record: &mcap::records::Metadata) -> bool {
        record.name != METADATA_NAME
            || record.metadata.get(CHECKSUM).is_none_or(|written| *written == checksum(&record.metadata))
    }

    /// Reads the metadata record; the error is the name of the field that is missing or wrong.
    pub(crate) fn from_record(record: &mcap::records::Metadata) -> Result<Self, &'static str> {
        let field = |name: &'static str| record.metadata.get(name).cloned().ok_or(name);
        Ok(Self {
            run_id: field("run_id")?,
            experiment: field("experiment")?,
            who: field("who")?,
            rig: field("rig")?,
            script: field("script")?,
            simulated: field("simulated")?.parse().map_err(|_| "simulated")?,
            started: WallTime::from_ns(field("started_wall_ns")?.parse().map_err(|_| "started_wall_ns")?),
            continues: field("continues").ok(),
        })
    }
}

/// The checksum of all other fields, as text.
fn checksum(fields: &BTreeMap<String, String>) -> String {
    let mut hasher = crc32fast::Hasher::new();
    for text in fields.iter().filter(|(name, _)| *name != CHECKSUM).flat_map(|(name, value)| [name, value]) {
        hasher.update(&(text.len() as u64).to_le_bytes());
        hasher.update(text.as_bytes());
    }
    format!("{:08x}", hasher.finalize())
}
