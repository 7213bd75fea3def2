//! Checks a description, and names its first contradiction.

use super::checksum::{Algorithm, CRC32, Crc, CrcParameters, CrcWidth};
use super::format::{Checksum, Length, Sequence, Timestamp};
use super::layout::{Layout, wrong};
use super::raw::{
    ChecksumKind, Framing, OrderName, RawChecksum, RawFormat, RawFrame, RawHid, RawLength, RawOrder,
    RawSamples, RawSequence, RawTimestamp, SCHEMA,
};
use super::{Field, Format, FormatError, MAX_FRAME_BYTES, Samples};

/// Greatest length of sync and trailer.
const MAX_MARK_BYTES: usize = 16;

impl RawFormat {
    /// Checks the description.
    ///
    /// # Errors
    /// The first contradiction, with the name of its field.
    pub fn check(self) -> Result<Format, FormatError> {
        if self.schema != SCHEMA {
            return Err(wrong("schema", format!("{:?} is not known here; write {SCHEMA:?}", self.schema)));
        }
        if self.name.is_empty() {
            return Err(wrong("name", "is empty; say which device this is"));
        }
        let RawFrame { bytes, sync, trailer, length } = self.frame;
        if bytes == 0 || bytes > MAX_FRAME_BYTES {
            return Err(wrong("frame.bytes", format!("{bytes} is not 1 to {MAX_FRAME_BYTES}")));
        }
        let mut layout = Layout::new(bytes);
        let head = head(self.framing, self.hid, &sync)?;
        check_mark("frame.sync", &sync)?;
        check_mark("frame.trailer", &trailer)?;
        if !head.is_empty() {
            layout.take("frame.sync", 0, head.len())?;
        }
        if !trailer.is_empty() {
            let field = "frame.trailer";
            let at =
                bytes.checked_sub(trailer.len()).ok_or_else(|| layout.does_not_fit(field, trailer.len()))?;
            layout.take(field, at, trailer.len())?;
        }
        let length = length.map(|length| length.check(&mut layout)).transpose()?;
        let samples = self.samples.check(&mut layout)?;
        let sequence = self.sequence.map(|sequence| sequence.check(&mut layout)).transpose()?;
        let timestamp = self.timestamp.map(|timestamp| timestamp.check(&mut layout)).transpose()?;
        let checksum = match self.checksum {
            None => None,
            Some(checksum) => checksum.check(&mut layout, trailer.len())?,
        };
        if let Some(usb) = self.usb
            && usb.endpoint < 0x80
        {
            let input = usb.endpoint | 0x80;
            let problem = format!(
                "{:#04x} sends to the device; frames come from one with the bit 0x80, such as {input:#04x}",
                usb.endpoint
            );
            return Err(wrong("usb.endpoint", problem));
        }
        Ok(Format {
            name: self.name,
            framing: self.framing,
            bytes,
            head,
            trailer,
            length,
            samples,
            sequence,
            timestamp,
            checksum,
            hid: self.hid,
            usb: self.usb,
        })
    }
}

/// The bytes at the beginning of every frame.
fn head(framing: Framing, hid: Option<RawHid>, sync: &[u8]) -> Result<Vec<u8>, FormatError> {
    if hid.is_some() && framing == Framing::Stream {
        return Err(wrong("framing", "HID reports are packets; write framing = \"packet\""));
    }
    if framing == Framing::Stream && sync.is_empty() {
        let problem = "is missing; a stream needs bytes that every frame begins with (or framing = \
                       \"packet\", if each read of the device is one frame)";
        return Err(wrong("frame.sync", problem));
    }
    let id = hid.map(|hid| hid.report_id).filter(|id| *id != 0);
    Ok(id.into_iter().chain(sync.iter().copied()).collect())
}

fn check_mark(field: &str, mark: &[u8]) -> Result<(), FormatError> {
    if mark.len() > MAX_MARK_BYTES {
        return Err(wrong(
            field,
            format!("{} bytes; {MAX_MARK_BYTES} are enough, leave the others out", mark.len()),
        ));
    }
    Ok(())
}

impl RawLength {
    fn check(self, layout: &mut Layout) -> Result<Length, FormatError> {
        let field = layout.field("frame.length", self.offset, self.width, self.endian)?;
        let value = i64::try_from(layout.bytes).ok().and_then(|bytes| bytes.checked_sub(self.adds));
        match value.and_then(|value| u64::try_from(value).ok()) {
            Some(value) if u128::from(value) < field.values() => Ok(Length { field, value }),
            _ => {
                let problem = format!(
                    "a frame of {} bytes less {} is nothing that a field of {} bytes can say; set it to \
                     frame.bytes less what the field says",
                    layout.bytes, self.adds, self.width
                );
                Err(wrong("frame.length.adds", problem))
            }
        }
    }
}

