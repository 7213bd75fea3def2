//! Warning flags and their meanings.

use core::fmt;

/// A warning flag: two characters; `--` means none. An unknown one is kept as it is.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct Flag([u8; 2]);

/// What a warning flag requires.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Severity {
    /// No flag.
    None,
    /// Information only.
    Notice,
    /// A person should look at it. The stage may continue.
    Caution,
    /// The position is not reliable until the axis is homed.
    Suspect,
    /// The stage must stop, and the flag must be remedied and cleared.
    Fault,
}

impl Flag {
    /// `--`: no warning.
    pub const NONE: Self = Self(*b"--");
    /// `FS`: the axis stalled and stopped.
    pub const STALLED: Self = Self(*b"FS");
    /// `WR`: the axis has no reference position, as after power-up.
    pub const NO_REFERENCE: Self = Self(*b"WR");
    /// `WH`: the axis has a position, but has not been homed.
    pub const NOT_HOMED: Self = Self(*b"WH");
    /// `NC`: the axis is moved by hand with its knob.
    pub const MANUAL_CONTROL: Self = Self(*b"NC");
    /// `NI`: another command interrupted one that was under way.
    pub const INTERRUPTED: Self = Self(*b"NI");

    /// Parses the two characters: `--`, or capitals and digits.
    pub fn parse(text: &str) -> Option<Self> {
        let pair = <[u8; 2]>::try_from(text.as_bytes()).ok()?;
        let known = |byte: u8| byte.is_ascii_uppercase() || byte.is_ascii_digit();
        (pair == *b"--" || pair.into_iter().all(known)).then_some(Self(pair))
    }

    /// The two characters as one number, the first in the high byte: `FS` is 0x4653.
    pub fn code(self) -> u16 {
        u16::from_be_bytes(self.0)
    }

    /// The flag of a [`code`](Self::code).
    pub fn from_code(code: u16) -> Option<Self> {
        Self::parse(str::from_utf8(&code.to_be_bytes()).ok()?)
    }

    /// What it requires. An unknown fault is a fault, an unknown warning a caution, and any other flag a notice.
    pub fn severity(self) -> Severity {
        match &self.0 {
            b"--" => Severity::None,
            b"WR" | b"WH" | b"WM" => Severity::Suspect,
            // These two warnings mean that steps may be lost, or that something was in the way.
            b"WL" | b"WS" | [b'F', _] => Severity::Fault,
            [b'W', _] => Severity::Caution,
            _ => Severity::Notice,
        }
    }

    /// True if it may hide [`NO_REFERENCE`](Self::NO_REFERENCE) or [`NOT_HOMED`](Self::NOT_HOMED), because a message shows
    /// only the gravest flag.
    pub fn hides_reference(self) -> bool {
        matches!(self.severity(), Severity::Fault | Severity::Caution) || self.0 == *b"WM"
    }

    /// True if the motor's driver is off, until `driver enable`.
    pub fn driver_is_off(self) -> bool {
        matches!(&self.0, b"FO" | b"FD" | b"FH" | b"FV" | b"FC" | b"FM")
    }

    /// What it means and what to do.
    pub fn meaning(self) -> &'static str {
        match &self.0 {
            b"--" => "no warning",
            b"FF" => "critical system error: power the controller off and on, and ask Zaber if it comes back",
            b"FN" => "the connected stage is not supported by this controller: check the peripheral id",
            b"FZ" => "the axis is inactive: connect its stage, or activate it",
            b"FH" => "the emergency stop of the hardware has switched the driver off: release it, then clear",
            b"FV" => "the supply voltage is out of range and the driver is off: check the supply",
            b"FO" => "the driver was switched off by a command or at power-up: clear to switch it on",
            b"FC" => "the inrush current was too high and the driver is off: check supply and wiring",
            b"FM" => "the motor is too hot and the driver is off: let it cool",
            b"FD" => {
                "the driver has switched itself off, by heat or voltage: let it cool and check the supply"
            }
            b"FQ" => "the encoder cannot be read: check its cable and for dirt, then home",
            b"FI" => "the encoder's index mark is not where it should be: home, and check the encoder",
            b"FA" => "the analog encoder has lost its step: check its cable, then home",
            b"FR" => "the motor was overdriven for too long: lighten the load or the acceleration",
            b"FS" => "the axis stalled and stopped: remove what is in its way, clear, and home",
            b"FB" => "a streamed motion was out of bounds and was not made",
            b"FP" => "the axis slipped off the path of an interpolated motion: clear, and home",
            b"FE" => "the limit sensor cannot be reached or is faulty: check the sensor and for obstacles",
            b"FT" => "the axes of a lockstep group have twisted too far: realign them before clearing",
            b"WL" => "a limit sensor was met where none should be: steps may be lost; clear, and home",
            b"WS" => "the axis stalled and recovered: something was in its way; clear, and home",
            b"WP" => "the saved calibration does not fit this stage: check the peripheral's serial number",
            b"WV" => "the supply voltage is outside the recommended range: check the supply",
            b"WT" => "the controller is hotter than recommended: let it cool",
            b"WM" => "the axis was pushed out of its place while standing: home it",
            b"WR" => "the axis has no reference position: home it",
            b"WH" => "the axis has not been homed, so that its calibration is off: home it",
            b"NC" => "the axis is being moved by its knob",
            b"NI" => "a movement was cut short by another command or the knob",
            b"ND" => "a streamed motion ran out of commands and slowed down",
            b"NR" => "a value was rounded to what the controller can hold",
            b"NT" => "a value was cut off to what the controller can hold",
            b"NU" => "a setting is being updated, or a reset is pending",
            b"NJ" => "the joystick is being calibrated",
            b"NB" => "the device is in firmware update mode",
            [b'F', _] => "a fault that is not in Zaber's list",
            [b'W', _] => "a warning that is not in Zaber's list",
            _ => "a notice that is not in Zaber's list",
        }
    }
}

impl fmt::Display for Flag {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{}", char::from(*byte)))
    }
}

impl fmt::Debug for Flag {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Flag({self})")
    }
}

#[cfg(test)]
#[path = "flag_tests.rs"]
mod tests;
