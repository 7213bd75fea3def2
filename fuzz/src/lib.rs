//! What the fuzz targets share: how a fuzzer's input becomes arrivals on a link.

use std::time::Duration;

/// Bytes that arrive together, at most.
const ARRIVAL_MAX_BYTES: usize = 64;

/// Cuts what is behind the first half of the input into arrivals whose lengths the first half tells.
///
/// The whole that they make up stands first.
pub fn arrivals(input: &[u8]) -> (&[u8], Vec<&[u8]>) {
    let (lengths, whole) = input.split_at(input.len() / 2);
    let mut rest = whole;
    let mut arrivals = Vec::new();
    for length in lengths {
        let (arrival, behind) = rest.split_at((usize::from(*length) % ARRIVAL_MAX_BYTES).min(rest.len()));
        arrivals.push(arrival);
        rest = behind;
    }
    arrivals.push(rest);
    (whole, arrivals)
}

/// One thing that happens to a session.
#[derive(Debug, Clone, Copy)]
pub enum Happening<'a> {
    /// These bytes come.
    Bytes(&'a [u8]),
    /// Time passes until the session's deadline.
    Deadline,
    /// A person or a run asks for something; which, the number says.
    Command(u8),
    /// Time passes.
    Pause(Duration),
}

/// Reads the input as a list of what happens.
pub fn happenings(mut input: &[u8]) -> Vec<Happening<'_>> {
    let mut happenings = Vec::new();
    while let [kind, rest @ ..] = input {
        input = rest;
        happenings.push(match kind {
            0..=31 => Happening::Deadline,
            32..=63 => Happening::Pause(Duration::from_millis(u64::from(*kind))),
            64..=95 => Happening::Command(*kind - 64),
            _ => {
                let (bytes, rest) = input.split_at(usize::from(*kind - 95).min(input.len()));
                input = rest;
                Happening::Bytes(bytes)
            }
        });
    }
    happenings
}
