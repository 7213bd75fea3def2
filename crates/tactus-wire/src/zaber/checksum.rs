//! The checksum that may end a message.

/// The byte that makes the sum of all bytes between a message's first character and the `:` zero, modulo 256.
pub(super) fn checksum(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0u8, |sum, byte| sum.wrapping_add(*byte)).wrapping_neg()
}

/// Removes the checksum from the body of a message. `None` if it is malformed or wrong; otherwise the rest, and whether
/// there was one.
pub(super) fn verify(body: &str) -> Option<(&str, bool)> {
    let Some((content, digits)) = body.rsplit_once(':') else { return Some((body, false)) };
    let is_hex = digits.len() == 2 && digits.bytes().all(|digit| digit.is_ascii_hexdigit());
    let sum = u8::from_str_radix(digits, 16).ok().filter(|_| is_hex)?;
    (sum == checksum(content.as_bytes())).then_some((content, true))
}
