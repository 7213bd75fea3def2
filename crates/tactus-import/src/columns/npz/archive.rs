//! The files in a ZIP archive, stored or deflated, as `NumPy` writes them.

use std::{borrow::Cow, io::Read};

use flate2::read::DeflateDecoder;

/// Begins the record at the end of an archive, which says where its directory is.
const END: &[u8] = b"PK\x05\x06";
/// Begins each entry of the directory.
const ENTRY: &[u8] = b"PK\x01\x02";
/// Begins each file.
const FILE: &[u8] = b"PK\x03\x04";

const CUT_OFF: &str = "the archive is cut off or damaged";

/// A file in an archive.
pub(super) struct ArchivedFile<'a> {
    packed: &'a [u8],
    is_deflated: bool,
    size: usize,
    checksum: u32,
}

impl<'a> ArchivedFile<'a> {
    /// Its bytes, checked. No more than the directory says are unpacked.
    pub(super) fn contents(&self) -> Result<Cow<'a, [u8]>, &'static str> {
        let bytes = if self.is_deflated {
            let mut bytes = Vec::new();
            let unpacked = DeflateDecoder::new(self.packed).take(self.size as u64).read_to_end(&mut bytes);
            unpacked.map_err(|_| CUT_OFF)?;
            Cow::Owned(bytes)
        } else {
            Cow::Borrowed(self.packed)
        };
        let mut checksum = flate2::Crc::new();
        checksum.update(&bytes);
        if bytes.len() == self.size && checksum.sum() == self.checksum { Ok(bytes) } else { Err(CUT_OFF) }
    }
}

/// The files of an archive with their names, by its directory.
pub(super) fn files(archive: &[u8]) -> Result<Vec<(String, ArchivedFile<'_>)>, &'static str> {
    read_directory(archive).ok_or(CUT_OFF)?
}

fn read_directory(archive: &[u8]) -> Option<Result<Vec<(String, ArchivedFile<'_>)>, &'static str>> {
    // A comment may follow the record.
    let end = archive.windows(END.len()).rposition(|window| window == END)?;
    let entries = half(archive, end + 10)?;
    let mut at = whole(archive, end + 16)?;
    let mut files = Vec::new();
    for _ in 0..entries {
        archive.get(at..)?.starts_with(ENTRY).then_some(())?;
        let (method, checksum) = (half(archive, at + 10)?, whole(archive, at + 16)?);
        let (packed, size, file) =
            (whole(archive, at + 20)?, whole(archive, at + 24)?, whole(archive, at + 42)?);
        let [name, extra, comment] =
            [half(archive, at + 28)?, half(archive, at + 30)?, half(archive, at + 32)?];
        let name_at = at + 46;
        at = name_at + name + extra + comment;
        let name = String::from_utf8_lossy(archive.get(name_at..name_at + name)?).into_owned();
        if [packed, size, file].contains(&0xffff_ffff) {
            return Some(Err("an array of 4 GiB or more: split it"));
        }
        if ![0, 8].contains(&method) {
            return Some(Err("packed in another way than np.savez and np.savez_compressed do"));
        }
        archive.get(file..)?.starts_with(FILE).then_some(())?;
        let bytes_at = file + 30 + half(archive, file + 26)? + half(archive, file + 28)?;
        let packed = archive.get(bytes_at..bytes_at.checked_add(packed)?)?;
        let checksum = u32::try_from(checksum).ok()?;
        files.push((name, ArchivedFile { packed, is_deflated: method == 8, size, checksum }));
    }
    Some(Ok(files))
}

fn half(bytes: &[u8], at: usize) -> Option<usize> {
    bytes.get(at..)?.first_chunk().map(|chunk| usize::from(u16::from_le_bytes(*chunk)))
}

fn whole(bytes: &[u8], at: usize) -> Option<usize> {
    usize::try_from(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?)).ok()
}
