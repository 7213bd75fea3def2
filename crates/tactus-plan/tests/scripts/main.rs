//! Scripts from their text to their steps, through the public interface.
#![expect(clippy::unwrap_used, clippy::wildcard_enum_match_arm, reason = "a test ends at its first surprise")]

mod errors;
mod experiments;
mod fake;
mod hostile;
