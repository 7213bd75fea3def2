//! Unpacks the chunks of an MCAP file, each by itself.

use mcap::{
    records::op,
    sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions},
};

/// No record and no unpacked chunk is larger; a length beyond it is damage.
pub(crate) const RECORD_MAX_BYTES: usize = 64 * 1024 * 1024;

/// A record of a kind that nobody uses. It comes out only if the chunk before it was as long as it says.
const SENTINEL: [u8; 9] = [255, 0, 0, 0, 0, 0, 0, 0, 0];

/// Unpacks chunks. A damaged one has no effect on the next.
pub(crate) struct Unpacker {
    mcap: LinearReader,
}

/// A record from within a chunk.
pub(crate) struct InnerRecord {
    pub(crate) opcode: u8,
    pub(crate) body: Vec<u8>,
}

impl Unpacker {
    pub(crate) fn new() -> Self {
        let options = LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_skip_end_magic(true)
            .with_prevalidate_chunk_crcs(true)
            .with_record_length_limit(RECORD_MAX_BYTES);
        Self { mcap: LinearReader::new_with_options(options) }
    }

    /// All records of a chunk, or why they cannot be read. `body` is the chunk without its kind and length.
    pub(crate) fn unpack(&mut self, body: &[u8]) -> Result<Vec<InnerRecord>, String> {
        let records = self.records(body);
        if records.is_err() {
            *self = Self::new();
        }
        records
    }

    fn records(&mut self, body: &[u8]) -> Result<Vec<InnerRecord>, String> {
        if body.is_empty() {
            return Err("a chunk has no bytes".into());
        }
        let length = (body.len() as u64).to_le_bytes();
        let mut parts = [&[op::CHUNK], length.as_slice(), body, &SENTINEL].into_iter();
        let mut records = Vec::new();
        loop {
            match self.mcap.next_event() {
                Some(Ok(LinearReadEvent::ReadRequest(_))) => {
                    let Some(part) = parts.next() else {
                        return Err("a chunk's lengths contradict each other".into());
                    };
                    self.mcap.insert(part.len()).copy_from_slice(part);
                    self.mcap.notify_read(part.len());
                }
                // Only once it was given: a chunk may hold a record of that kind itself.
                Some(Ok(LinearReadEvent::Record { opcode, .. }))
                    if opcode == SENTINEL[0] && parts.len() == 0 =>
                {
                    return Ok(records);
                }
                Some(Ok(LinearReadEvent::Record { opcode, data })) => {
                    records.push(InnerRecord { opcode, body: data.to_vec() });
                }
                Some(Err(error)) => return Err(error.to_string()),
                None => return Err("a chunk has an end of its own".into()),
            }
        }
    }
}
