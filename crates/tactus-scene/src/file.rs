//! Meshes from files.

use std::{
    fmt,
    fs::File,
    io::{self, Read},
    path::{Path, PathBuf},
};

use tactus_model::{Mesh, MeshError};

mod obj;
mod ply;
mod stl;

/// Largest file, in bytes.
pub const BYTES_MAX: usize = 256 << 20;

/// Greatest number of triangles of a file, after faces are cut into triangles.
pub const TRIANGLES_MAX: usize = 5_000_000;

/// As many as triangles have that share none.
const VERTICES_MAX: usize = 3 * TRIANGLES_MAX;

/// Most bytes of a line of text. The readers below cut a whole line into words at once, each word many
/// times as large as its text.
const LINE_MAX_BYTES: usize = 65_536;

/// Format of a mesh file.
///
/// None of the formats states units: coordinates are taken as mm, tool frame. Only vertices and faces are read. A face with
/// more than three corners is cut into a fan from its first corner, which is correct for convex faces.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// `.stl`, stereolithography. Binary if the length is that of the announced triangles, whatever the
    /// header says; else text if it starts with `solid`. Several solids make one mesh.
    Stl,
    /// `.obj`, Wavefront object. `v` and `f` are read; materials, groups, lines and curves are not.
    Obj,
    /// `.ply`, polygon file format 1.0: text or binary of either byte order, as its header says. Of element
    /// `vertex` the properties x, y and z are read, of `face` the list `vertex_indices` or `vertex_index`.
    Ply,
}

/// Why a file cannot be read as a mesh.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum FileError {
    /// The file cannot be read.
    #[error("cannot read {}", path.display())]
    Io { path: PathBuf, source: io::Error },
    /// The extension names no format.
    #[error("cannot tell the format of {}: its name must end in .stl, .obj or .ply", path.display())]
    UnknownFormat { path: PathBuf },
    /// The file holds more than a tool needs.
    #[error("the file holds {count} {what}, more than {most}: make the mesh coarser")]
    TooLarge { what: &'static str, count: usize, most: usize },
    /// The bytes do not follow the format, or end too early.
    #[error("the file is not a sound {format} file: {what}")]
    Broken { format: Format, what: String },
    /// The file is valid but has no faces, such as a point cloud.
    #[error("the {format} file has no faces")]
    NoFaces { format: Format },
    /// The file was read, but its triangles do not make a tool.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

/// Reads a mesh from a file. The extension of its name decides the [`Format`].
///
/// # Errors
/// [`FileError`] says why the file cannot be read or is not a mesh.
pub fn load(path: &Path) -> Result<Mesh, FileError> {
    let format = Format::of(path).ok_or_else(|| FileError::UnknownFormat { path: path.to_owned() })?;
    let mut bytes = Vec::new();
    // The length that the system states is not asked for: a pipe has none.
    File::open(path)
        .and_then(|file| file.take(BYTES_MAX as u64 + 1).read_to_end(&mut bytes))
        .map_err(|source| FileError::Io { path: path.to_owned(), source })?;
    read(format, &bytes)
}

/// Reads a mesh from the bytes of a file. Its triangles keep the order of the file.
///
/// # Errors
/// [`FileError`] says why the bytes are not a mesh.
pub fn read(format: Format, bytes: &[u8]) -> Result<Mesh, FileError> {
    at_most("bytes", bytes.len(), BYTES_MAX)?;
    let faces = match format {
        Format::Stl => stl::read(bytes),
        Format::Obj => obj::read(bytes),
        Format::Ply => ply::read(bytes),
    }?;
    if faces.triangles.is_empty() {
        return Err(FileError::NoFaces { format });
    }
    Ok(Mesh::new(&faces.vertices_mm, &faces.triangles)?)
}

impl Format {
    /// The format for the extension of a file's name, in upper or lower case.
    pub fn of(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "stl" => Some(Self::Stl),
            "obj" => Some(Self::Obj),
            "ply" => Some(Self::Ply),
            _ => None,
        }
    }

    /// That a file is broken. What a crate says may have many lines and quote the file: its beginning is kept.
    fn broken(self, what: &impl ToString) -> FileError {
        let what = what.to_string();
        let what = what.split_whitespace().collect::<Vec<_>>().join(" ").chars().take(200).collect();
        FileError::Broken { format: self, what }
    }

    /// The lines of a text. Bytes that are not UTF-8 may stand in names and comments, and fail as numbers.
    fn lines(self, text: &str) -> Result<impl Iterator<Item = &str>, FileError> {
        match text.lines().position(|line| line.len() > LINE_MAX_BYTES) {
            None => Ok(text.lines()),
            Some(line) => Err(self.broken(&format!("line {} is over {LINE_MAX_BYTES} bytes long", line + 1))),
        }
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Stl => "STL",
            Self::Obj => "OBJ",
            Self::Ply => "PLY",
        })
    }
}

/// What a file holds, not yet checked.
#[derive(Default)]
struct Faces {
    vertices_mm: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
}

fn at_most(what: &'static str, count: usize, most: usize) -> Result<(), FileError> {
    if count > most { Err(FileError::TooLarge { what, count, most }) } else { Ok(()) }
}

#[cfg(test)]
#[path = "file_tests.rs"]
mod tests;
