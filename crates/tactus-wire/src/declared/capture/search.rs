//! Searches for corrections that make a description fit a recording.

use super::{Hint, Stride};
use crate::declared::checksum::{Algorithm, CRC32, Crc, CrcParameters, CrcWidth};
use crate::declared::format::Checksum;
use crate::declared::sniff::find;
use crate::declared::{Endian, Field, Format, Framing, SampleType, Samples, propose};

/// Number of frames on which checksums are tried.
const FRAMES_TRIED: usize = 16;
/// Number of different frames on which a checksum must be correct, so that it is not so by chance.
const FRAMES_NEEDED: usize = 3;
/// Number of offsets that are tried as the beginning of the covered bytes.
const FROM_TRIED: usize = 16;
/// Share of frames for which a correction must hold.
const NEARLY_ALL: f64 = 0.9;
/// Factor by which samples must be smoother in time in the other byte order to be reported.
const SMOOTHER: f64 = 4.0;

/// Possible corrections of the description, from the bytes between syncs.
pub(super) fn hints(
    format: &Format,
    capture: &[u8],
    heads: &[usize],
    strides: &[Stride],
    frames_at: &[usize],
) -> Vec<Hint> {
    let mut hints = Vec::new();
    let slices = if format.framing == Framing::Packet {
        capture.chunks_exact(format.bytes).filter(|packet| packet.starts_with(&format.head)).collect()
    } else {
        let Some(stride) = hint_stride(format, capture, heads, strides, frames_at, &mut hints) else {
            return hints;
        };
        slices(capture, heads, stride)
    };
    if slices.len() < FRAMES_NEEDED {
        return hints;
    }
    hint_length(format, &slices, &mut hints);
    let closed_at = hint_checksum(format, &slices, &mut hints);
    hint_sequence(format, &slices, closed_at, &mut hints);
    hint_timestamp(format, &slices, &mut hints);
    hint_samples(format, &slices, &mut hints);
    hints
}

/// The stride of the capture; adds a hint if it differs from the description.
fn hint_stride(
    format: &Format,
    capture: &[u8],
    heads: &[usize],
    strides: &[Stride],
    frames_at: &[usize],
    hints: &mut Vec<Hint>,
) -> Option<usize> {
    if heads.is_empty() {
        let reversed: Vec<u8> = format.head.iter().rev().copied().collect();
        hints.push(Hint::SyncAbsent {
            sync: format.head.clone(),
            reversed: find(capture, &reversed).count(),
            proposal: propose(capture).into_iter().next(),
        });
        return None;
    }
    let has = |bytes: usize| {
        strides.iter().any(|stride| stride.bytes == bytes && 2 * stride.count >= heads.len() / 2)
    };
    if has(format.bytes) || frames_at.len() * format.bytes * 2 > capture.len() {
        return Some(format.bytes);
    }
    let found = strides.first().copied().filter(|stride| stride.count > 1 && 4 * stride.count >= heads.len());
    hints.push(Hint::FrameBytes { described: format.bytes, found, syncs: heads.len() });
    found.map(|stride| stride.bytes)
}

/// The bytes from each sync to the next one, where that is a stride away.
fn slices<'a>(capture: &'a [u8], heads: &[usize], stride: usize) -> Vec<&'a [u8]> {
    let mut slices = Vec::new();
    let mut next = 0;
    for &at in heads {
        let behind = at + stride;
        if at >= next
            && (behind == capture.len() || heads.binary_search(&behind).is_ok())
            && let Some(slice) = capture.get(at..behind)
        {
            slices.push(slice);
            next = behind;
        }
    }
    slices
}

fn hint_length(format: &Format, slices: &[&[u8]], hints: &mut Vec<Hint>) {
    let Some(length) = format.length else { return };
    let values = |field: Field| slices.iter().filter_map(move |slice| field.read(slice));
    let agree = |field: Field, wanted: u64| nearly_all(values(field).map(|value| value == wanted));
    let turned = turned(length.field);
    let Some(value) = values(length.field).next() else { return };
    let stride = slices.first().map_or(0, |slice| slice.len());
    // The field's value by the description's rule, for the stride of the capture.
    let wanted = length.value.checked_add(stride as u64).and_then(|sum| sum.checked_sub(format.bytes as u64));
    if wanted.is_some_and(|wanted| agree(length.field, wanted)) {
        return;
    }
    if wanted.is_some_and(|wanted| agree(turned, wanted)) {
        hints.push(Hint::LengthEndian { endian: turned.endian });
    } else if agree(length.field, value) {
        let adds =
            i64::try_from(stride).ok().zip(i64::try_from(value).ok()).and_then(|(s, v)| s.checked_sub(v));
        hints.extend(adds.map(|adds| Hint::LengthAdds { value, adds }));
    } else if let Some(other) = values(length.field).find(|other| *other != value) {
        hints.push(Hint::LengthVaries { values: [value, other] });
    }
}

