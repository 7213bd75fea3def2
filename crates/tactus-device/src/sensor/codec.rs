//! How a sensor is spoken to.

use std::sync::Arc;

use tactus_schema::rig::{SensorProtocol, WeissChecksum};
use tactus_wire::declared::{Format, Framing};
use tactus_wire::singletact;
use tactus_wire::weiss::Checksum;

use super::anyskin::Board;
use super::conversation::{Conversation, Loss};
use super::declared::{Listener, TickLength};
use super::driver::ArrayExpectation;
use super::singletact::Poller;
use super::weiss::{self, Controller};
use crate::ErrorKind;

/// How a sensor is spoken to: a rig file's `[sensor]` and the file that it may name.
///
/// | codec | speaks first | device's clock | frames lost on the way are counted by |
/// |---|---|---|---|
/// | `WeissDsa` | the host, once | 1 ms | the device's clock |
/// | `SingleTact` | the host, for each reading | 0.1 ms | rounds of polls without a reading |
/// | `AnySkin` | the device | none | damage among the bytes, and the host's clock |
/// | `Declared` | the device | as described | its count of frames, or its clock, or as `AnySkin` |
///
/// By the host's clock alone, a frame behind a loss looks like one that was held up: the gap is told with the next
/// frame, one too late.
#[derive(Debug, Clone, PartialEq)]
pub enum SensorCodec {
    /// `weiss-dsa`.
    WeissDsa {
        /// How packets are closed.
        checksum: Checksum,
    },
    /// `singletact`; an element for each address.
    SingleTact {
        /// Of the elements, on the board's bus.
        addresses: Vec<u8>,
    },
    /// `anyskin`: counts are microteslas, by magnetometer and axis.
    AnySkin,
    /// Frames that are described.
    Declared {
        /// The description.
        format: Arc<Format>,
    },
}

impl Default for SensorCodec {
    /// That of the simulated rig.
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

    /// Its name in [`SensorInfo.link`](tactus_schema::pb::SensorInfo::link).
    pub(super) fn name(&self) -> String {
        match self {
            Self::WeissDsa { checksum: Checksum::Crc } => "weiss-dsa".to_owned(),
            Self::WeissDsa { checksum: Checksum::Sum8 } => "weiss-dsa, sum8".to_owned(),
            Self::SingleTact { .. } => "singletact".to_owned(),
            Self::AnySkin => "anyskin".to_owned(),
            Self::Declared { format } => format!("declared, {}", format.name()),
        }
    }

    /// Length of the device's tick in ns; 0 if it has no clock.
    pub(super) fn tick_ns(&self) -> u64 {
        let ns = |tick: std::time::Duration| u64::try_from(tick.as_nanos()).unwrap_or(u64::MAX);
        match self {
            Self::WeissDsa { .. } => ns(weiss::TICK),
            Self::SingleTact { .. } => ns(singletact::TICK),
            Self::AnySkin => 0,
            Self::Declared { format } => TickLength::of(format).told_ns,
        }
    }

    /// The longest packet of which one read must hold all; `None` where bytes are a stream.
    pub(super) fn packet_bytes(&self) -> Option<usize> {
        match self {
            Self::Declared { format } if format.framing() == Framing::Packet => Some(format.frame_bytes()),
            Self::WeissDsa { .. } | Self::SingleTact { .. } | Self::AnySkin | Self::Declared { .. } => None,
        }
    }

    /// A conversation that has not started.
    pub(super) fn converse(
        &self,
        expect: &ArrayExpectation,
        device: &str,
    ) -> Result<Box<dyn Conversation>, Loss> {
        Ok(match self {
            Self::WeissDsa { checksum } => Box::new(Controller::new(*checksum, expect, device)),
            Self::SingleTact { addresses } => Box::new(
                Poller::new(addresses, expect.rate_hz)
                    .map_err(|error| Loss::new(ErrorKind::Protocol, error.to_string()))?,
            ),
            Self::AnySkin => Box::new(Board::default()),
            Self::Declared { format } => Box::new(Listener::new(format)),
        })
    }
}
