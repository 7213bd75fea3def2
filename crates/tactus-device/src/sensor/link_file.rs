//! The file that describes frames (`tactus.link/1`), read for a rig and held against it.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use tactus_schema::Rig;
use tactus_schema::rig::{SensorProtocol, Transport};
use tactus_wire::declared::{Format, FormatError, Framing, RawFormat, RawSamples};

use super::SensorCodec;

/// A description of frames as it was read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LinkFile {
    /// Where it stands.
    pub path: PathBuf,
    /// What it says, for recordings.
    pub text: String,
}

/// Why the file that a rig file names cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum LinkFileError {
    /// It could not be read.
    #[error("{}: sensor.format: {} cannot be read: {source}", rig_file.display(), path.display())]
    Read {
        /// The rig file.
        rig_file: PathBuf,
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// It is not of the right form; the text names line and key.
    #[error("{}: {source}", path.display())]
    Form {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: toml::de::Error,
    },
    /// It contradicts itself.
    #[error("{}: {source}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: FormatError,
    },
    /// It contradicts the rig file.
    #[error("{}: {contradiction} in {}", path.display(), rig_file.display())]
    Rig {
        /// The file.
        path: PathBuf,
        /// The rig file.
        rig_file: PathBuf,
        /// Both fields and what they say; ends with the rig file's.
        contradiction: String,
    },
}

impl SensorCodec {
    /// The codec of a rig that was read from `rig_file`, with the description of its frames if the rig file names
    /// one: that file is read and held against the rig. A rig without a service has the default.
    ///
    /// # Errors
    /// [`LinkFileError`] names the file and the field, and of a contradiction both fields.
    pub fn load(rig: &Rig, rig_file: &Path) -> Result<(Self, Option<LinkFile>), LinkFileError> {
        let Some(service) = &rig.service else { return Ok((Self::default(), None)) };
        let protocol = &service.sensor.protocol;
        let SensorProtocol::Declared { format } = protocol else {
            return Ok((Self::of(protocol).unwrap_or_default(), None));
        };
        let path = rig_file.parent().unwrap_or(Path::new("")).join(format);
        let text = fs::read_to_string(&path).map_err(|source| LinkFileError::Read {
            rig_file: rig_file.to_owned(),
            path: path.clone(),
            source,
        })?;
        let raw: RawFormat =
            toml::from_str(&text).map_err(|source| LinkFileError::Form { path: path.clone(), source })?;
        let samples = raw.samples.clone();
        let format = raw.check().map_err(|source| LinkFileError::Format { path: path.clone(), source })?;
        match contradiction(&format, &samples, rig, &service.sensor.transport) {
            None => Ok((Self::Declared { format: Arc::new(format) }, Some(LinkFile { path, text }))),
            Some(contradiction) => {
                Err(LinkFileError::Rig { path, rig_file: rig_file.to_owned(), contradiction })
            }
        }
    }
}

/// What the description and the rig say differently.
fn contradiction(format: &Format, samples: &RawSamples, rig: &Rig, transport: &Transport) -> Option<String> {
    let (array, elements) = (&rig.array, format.samples().elements());
    let (rows, cols) = (array.rows(), array.cols());
    if elements != array.elements() {
        return Some(format!(
            "samples.elements is {elements}, but array.rows and array.cols are {rows} x {cols}"
        ));
    }
    if let (Some(own_rows), Some(own_cols)) = (samples.rows, samples.cols)
        && (own_rows, own_cols) != (rows, cols)
    {
        return Some(format!(
            "samples.rows and samples.cols are {own_rows} x {own_cols}, but array.rows and array.cols are {rows} x {cols}"
        ));
    }
    let full_scale_counts = array.full_scale_counts();
    if let Some((_, greatest)) = samples.kind.range()
        && full_scale_counts > greatest
    {
        return Some(format!(
            "samples.type is at most {greatest}, but array.full_scale_counts is {full_scale_counts}"
        ));
    }
    if let (Some((interface, endpoint)), Transport::Usb(link)) =
        (format.usb_interface_and_endpoint(), transport)
        && (interface, endpoint) != (link.interface, link.endpoint_in)
    {
        return Some(format!(
            "usb.interface and usb.endpoint are {interface} and {endpoint:#04x}, but sensor.transport has {} and {:#04x}",
            link.interface, link.endpoint_in
        ));
    }
    if format.framing() == Framing::Stream {
        return None;
    }
    // What keeps packets apart comes with one read each.
    let stream = match transport {
        Transport::Serial { .. } => "serial",
        Transport::Tcp { .. } => "tcp",
        Transport::Embedded => "embedded",
        Transport::Usb(_) | Transport::Hid(_) => return None,
    };
    Some(format!(
        "framing is \"packet\", which needs a device that sends packets, such as a HID (or write framing = \"stream\" \
         and frame.sync), but sensor.transport is {stream:?}"
    ))
}

#[cfg(test)]
#[path = "link_file_tests.rs"]
mod tests;
