//! Damages a sound file as the fuzzer's input says, for formats with checksums that random bytes never satisfy.

/// Most bytes that one edit takes away or repeats.
const LENGTH_MAX: usize = 1024;

/// The file after all edits of the input. Each edit is a kind, a place (two bytes, as a share of the file), a length, and for
/// some kinds the bytes to write. No edit at all leaves the file as it is.
pub fn edited(sound: &[u8], mut input: &[u8]) -> Vec<u8> {
    let mut file = sound.to_vec();
    while let [kind, low, high, length, rest @ ..] = input {
        input = rest;
        let place = usize::from(u16::from_le_bytes([*low, *high])) * file.len() / 0xffff;
        let length = usize::from(*length);
        let end = (place + (length << (kind >> 6)).min(LENGTH_MAX)).min(file.len());
        match kind % 6 {
            0 => {
                let bytes = taken(&mut input, length);
                let end = (place + bytes.len()).min(file.len());
                file.splice(place..end, bytes.iter().copied());
            }
            1 => {
                let bytes = taken(&mut input, length);
                file.splice(place..place, bytes.iter().copied());
            }
            2 => drop(file.drain(place..end)),
            3 => file.truncate(place),
            4 => {
                let again = file[place..end].to_vec();
                file.splice(end..end, again);
            }
            _ => {
                if let Some(byte) = file.get_mut(place) {
                    *byte ^= 1 << (length % 8);
                }
            }
        }
    }
    file
}

/// The next bytes of the input.
fn taken<'a>(input: &mut &'a [u8], bytes: usize) -> &'a [u8] {
    let (taken, rest) = input.split_at(bytes.min(input.len()));
    *input = rest;
    taken
}
