//! Cuts streams into pieces, for the tests of decoders.

/// A stream cut into pieces of these lengths, over and over; a length of 0 counts as 1.
pub(crate) fn cut<'a>(mut rest: &'a [u8], lengths: &'a [usize]) -> impl Iterator<Item = &'a [u8]> {
    lengths.iter().cycle().map_while(move |length| {
        let (piece, later) = rest.split_at((*length).max(1).min(rest.len()));
        rest = later;
        (!piece.is_empty()).then_some(piece)
    })
}
