//! The rig file's sections for the lab service: limits, motion, policy, links.

use serde::Deserialize;
use tactus_model::{Array, Covering};

use super::stage::RawStageLink;
use super::transport::RawTransport;
use super::{
    ANYSKIN_SHAPE, Envelope, Motion, OnGap, Policy, SensorLink, SensorProtocol, Service, WeissChecksum,
};
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
    depth_max_mm: Option<f64>,
    baseline_band_counts: Option<f64>,
    #[serde(default)]
    unwatched_elements: Vec<usize>,
    expects_response: Option<bool>,
}

/// `envelope.baseline_band_counts` where the file does not say it, as a share of `envelope.element_max_counts`.
const BASELINE_BAND_SHARE: f64 = 0.25;

/// Share of full scale that baseline, its band and the element's limit together must stay below: above it a converter may
/// saturate before the limit is reached.
const FULL_SCALE_SHARE_MAX: f64 = 0.95;

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
    /// What a run does when frames are lost in a press: `"repeat"` retracts, waits for the sensor and starts
    /// the press again; `"fail"` retracts and fails.
    on_gap: RawOnGap,
    /// How long the service waits for a lost device before the run fails.
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
    /// `"weiss-dsa"`, `"singletact"`, `"anyskin"` or `"declared"`.
    protocol: RawSensorProtocol,
    /// How bytes get to the sensor.
    transport: RawTransport,
    /// Of `weiss-dsa`: `"crc"`, the default, or `"sum8"` for older firmware.
    checksum: Option<RawWeissChecksum>,
    /// Of `singletact`: the address of each element.
    addresses: Option<Vec<u16>>,
    /// Of `declared`: the file that describes the frames, relative to the rig file.
    format: Option<String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum RawSensorProtocol {
    WeissDsa,
    #[serde(rename = "singletact")]
    SingleTact,
    #[serde(rename = "anyskin")]
    AnySkin,
    Declared,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum RawWeissChecksum {
    Crc,
    Sum8,
}

/// The rig's state at rest, which the limits refer to.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rest<'a> {
    pub(super) covering: Covering,
    pub(super) baseline_counts: &'a [f64],
    pub(super) sensitivity_counts_per_mm: &'a [f64],
}

