//! Phases of a press, with their names in the measurement table.

/// Phase of a press in which a frame is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Phase {
    /// Outside a press.
    Idle,
    /// Coming down to the surface.
    Approach,
    /// Moving deeper.
    Load,
    /// Holding a depth.
    Hold,
    /// Moving up, still in the press.
    Unload,
    /// Going back to the safe height.
    Retract,
}

impl Phase {
    /// Every phase.
    pub const ALL: [Self; 6] =
        [Self::Idle, Self::Approach, Self::Load, Self::Hold, Self::Unload, Self::Retract];

    /// The word in the table.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Idle => "idle",
            Self::Approach => "approach",
            Self::Load => "load",
            Self::Hold => "hold",
            Self::Unload => "unload",
            Self::Retract => "retract",
        }
    }

    /// The phase of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|phase| phase.name() == name)
    }
}