/// The field of the correct checksum; adds a hint if it differs from the description.
fn hint_checksum(format: &Format, slices: &[&[u8]], hints: &mut Vec<Hint>) -> Option<Field> {
    let mut tried: Vec<&[u8]> = slices.to_vec();
    tried.sort_unstable();
    tried.dedup();
    // Spread over the frames of the capture.
    let step = tried.len().div_ceil(FRAMES_TRIED).max(1);
    let tried: Vec<&[u8]> = tried.into_iter().step_by(step).collect();
    if tried.len() < FRAMES_NEEDED {
        return format.checksum.as_ref().map(|checksum| checksum.field);
    }
    if let Some(described) = &format.checksum
        && holds(described, &tried)
    {
        return Some(described.field);
    }
    let found =
        variants(format, tried.first().map_or(0, |slice| slice.len())).find(|other| holds(other, &tried));
    let Some(Checksum { algorithm, from, field, .. }) = found else {
        if format.checksum.is_some() {
            hints.push(Hint::ChecksumUnknown);
        }
        return None;
    };
    let mut differs = Vec::new();
    if let Some(described) = &format.checksum {
        let differences = [
            ("kind", described.algorithm != algorithm),
            ("from", described.from != from),
            ("offset", described.field.offset != field.offset),
            ("endian", described.field.endian != field.endian && field.width > 1),
        ];
        differs.extend(differences.iter().filter(|(_, differs)| *differs).map(|(name, _)| *name));
    }
    hints.push(Hint::ChecksumIs { algorithm, from, offset: field.offset, endian: field.endian, differs });
    Some(field)
}

fn holds(checksum: &Checksum, slices: &[&[u8]]) -> bool {
    nearly_all(slices.iter().map(|slice| {
        let covered = slice.get(checksum.from..checksum.to);
        let expected = covered.map(|covered| u64::from(checksum.algorithm.of(covered)));
        expected.is_some() && expected == checksum.field.read(slice)
    }))
}

/// Checksums to try on frames of this length, those closest to the description first.
fn variants(format: &Format, bytes: usize) -> impl Iterator<Item = Checksum> {
    let described = format.checksum.as_ref();
    let crc16 = |polynomial, init, reflect, xorout| {
        Algorithm::Crc(Crc::new(CrcParameters { width: CrcWidth::Bits16, polynomial, init, reflect, xorout }))
    };
    let usual = [
        crc16(0x1021, 0xFFFF, false, 0),
        crc16(0x1021, 0, false, 0),
        crc16(0x1021, 0, true, 0),
        crc16(0x1021, 0xFFFF, true, 0),
        crc16(0x1021, 0xFFFF, true, 0xFFFF),
        crc16(0x8005, 0xFFFF, true, 0),
        crc16(0x8005, 0, true, 0),
        crc16(0x8005, 0, false, 0),
        Algorithm::Crc(Crc::new(CRC32)),
        Algorithm::Sum8,
        Algorithm::Xor8,
    ];
    let algorithms: Vec<Algorithm> =
        described.map(|described| described.algorithm.clone()).into_iter().chain(usual).collect();
    let described_at = described.map(|described| described.field.offset);
    let trailer_bytes = format.trailer.len();
    algorithms.into_iter().flat_map(move |algorithm| {
        let width = algorithm.bytes();
        let at_end = bytes.checked_sub(trailer_bytes + width);
        let behind_all = bytes.checked_sub(width).filter(|at| Some(*at) != at_end);
        let offsets =
            described_at.filter(|at| Some(*at) != at_end).into_iter().chain(at_end).chain(behind_all);
        offsets.flat_map(move |offset| {
            let algorithm = algorithm.clone();
            let endians: &[Endian] =
                if width == 1 { &[Endian::Little] } else { &[Endian::Little, Endian::Big] };
            endians.iter().flat_map(move |endian| {
                let algorithm = algorithm.clone();
                let field = Field { offset, width, endian: *endian };
                // A real checksum covers at least about half of the frame.
                (0..FROM_TRIED.min(offset / 2 + 1)).map(move |from| Checksum {
                    algorithm: algorithm.clone(),
                    from,
                    to: offset,
                    field,
                })
            })
        })
    })
}