/// Checks the sections; they are present together or not at all.
pub(super) fn check(
    array: &Array,
    rest: Rest<'_>,
    envelope: Option<RawEnvelope>,
    motion: Option<RawMotion>,
    policy: Option<RawPolicy>,
    sensor: Option<RawSensorLink>,
    stage: Option<RawStageLink>,
) -> Result<Option<Service>, WrongField> {
    match (envelope, motion, policy, sensor, stage) {
        (None, None, None, None, None) => Ok(None),
        (Some(envelope), Some(motion), Some(policy), Some(sensor), Some(stage)) => {
            let envelope = envelope.check(array, rest)?;
            Ok(Some(Service {
                motion: motion.check(&envelope)?,
                envelope,
                policy: policy.check()?,
                sensor: sensor.check(array)?,
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
    fn check(self, array: &Array, rest: Rest<'_>) -> Result<Envelope, WrongField> {
        let field = |name: &str| format!("envelope.{name}");
        let Self { load_speed_max_mm_per_s, depth_share_max, .. } = self;
        if !(depth_share_max > 0.0 && depth_share_max < 1.0) {
            return Err(wrong(
                field("depth_share_max"),
                "a share of the covering's thickness between 0 and 1",
            ));
        }
        let depth_max_mm = self.depth_max_mm.unwrap_or(depth_share_max * rest.covering.thickness_mm);
        let element_max_counts = positive(field("element_max_counts"), self.element_max_counts)?;
        let band_counts = self.baseline_band_counts.unwrap_or(BASELINE_BAND_SHARE * element_max_counts);
        let baseline_band_counts = positive(field("baseline_band_counts"), band_counts)?;
        if let Some(element) = self.unwatched_elements.iter().find(|element| **element >= array.elements()) {
            let problem = format!("{element} is no element: there are {}, from 0", array.elements());
            return Err(wrong(field("unwatched_elements"), problem));
        }
        check_headroom(array, rest, element_max_counts + baseline_band_counts, &self.unwatched_elements)?;
        Ok(Envelope {
            x_mm: range(field("x_mm"), self.x_mm)?,
            y_mm: range(field("y_mm"), self.y_mm)?,
            z_max_mm: positive(field("z_max_mm"), self.z_max_mm)?,
            depth_share_max,
            speed_max_mm_per_s: positive(field("speed_max_mm_per_s"), self.speed_max_mm_per_s)?,
            load_speed_max_mm_per_s: positive(field("load_speed_max_mm_per_s"), load_speed_max_mm_per_s)?,
            element_max_counts,
            sum_max_counts: positive(field("sum_max_counts"), self.sum_max_counts)?,
            depth_max_mm: positive(field("depth_max_mm"), depth_max_mm)?,
            baseline_band_counts,
            unwatched_elements: self.unwatched_elements,
            expects_response: self.expects_response.unwrap_or(true),
        })
    }
}

/// Checks that no element can reach the end of its range before its limit. An element that falls when it is pressed has its
/// end at the array's least count; where that is not said, and the element rests at 0 or below, its readings have a sign.
fn check_headroom(
    array: &Array,
    rest: Rest<'_>,
    reach_counts: f64,
    unwatched: &[usize],
) -> Result<(), WrongField> {
    let full_scale_counts = array.full_scale_counts();
    // As far from either end.
    let margin_counts = (1.0 - FULL_SCALE_SHARE_MAX) * full_scale_counts;
    let least_counts = |baseline_counts: f64| {
        let is_signed = array.least_counts() == 0.0 && baseline_counts <= 0.0;
        if is_signed { -full_scale_counts } else { array.least_counts() }
    };
    let pairs = rest.baseline_counts.iter().zip(rest.sensitivity_counts_per_mm).enumerate();
    for (element, (baseline_counts, sensitivity)) in pairs.filter(|(element, _)| !unwatched.contains(element))
    {
        let room_counts = if *sensitivity >= 0.0 {
            full_scale_counts - margin_counts - baseline_counts
        } else {
            baseline_counts - (least_counts(*baseline_counts) + margin_counts)
        };
        if reach_counts > room_counts {
            let problem = format!(
                "with baseline_band_counts {reach_counts} counts, but element {element} has only {room_counts:.0} between its \
                 baseline and 5 % of full scale before the end of its range: a load could saturate it unseen"
            );
            return Err(wrong("envelope.element_max_counts", problem));
        }
    }
    Ok(())
}

/// Greatest allowed `motion.tolerance_mm`.
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
        // The supervisor allows this much beyond the depth limit.
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

/// The greatest address on an I2C bus.
const I2C_ADDRESSES: u16 = 128;

impl RawSensorLink {
    fn check(self, array: &Array) -> Result<SensorLink, WrongField> {
        let Self { protocol, transport, checksum, addresses, format } = self;
        let keys = [
            ("checksum", checksum.is_some(), RawSensorProtocol::WeissDsa),
            ("addresses", addresses.is_some(), RawSensorProtocol::SingleTact),
            ("format", format.is_some(), RawSensorProtocol::Declared),
        ];
        if let Some((key, _, owner)) = keys.iter().find(|(_, given, owner)| *given && *owner != protocol) {
            let problem = format!(
                "belongs to protocol = {:?}, not to {:?}; leave it out",
                owner.name(),
                protocol.name()
            );
            return Err(wrong(format!("sensor.{key}"), problem));
        }
        Ok(SensorLink {
            protocol: match protocol {
                RawSensorProtocol::WeissDsa => SensorProtocol::WeissDsa {
                    checksum: match checksum {
                        None | Some(RawWeissChecksum::Crc) => WeissChecksum::Crc,
                        Some(RawWeissChecksum::Sum8) => WeissChecksum::Sum8,
                    },
                },
                RawSensorProtocol::SingleTact => {
                    SensorProtocol::SingleTact { addresses: check_addresses(addresses, array)? }
                }
                RawSensorProtocol::AnySkin => check_anyskin(array)?,
                RawSensorProtocol::Declared => SensorProtocol::Declared { format: check_format(format)? },
            },
            transport: transport.check("sensor.transport")?,
        })
    }
}

impl RawSensorProtocol {
    /// Its value in the rig file.
    fn name(self) -> &'static str {
        match self {
            Self::WeissDsa => "weiss-dsa",
            Self::SingleTact => "singletact",
            Self::AnySkin => "anyskin",
            Self::Declared => "declared",
        }
    }
}

/// Checks that there is one address for each element, and each address once.
fn check_addresses(addresses: Option<Vec<u16>>, array: &Array) -> Result<Vec<u8>, WrongField> {
    let field = "sensor.addresses";
    let Some(addresses) = addresses else {
        let problem =
            "missing; list the I2C address of every element, [4] for one that was given none of its own";
        return Err(wrong(field, problem));
    };
    if addresses.len() != array.elements() {
        let (rows, cols) = (array.rows(), array.cols());
        let problem = format!(
            "lists {} addresses, one for each element, but array.rows and array.cols say {rows} x {cols}",
            addresses.len()
        );
        return Err(wrong(field, problem));
    }
    let mut checked = Vec::with_capacity(addresses.len());
    for address in addresses {
        let narrow = u8::try_from(address).ok().filter(|_| address < I2C_ADDRESSES);
        let narrow = narrow.ok_or_else(|| wrong(field, format!("{address} is no I2C address: 0 to 127")))?;
        if checked.contains(&narrow) {
            return Err(wrong(field, format!("{address} is there twice; give each element its own")));
        }
        checked.push(narrow);
    }
    Ok(checked)
}

fn check_anyskin(array: &Array) -> Result<SensorProtocol, WrongField> {
    let shape = [array.rows(), array.cols()];
    if shape == ANYSKIN_SHAPE {
        return Ok(SensorProtocol::AnySkin);
    }
    let ([rows, cols], [own_rows, own_cols]) = (shape, ANYSKIN_SHAPE);
    let problem = format!(
        "\"anyskin\" is {own_rows} magnetometers by {own_cols} axes, but array.rows and array.cols say {rows} x {cols}"
    );
    Err(wrong("sensor.protocol", problem))
}

fn check_format(format: Option<String>) -> Result<String, WrongField> {
    format.filter(|path| !path.is_empty()).ok_or_else(|| {
        let problem = "missing; name the file that describes the frames, such as \"../links/digitacts.toml\"";
        wrong("sensor.format", problem)
    })
}
