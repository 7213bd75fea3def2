//! Rejections and their meanings.

/// Why a command was rejected: the word in the data of an `RJ` reply.
#[derive(Debug, Clone, PartialEq, Eq)]
#[expect(missing_docs, reason = "see `Rejection::word` and `Rejection::meaning`")]
pub enum Rejection {
    Again,
    BadAxis,
    BadCommand,
    BadData,
    BadMessageId,
    DeviceOnly,
    DriverDisabled,
    Full,
    Inactive,
    Lockstep,
    NoAccess,
    NotSupported,
    Parked,
    Remote,
    StatusBusy,
    /// Any other word.
    Other(String),
}

impl Rejection {
    /// Parses the word.
    pub fn parse(data: &str) -> Self {
        match data {
            "AGAIN" => Self::Again,
            "BADAXIS" => Self::BadAxis,
            "BADCOMMAND" => Self::BadCommand,
            "BADDATA" => Self::BadData,
            "BADMESSAGEID" => Self::BadMessageId,
            "DEVICEONLY" => Self::DeviceOnly,
            "DRIVERDISABLED" => Self::DriverDisabled,
            "FULL" => Self::Full,
            "INACTIVE" => Self::Inactive,
            "LOCKSTEP" => Self::Lockstep,
            "NOACCESS" => Self::NoAccess,
            "NOTSUPPORTED" => Self::NotSupported,
            "PARKED" => Self::Parked,
            "REMOTE" => Self::Remote,
            "STATUSBUSY" => Self::StatusBusy,
            other => Self::Other(other.to_owned()),
        }
    }

    /// The word on the wire.
    pub fn word(&self) -> &str {
        match self {
            Self::Again => "AGAIN",
            Self::BadAxis => "BADAXIS",
            Self::BadCommand => "BADCOMMAND",
            Self::BadData => "BADDATA",
            Self::BadMessageId => "BADMESSAGEID",
            Self::DeviceOnly => "DEVICEONLY",
            Self::DriverDisabled => "DRIVERDISABLED",
            Self::Full => "FULL",
            Self::Inactive => "INACTIVE",
            Self::Lockstep => "LOCKSTEP",
            Self::NoAccess => "NOACCESS",
            Self::NotSupported => "NOTSUPPORTED",
            Self::Parked => "PARKED",
            Self::Remote => "REMOTE",
            Self::StatusBusy => "STATUSBUSY",
            Self::Other(word) => word,
        }
    }

    /// What it means and what to do.
    pub fn meaning(&self) -> &'static str {
        match self {
            Self::Again => "the controller cannot take it right now: try again",
            Self::BadAxis => "the controller has no axis of this number: check the rig's axis numbers",
            Self::BadCommand => "the controller does not know the command or setting: check its firmware",
            Self::BadData => "a value is malformed or out of the controller's range",
            Self::BadMessageId => "the message id is not one of 0 to 99",
            Self::DeviceOnly => "the command is for a device, not for one of its axes",
            Self::DriverDisabled => "the motor's driver is off: see to the cause, then clear the alarm",
            Self::Full => "the controller's memory is full",
            Self::Inactive => "the axis is inactive: connect its stage, or activate it",
            Self::Lockstep => "the axis moves in lockstep with another: end the lockstep first",
            Self::NoAccess => "the access level of the controller is too low",
            Self::NotSupported => "this axis cannot do that",
            Self::Parked => "the axis is parked: unpark it",
            Self::Remote => "the controller is under remote control: end that first",
            Self::StatusBusy => "the axis is busy: it can be done only while it stands",
            Self::Other(_) => "a reason that is not in Zaber's list",
        }
    }
}

impl core::fmt::Display for Rejection {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{}: {}", self.word(), self.meaning())
    }
}

#[cfg(test)]
#[path = "rejection_tests.rs"]
mod tests;