impl RawSamples {
    fn check(self, layout: &mut Layout) -> Result<Samples, FormatError> {
        let Self { offset, elements, rows, cols, kind, endian, order, bad } = self;
        if elements == 0 || elements > MAX_FRAME_BYTES {
            return Err(wrong("samples.elements", format!("{elements} is not 1 to {MAX_FRAME_BYTES}")));
        }
        let shape = match (rows, cols) {
            (None, None) => None,
            (Some(rows), Some(cols)) if rows.checked_mul(cols) == Some(elements) => Some((rows, cols)),
            (Some(rows), Some(cols)) => {
                let problem =
                    format!("{rows} rows of {cols} are not {elements} elements; correct one of the three");
                return Err(wrong("samples.elements", problem));
            }
            (Some(_), None) => return Err(wrong("samples.cols", "is missing beside samples.rows")),
            (None, Some(_)) => return Err(wrong("samples.rows", "is missing beside samples.cols")),
        };
        let places = match order {
            RawOrder::Named(OrderName::RowMajor) => None,
            RawOrder::Named(OrderName::ColumnMajor) => {
                let Some((rows, cols)) = shape else {
                    let problem = "\"column-major\" needs samples.rows and samples.cols";
                    return Err(wrong("samples.order", problem));
                };
                Some((0..rows).flat_map(|row| (0..cols).map(move |col| col * rows + row)).collect())
            }
            RawOrder::Elements(order) => Some(places(&order, elements)?),
        };
        let bytes = kind.bytes(elements);
        let offset = layout.offset("samples.offset", offset)?;
        layout.take("samples.offset", offset, bytes)?;
        for value in &bad {
            let fits = kind
                .range()
                .is_none_or(|(least, greatest)| (least..=greatest).contains(value) && value.fract() == 0.0);
            if !fits {
                return Err(wrong("samples.bad", format!("no sample of this type is {value}; leave it out")));
            }
        }
        #[expect(
            clippy::cast_possible_truncation,
            reason = "compared with counts, which have this precision"
        )]
        let bad = bad.into_iter().map(|value| value as f32).collect();
        Ok(Samples { offset, elements, kind, endian, places, bad })
    }
}

/// Each element's position on the wire, from the element at each position.
fn places(order: &[usize], elements: usize) -> Result<Vec<usize>, FormatError> {
    let field = "samples.order";
    if order.len() != elements {
        let problem = format!("lists {} elements, samples.elements says {elements}", order.len());
        return Err(wrong(field, problem));
    }
    let mut places = vec![None; elements];
    for (place, element) in order.iter().enumerate() {
        match places.get_mut(*element) {
            None => {
                let problem =
                    format!("there is no element {element}; they are counted from 0 to {}", elements - 1);
                return Err(wrong(field, problem));
            }
            Some(Some(_)) => {
                return Err(wrong(field, format!("element {element} is there twice; each is there once")));
            }
            Some(free) => *free = Some(place),
        }
    }
    Ok(places.into_iter().flatten().collect())
}

impl RawSequence {
    fn check(self, layout: &mut Layout) -> Result<Sequence, FormatError> {
        let field = layout.field("sequence", self.offset, self.width, self.endian)?;
        Ok(Sequence { field, wrap: wrap("sequence.wrap", self.wrap, field)? })
    }
}

impl RawTimestamp {
    fn check(self, layout: &mut Layout) -> Result<Timestamp, FormatError> {
        let Self { offset, width, endian, tick_ns, wrap: wraps, unchanged_is_stale } = self;
        let field = layout.field("timestamp", offset, width, endian)?;
        if !(tick_ns.is_finite() && tick_ns > 0.0) {
            let problem = format!("{tick_ns} is no length of a tick; 1000000 is a clock in ms");
            return Err(wrong("timestamp.tick_ns", problem));
        }
        Ok(Timestamp { field, wrap: wrap("timestamp.wrap", wraps, field)?, tick_ns, unchanged_is_stale })
    }
}

fn wrap(name: &str, wrap: Option<u64>, field: Field) -> Result<u128, FormatError> {
    let wrap = wrap.map_or(field.values(), u128::from);
    if (2..=field.values()).contains(&wrap) {
        return Ok(wrap);
    }
    let problem = format!("{wrap} is not 2 to {}, what {} bytes can hold", field.values(), field.width);
    Err(wrong(name, problem))
}

