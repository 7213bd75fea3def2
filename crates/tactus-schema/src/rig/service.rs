//! What the lab service needs of a rig, as the rig file writes it: limits, motion, policy, links.

use serde::Deserialize;

use super::stage::RawStageLink;
use super::{Envelope, Motion, OnGap, Policy, SensorLink, SensorProtocol, Service, Transport};
use crate::description::{WrongField, not_negative, positive, range, wrong};

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawEnvelope {
    x_mm: [f64; 2],
    y_mm: [f64; 2],
    z_max_mm: f64,
    depth_share_max: f64,
    speed_max_mm_per_s: f64,
    load_speed_max_mm_per_s: f64,
    element_max_counts: f64,
    sum_max_counts: f64,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawMotion {
    safe_height_mm: f64,
    approach_height_mm: f64,
    travel_speed_mm_per_s: f64,
    load_speed_mm_per_s: f64,
    settle_s: f64,
    tolerance_mm: f64,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawPolicy {
    on_gap: RawOnGap,
    reconnect_s: f64,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum RawOnGap {
    Repeat,
    Fail,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawSensorLink {
    protocol: RawSensorProtocol,
    transport: RawTransport,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum RawSensorProtocol {
    WeissDsa,
}

#[derive(Debug, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub(super) enum RawTransport {
    Embedded,
    Serial { path: String, baud: u32 },
    Tcp { address: String },
}

/// All of the parts, or none.
pub(super) fn check(
    envelope: Option<RawEnvelope>,
    motion: Option<RawMotion>,
    policy: Option<RawPolicy>,
    sensor: Option<RawSensorLink>,
    stage: Option<RawStageLink>,
) -> Result<Option<Service>, WrongField> {
    match (envelope, motion, policy, sensor, stage) {
        (None, None, None, None, None) => Ok(None),
        (Some(envelope), Some(motion), Some(policy), Some(sensor), Some(stage)) => {
            let envelope = envelope.check()?;
            Ok(Some(Service {
                motion: motion.check(&envelope)?,
                envelope,
                policy: policy.check()?,
                sensor: sensor.check()?,
                stage: stage.check()?,
            }))
        }
        (envelope, motion, policy, sensor, stage) => {
            let parts = [
                ("envelope", envelope.is_none()),
                ("motion", motion.is_none()),
                ("policy", policy.is_none()),
                ("sensor", sensor.is_none()),
                ("stage", stage.is_none()),
            ];
            let missing: Vec<_> = parts.iter().filter(|(_, absent)| *absent).map(|(name, _)| *name).collect();
            Err(wrong(
                missing.join(", "),
                "missing; a service needs all of envelope, motion, policy, sensor, stage",
            ))
        }
    }
}

impl RawEnvelope {
    fn check(self) -> Result<Envelope, WrongField> {
        let field = |name: &str| format!("envelope.{name}");
        let Self { load_speed_max_mm_per_s, depth_share_max, .. } = self;
        if !(depth_share_max > 0.0 && depth_share_max < 1.0) {
            return Err(wrong(
                field("depth_share_max"),
                "a share of the covering's thickness between 0 and 1",
            ));
        }
        Ok(Envelope {
            x_mm: range(field("x_mm"), self.x_mm)?,
            y_mm: range(field("y_mm"), self.y_mm)?,
            z_max_mm: positive(field("z_max_mm"), self.z_max_mm)?,
            depth_share_max,
            speed_max_mm_per_s: positive(field("speed_max_mm_per_s"), self.speed_max_mm_per_s)?,
            load_speed_max_mm_per_s: positive(field("load_speed_max_mm_per_s"), load_speed_max_mm_per_s)?,
            element_max_counts: positive(field("element_max_counts"), self.element_max_counts)?,
            sum_max_counts: positive(field("sum_max_counts"), self.sum_max_counts)?,
        })
    }
}

/// A move that ends further away than this has not arrived.
const TOLERANCE_MAX_MM: f64 = 0.05;

impl RawMotion {
    fn check(self, envelope: &Envelope) -> Result<Motion, WrongField> {
        let field = |name: &str| format!("motion.{name}");
        let motion = Motion {
            safe_height_mm: positive(field("safe_height_mm"), self.safe_height_mm)?,
            approach_height_mm: positive(field("approach_height_mm"), self.approach_height_mm)?,
            travel_speed_mm_per_s: positive(field("travel_speed_mm_per_s"), self.travel_speed_mm_per_s)?,
            load_speed_mm_per_s: positive(field("load_speed_mm_per_s"), self.load_speed_mm_per_s)?,
            settle_s: not_negative(field("settle_s"), self.settle_s)?,
            tolerance_mm: positive(field("tolerance_mm"), self.tolerance_mm)?,
        };
        // It is also the supervisor's slack at the depth limit.
        if motion.tolerance_mm > TOLERANCE_MAX_MM {
            return Err(wrong(field("tolerance_mm"), format!("at most {TOLERANCE_MAX_MM}")));
        }
        for (name, value, bound_field, bound) in [
            ("safe_height_mm", motion.safe_height_mm, "envelope.z_max_mm", envelope.z_max_mm),
            ("approach_height_mm", motion.approach_height_mm, "motion.safe_height_mm", motion.safe_height_mm),
            (
                "travel_speed_mm_per_s",
                motion.travel_speed_mm_per_s,
                "envelope.speed_max_mm_per_s",
                envelope.speed_max_mm_per_s,
            ),
            (
                "load_speed_mm_per_s",
                motion.load_speed_mm_per_s,
                "envelope.load_speed_max_mm_per_s",
                envelope.load_speed_max_mm_per_s,
            ),
        ] {
            if value > bound {
                return Err(wrong(field(name), format!("{value} exceeds {bound_field} = {bound}")));
            }
        }
        Ok(motion)
    }
}

impl RawPolicy {
    fn check(self) -> Result<Policy, WrongField> {
        let reconnect_s = not_negative("policy.reconnect_s", self.reconnect_s)?;
        if reconnect_s > 3600.0 {
            return Err(wrong("policy.reconnect_s", "at most 3600"));
        }
        Ok(Policy {
            on_gap: match self.on_gap {
                RawOnGap::Repeat => OnGap::Repeat,
                RawOnGap::Fail => OnGap::Fail,
            },
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "0 to 3600 s, checked above"
            )]
            reconnect_ms: (reconnect_s * 1000.0) as u32,
        })
    }
}

impl RawSensorLink {
    fn check(self) -> Result<SensorLink, WrongField> {
        Ok(SensorLink {
            protocol: match self.protocol {
                RawSensorProtocol::WeissDsa => SensorProtocol::WeissDsa,
            },
            transport: self.transport.check("sensor.transport")?,
        })
    }
}

impl RawTransport {
    pub(super) fn check(self, field: &str) -> Result<Transport, WrongField> {
        match self {
            Self::Embedded => Ok(Transport::Embedded),
            Self::Serial { path, baud } if !path.is_empty() && baud > 0 => {
                Ok(Transport::Serial { path, baud })
            }
            Self::Serial { .. } => {
                Err(wrong(field, "a serial transport needs a path and a baud rate above 0"))
            }
            Self::Tcp { address }
                if address.rsplit_once(':').is_some_and(|(_, port)| port.parse::<u16>().is_ok()) =>
            {
                Ok(Transport::Tcp { address })
            }
            Self::Tcp { address } => Err(wrong(field, format!("address {address:?} is not host:port"))),
        }
    }
}
