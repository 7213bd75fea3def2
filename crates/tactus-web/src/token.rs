//! The token of the page's address. Every command needs it, except a stop. Only those who may command the rig get it.

use std::fmt::{self, Write as _};
use std::fs::{self, File, OpenOptions};
use std::io::{self, Read as _, Write as _};
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::Path;

/// A random token, new at each start; shown as 32 hexadecimal digits.
pub(crate) struct Token(String);

impl Token {
    /// Makes a token.
    ///
    /// # Errors
    /// If the system gives no random numbers.
    pub(crate) fn new() -> io::Result<Self> {
        let mut bytes = [0; 16];
        File::open("/dev/urandom")?.read_exact(&mut bytes)?;
        let mut text = String::new();
        for byte in bytes {
            write!(text, "{byte:02x}").map_err(io::Error::other)?;
        }
        Ok(Self(text))
    }

    /// True for the right token; takes as long for a wrong one.
    pub(crate) fn is(&self, given: &[u8]) -> bool {
        let own = self.0.as_bytes();
        own.len() == given.len()
            && own.iter().zip(given).fold(0, |all, (own, given)| all | (own ^ given)) == 0
    }

    /// Writes the token into a new file, which its owner may write and its group may read.
    ///
    /// # Errors
    /// If the file cannot be made.
    pub(crate) fn write(&self, path: &Path) -> io::Result<()> {
        match fs::remove_file(path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            Ok(()) | Err(_) => {}
        }
        let mut file = OpenOptions::new().write(true).create_new(true).mode(0o640).open(path)?;
        writeln!(file, "{}", self.0)
    }

    /// The part of the page's address that carries the token; browsers send it to nobody.
    pub(crate) fn fragment(&self) -> String {
        format!("#{}", self.0)
    }
}

impl fmt::Debug for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Token")
    }
}

#[cfg(test)]
#[path = "token_tests.rs"]
mod tests;