fn hint_sequence(format: &Format, slices: &[&[u8]], closed_at: Option<Field>, hints: &mut Vec<Hint>) {
    let Some(sequence) = format.sequence else { return };
    let pairs = || slices.iter().zip(slices.iter().skip(1));
    let follows = |(a, b): (&&[u8], &&[u8])| {
        let next = u128::from(sequence.field.read(a)?) + 1;
        Some(next % sequence.wrap == u128::from(sequence.field.read(b)?))
    };
    if nearly_all(pairs().map(|pair| follows(pair) == Some(true))) {
        return;
    }
    let counts_at = |offset: &usize| {
        nearly_all(
            pairs().map(|(a, b)| a.get(*offset).map(|byte| byte.wrapping_add(1)) == b.get(*offset).copied()),
        )
    };
    let is_checksum = |offset: &usize| {
        closed_at.is_some_and(|field| (field.offset..field.offset + field.width).contains(offset))
    };
    let bytes = slices.first().map_or(0, |slice| slice.len());
    let counters = (0..bytes).filter(|offset| !is_checksum(offset)).filter(counts_at).collect();
    hints.push(Hint::SequenceAt { counters });
}

fn hint_timestamp(format: &Format, slices: &[&[u8]], hints: &mut Vec<Hint>) {
    let Some(timestamp) = format.timestamp else { return };
    let values = |field: Field| slices.iter().filter_map(move |slice| field.read(slice)).collect::<Vec<_>>();
    // A clock that is read in the right byte order advances by less than a thousandth of its range.
    let in_order = |values: &[u64]| {
        nearly_all(values.iter().zip(values.iter().skip(1)).map(|(a, b)| {
            let ahead = (u128::from(*b) + timestamp.wrap - u128::from(*a) % timestamp.wrap) % timestamp.wrap;
            ahead <= (timestamp.wrap / 1000).max(64)
        }))
    };
    let described = values(timestamp.field);
    if described.first().is_some_and(|first| described.iter().all(|value| value == first)) {
        hints.push(Hint::TimestampStands);
    } else if !in_order(&described) && in_order(&values(turned(timestamp.field))) {
        hints.push(Hint::TimestampEndian { endian: turned(timestamp.field).endian });
    }
}

fn hint_samples(format: &Format, slices: &[&[u8]], hints: &mut Vec<Hint>) {
    let described = &format.samples;
    if described.kind == SampleType::U8 {
        return;
    }
    let mut other = described.clone();
    other.endian = opposite(described.endian);
    let roughness = |samples: &Samples| -> f64 {
        let (mut wire, mut counts, mut before) = (Vec::new(), Vec::new(), Vec::<f32>::new());
        let mut sum = 0.0;
        for slice in slices {
            samples.decode(slice, &mut wire, &mut counts);
            let changes = counts.iter().zip(&before).map(|(now, before)| f64::from((now - before).abs()));
            sum += changes.filter(|change| change.is_finite()).sum::<f64>();
            before.clone_from(&counts);
        }
        sum
    };
    let smoother = roughness(described) / roughness(&other);
    if smoother.is_finite() && smoother > SMOOTHER {
        hints.push(Hint::SampleEndian { endian: other.endian, smoother });
    }
}

/// The field in the other byte order.
fn turned(field: Field) -> Field {
    Field { endian: opposite(field.endian), ..field }
}

fn opposite(endian: Endian) -> Endian {
    match endian {
        Endian::Little => Endian::Big,
        Endian::Big => Endian::Little,
    }
}

fn nearly_all(holds: impl Iterator<Item = bool>) -> bool {
    let (mut total, mut good) = (0_u32, 0_u32);
    for holds in holds {
        total += 1;
        good += u32::from(holds);
    }
    total > 0 && f64::from(good) >= NEARLY_ALL * f64::from(total)
}
