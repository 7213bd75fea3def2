//! Reads the file that describes frames (`tactus.link/1`), and compares it with the rig.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use tactus_schema::Rig;
use tactus_schema::rig::{SensorProtocol, Transport};
use tactus_wire::declared::{Format, FormatError, Framing, RawFormat, RawSamples};

use super::SensorCodec;

/// A description of frames, as it was read from a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LinkFile {
    /// Path of the file.
    pub path: PathBuf,
    /// Text of the file; recordings contain a copy.
    pub text: String,
}

/// Why the format file that a rig file names cannot be used.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum LinkFileError {
    /// It could not be read.
    #[error("{}: sensor.format: {} cannot be read: {source}", rig_file.display(), path.display())]
    Read { rig_file: PathBuf, path: PathBuf, source: io::Error },
    /// It is not a description; the message names line and key.
    #[error("{}: {source}", path.display())]
    Form { path: PathBuf, source: toml::de::Error },
    /// It contradicts itself.
    #[error("{}: {source}", path.display())]
    Format { path: PathBuf, source: FormatError },
    /// It contradicts the rig file.
    #[error("{}: {contradiction} in {}", path.display(), rig_file.display())]
    Rig { path: PathBuf, rig_file: PathBuf, contradiction: String },
}

impl SensorCodec {
    /// The codec of a rig that was read from `rig_file`, and the format file if the rig names one. That file is read and
    /// compared with the rig. A rig without a `[service]` has the default codec.
    ///
    /// # Errors
    /// [`LinkFileError`] names the file and the field, and both fields of a contradiction.
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

/// The first difference between the description and the rig, in words.
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
    if let Some((least, _)) = samples.kind.range()
        && array.least_counts() < least
    {
        return Some(format!(
            "samples.type is at least {least}, but array.least_counts is {}",
            array.least_counts()
        ));
    }
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
    // Only links that preserve packets return one with each read.
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
