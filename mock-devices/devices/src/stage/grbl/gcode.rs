//! One line of G-code: the subset that a stage needs.

/// The words of a line.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Block {
    /// G0 or G1 in this line.
    pub(super) motion: Option<MotionMode>,
    /// G90 (false) or G91 (true) in this line.
    pub(super) relative: Option<bool>,
    /// G53: the axes are absolute machine coordinates.
    pub(super) machine: bool,
    /// F in this line, mm/min.
    pub(super) feed_mm_per_min: Option<f64>,
    /// X, Y, Z in this line, mm.
    pub(super) axes_mm: [Option<f64>; 3],
    /// G4: dwell.
    pub(super) dwell: bool,
    /// P in this line, s.
    pub(super) dwell_s: Option<f64>,
}

/// Speed of a straight move.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum MotionMode {
    /// G0: as fast as it can.
    #[default]
    Rapid,
    /// G1: at the feed.
    Feed,
}

/// The number of an `error:n`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct GrblError(pub(super) u8);

impl GrblError {
    pub(super) const LETTER: Self = Self(1);
    pub(super) const NUMBER: Self = Self(2);
    pub(super) const STATEMENT: Self = Self(3);
    pub(super) const NEGATIVE: Self = Self(4);
    pub(super) const HOMING_OFF: Self = Self(5);
    pub(super) const NOT_IDLE: Self = Self(8);
    pub(super) const LOCKED: Self = Self(9);
    pub(super) const OVERFLOW: Self = Self(11);
    pub(super) const TRAVEL: Self = Self(15);
    pub(super) const JOG: Self = Self(16);
    pub(super) const UNSUPPORTED: Self = Self(20);
    pub(super) const MODAL_GROUP: Self = Self(21);
    pub(super) const NO_FEED: Self = Self(22);
    pub(super) const REPEATED: Self = Self(25);
    pub(super) const NO_AXIS: Self = Self(26);
    pub(super) const NO_VALUE: Self = Self(28);
}

impl Block {
    /// Parses a line in upper case without blanks.
    pub(super) fn parse(mut line: &str) -> Result<Self, GrblError> {
        let mut block = Self::default();
        while let Some(letter) = line.chars().next() {
            if !letter.is_ascii_uppercase() {
                return Err(GrblError::LETTER);
            }
            let rest = line.get(1..).unwrap_or_default();
            let end = rest
                .find(|c: char| !(c.is_ascii_digit() || matches!(c, '.' | '-' | '+')))
                .unwrap_or(rest.len());
            let (number, next) = rest.split_at(end);
            let number: f64 = number.parse().map_err(|_| GrblError::NUMBER)?;
            block.word(letter, number)?;
            line = next;
        }
        Ok(block)
    }

    fn word(&mut self, letter: char, number: f64) -> Result<(), GrblError> {
        match letter {
            'F' | 'P' if number < 0.0 => Err(GrblError::NEGATIVE),
            'G' => self.command(number),
            'F' => once(&mut self.feed_mm_per_min, number, GrblError::REPEATED),
            'P' => once(&mut self.dwell_s, number, GrblError::REPEATED),
            'X' => once(&mut self.axes_mm[0], number, GrblError::REPEATED),
            'Y' => once(&mut self.axes_mm[1], number, GrblError::REPEATED),
            'Z' => once(&mut self.axes_mm[2], number, GrblError::REPEATED),
            // Line numbers are ignored.
            'N' => Ok(()),
            _ => Err(GrblError::UNSUPPORTED),
        }
    }

    #[expect(clippy::cast_possible_truncation, reason = "a number that does not fit is an unknown command")]
    fn command(&mut self, number: f64) -> Result<(), GrblError> {
        // Codes such as G38.2 differ in tenths.
        match (number * 10.0).round() as i64 {
            0 => once(&mut self.motion, MotionMode::Rapid, GrblError::MODAL_GROUP),
            10 => once(&mut self.motion, MotionMode::Feed, GrblError::MODAL_GROUP),
            40 if self.dwell => Err(GrblError::MODAL_GROUP),
            40 => {
                self.dwell = true;
                Ok(())
            }
            900 => once(&mut self.relative, false, GrblError::MODAL_GROUP),
            910 => once(&mut self.relative, true, GrblError::MODAL_GROUP),
            530 => {
                self.machine = true;
                Ok(())
            }
            // XY plane, mm, first work coordinates, mm per minute: the defaults.
            170 | 210 | 540 | 940 => Ok(()),
            _ => Err(GrblError::UNSUPPORTED),
        }
    }

    /// True if the line names an axis.
    pub(super) fn has_axes(&self) -> bool {
        self.axes_mm.iter().any(Option::is_some)
    }
}

fn once<T>(place: &mut Option<T>, value: T, repeated: GrblError) -> Result<(), GrblError> {
    match place.replace(value) {
        None => Ok(()),
        Some(_) => Err(repeated),
    }
}

#[cfg(test)]
#[path = "gcode_tests.rs"]
mod tests;