impl RawChecksum {
    fn check(self, layout: &mut Layout, trailer_bytes: usize) -> Result<Option<Checksum>, FormatError> {
        let Some(algorithm) = self.algorithm()? else { return Ok(None) };
        let width = algorithm.bytes();
        let field = "checksum.offset";
        let offset = match self.offset {
            Some(offset) => layout.offset(field, offset)?,
            None => layout
                .bytes
                .checked_sub(trailer_bytes + width)
                .ok_or_else(|| layout.does_not_fit("checksum", width))?,
        };
        layout.take(field, offset, width)?;
        let from = layout.offset("checksum.from", self.from)?;
        let to = self.to.map_or(Ok(offset), |to| layout.end("checksum.to", to))?;
        if from >= to {
            let problem =
                format!("nothing lies from byte {from} to byte {to}; checksum.to is the first byte behind");
            return Err(wrong("checksum.from", problem));
        }
        if from < offset + width && offset < to {
            let problem = format!(
                "bytes {from} to {to} hold the checksum itself, at {offset}; it covers no byte of its own"
            );
            return Err(wrong("checksum.to", problem));
        }
        Ok(Some(Checksum { algorithm, from, to, field: Field { offset, width, endian: self.endian } }))
    }

    fn algorithm(&self) -> Result<Option<Algorithm>, FormatError> {
        let Self { kind, polynomial, init, reflect, xorout, check, .. } = *self;
        let width = match kind {
            ChecksumKind::Crc16 => CrcWidth::Bits16,
            ChecksumKind::Crc32 => CrcWidth::Bits32,
            ChecksumKind::None | ChecksumKind::Sum8 | ChecksumKind::Xor8 => {
                let given = [
                    ("checksum.polynomial", polynomial.is_some()),
                    ("checksum.init", init.is_some()),
                    ("checksum.reflect", reflect.is_some()),
                    ("checksum.xorout", xorout.is_some()),
                ];
                if let Some((field, _)) = given.iter().find(|(_, given)| *given) {
                    return Err(wrong(field, "belongs to a crc; leave it out, or set checksum.kind"));
                }
                let algorithm = match kind {
                    ChecksumKind::Sum8 => Some(Algorithm::Sum8),
                    ChecksumKind::Xor8 => Some(Algorithm::Xor8),
                    ChecksumKind::None | ChecksumKind::Crc16 | ChecksumKind::Crc32 => None,
                };
                return checked(algorithm, check);
            }
        };
        let needed = |field: &str, parameter: Option<u32>, default: u32| match (parameter, width) {
            (Some(number), CrcWidth::Bits16) if number > 0xFFFF => Err(wrong(
                field,
                format!("{number:#x} has more than 16 bits; write it without the highest bit"),
            )),
            (Some(number), _) => Ok(number),
            (None, CrcWidth::Bits32) => Ok(default),
            (None, CrcWidth::Bits16) => {
                let problem = "is missing; there is no usual crc16. CCITT-FALSE is polynomial = 0x1021, \
                               init = 0xFFFF, reflect = false, xorout = 0; Modbus is 0x8005, 0xFFFF, true, 0";
                Err(wrong(field, problem))
            }
        };
        let parameters = CrcParameters {
            width,
            polynomial: needed("checksum.polynomial", polynomial, CRC32.polynomial)?,
            init: needed("checksum.init", init, CRC32.init)?,
            reflect: needed("checksum.reflect", reflect.map(u32::from), CRC32.reflect.into())? != 0,
            xorout: needed("checksum.xorout", xorout, CRC32.xorout)?,
        };
        checked(Some(Algorithm::Crc(Crc::new(parameters))), check)
    }
}

/// The algorithm, if it has the check value of the description.
fn checked(algorithm: Option<Algorithm>, check: Option<u32>) -> Result<Option<Algorithm>, FormatError> {
    let Some(check) = check else { return Ok(algorithm) };
    let found = algorithm.as_ref().map(|algorithm| algorithm.of(b"123456789"));
    if found == Some(check) {
        return Ok(algorithm);
    }
    let problem = match found {
        Some(found) => {
            format!("of \"123456789\" these parameters make {found:#x}, not {check:#x}; correct them")
        }
        None => "there is no checksum; leave it out, or set checksum.kind".to_owned(),
    };
    Err(wrong("checksum.check", problem))
}

#[cfg(test)]
#[path = "check_tests.rs"]
mod tests;
