//! MCAP records as bytes: what a recording appends.

/// Appends a record: its kind, its length, and what `body` appends.
pub(crate) fn record(bytes: &mut Vec<u8>, opcode: u8, body: impl FnOnce(&mut Vec<u8>)) {
    bytes.push(opcode);
    let length_at = bytes.len();
    bytes.extend_from_slice(&[0; 8]);
    let body_at = bytes.len();
    body(bytes);
    let length = (bytes.len() - body_at) as u64;
    bytes[length_at..body_at].copy_from_slice(&length.to_le_bytes());
}

/// Appends fields, all of them little-endian.
pub(crate) trait Fields {
    fn u16(&mut self, number: u16);
    fn u32(&mut self, number: u32);
    fn u64(&mut self, number: u64);
    /// Bytes behind a 32-bit length.
    fn blob(&mut self, bytes: &[u8]);
    /// What `items` appends, behind its length in 32 bits.
    fn list(&mut self, items: impl FnOnce(&mut Self));

    fn text(&mut self, text: &str) {
        self.blob(text.as_bytes());
    }
}

impl Fields for Vec<u8> {
    fn u16(&mut self, number: u16) {
        self.extend_from_slice(&number.to_le_bytes());
    }

    fn u32(&mut self, number: u32) {
        self.extend_from_slice(&number.to_le_bytes());
    }

    fn u64(&mut self, number: u64) {
        self.extend_from_slice(&number.to_le_bytes());
    }

    fn blob(&mut self, bytes: &[u8]) {
        self.u32(short(bytes.len()));
        self.extend_from_slice(bytes);
    }

    fn list(&mut self, items: impl FnOnce(&mut Self)) {
        let length_at = self.len();
        self.u32(0);
        let items_at = self.len();
        items(self);
        let length = short(self.len() - items_at);
        self[length_at..items_at].copy_from_slice(&length.to_le_bytes());
    }
}

/// A length in 32 bits. Nothing that is recorded is longer: chunks are closed at a quarter of a mebibyte, and a script has a mebibyte at most.
pub(crate) fn short(length: usize) -> u32 {
    u32::try_from(length).unwrap_or(u32::MAX)
}
