//! The factory that makes a protocol session from a rig file.

use std::sync::Arc;
use std::time::Duration;

use tactus_schema::rig::{SensorProtocol, WeissChecksum};
use tactus_wire::declared::Format;
use tactus_wire::sensor::{Cause, Loss, Session};
use tactus_wire::weiss::Checksum;
use tactus_wire::{anyskin, declared, singletact, weiss};

use super::driver::ArrayExpectation;

/// The protocol of a sensor: a rig file's `[sensor]`, with the format file that it may name.
///
/// | codec | speaks first | device's clock | lost frames are counted by |
/// |---|---|---|---|
/// | `WeissDsa` | the host, once | 1 ms | the device's clock |
/// | `SingleTact` | the host, for each reading | 0.1 ms | rounds of polls without a reading |
/// | `AnySkin` | the device | none | damage among the bytes, and the host's clock |
/// | `Declared` | the device | as described | its count of frames, or its clock, or as `AnySkin` |
///
/// By the host's clock alone, a frame after a loss looks like a delayed one. The gap is therefore reported one frame
/// late.
#[derive(Debug, Clone, PartialEq)]
pub enum SensorCodec {
    /// `weiss-dsa`.
    WeissDsa {
        /// Which checksum the controller's firmware uses.
        checksum: Checksum,
    },
    /// `singletact`.
    SingleTact {
        /// I2C addresses, one for each element.
        addresses: Vec<u8>,
    },
    /// `anyskin`: counts are microteslas, by magnetometer and axis.
    AnySkin,
    /// `declared`.
    Declared {
        /// The format as the file describes it.
        format: Arc<Format>,
    },
}

impl Default for SensorCodec {
    /// The codec of the simulated rig.
    fn default() -> Self {
        Self::WeissDsa { checksum: Checksum::default() }
    }
}

impl SensorCodec {
    /// The codec of a protocol; `None` for one that needs another file, which [`SensorCodec::load`] reads.
    pub fn of(protocol: &SensorProtocol) -> Option<Self> {
        match protocol {
            SensorProtocol::WeissDsa { checksum } => Some(Self::WeissDsa {
                checksum: match checksum {
                    WeissChecksum::Crc => Checksum::Crc,
                    WeissChecksum::Sum8 => Checksum::Sum8,
                },
            }),
            SensorProtocol::SingleTact { addresses } => {
                Some(Self::SingleTact { addresses: addresses.clone() })
            }
            SensorProtocol::AnySkin => Some(Self::AnySkin),
            SensorProtocol::Declared { .. } => None,
        }
    }

    /// A session for one connection.
    ///
    /// # Errors
    /// Addresses that cannot be polled.
    pub(super) fn session(&self, expect: &ArrayExpectation) -> Result<Box<dyn Session + Send>, Loss> {
        Ok(match self {
            Self::WeissDsa { checksum } => Box::new(weiss::Session::new(weiss::Config {
                rows: expect.rows,
                cols: expect.cols,
                fps: whole_hz(expect.rate_hz),
                run_length: false,
                checksum: *checksum,
            })),
            Self::SingleTact { addresses } => {
                let interval = Duration::try_from_secs_f64(expect.rate_hz.recip()).unwrap_or(Duration::ZERO);
                let config = singletact::Config { addresses: addresses.clone(), interval };
                let session = singletact::Session::new(config)
                    .map_err(|error| Loss { cause: Cause::Protocol, what: error.to_string() })?;
                Box::new(session)
            }
            Self::AnySkin => Box::new(anyskin::Session::new()),
            Self::Declared { format } => Box::new(declared::Session::new(format)),
        })
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates, as it should")]
fn whole_hz(rate_hz: f64) -> u16 {
    rate_hz.round() as u16
}
