//! STL, by the crate `stl_io`.

use std::{
    borrow::Cow,
    io::{self, Cursor},
};

use super::{Faces, FileError, Format::Stl, TRIANGLES_MAX, at_most};

/// A header of no meaning, and the number of triangles.
const HEAD_BYTES: usize = 80 + 4;

/// A normal, three corners and two bytes of no meaning.
const TRIANGLE_BYTES: usize = 4 * 3 * 4 + 2;

pub(super) fn read(bytes: &[u8]) -> Result<Faces, FileError> {
    let expected = announced(bytes).map(|triangles| HEAD_BYTES + triangles * TRIANGLE_BYTES);
    let stl = if expected == Some(bytes.len()) {
        binary(bytes)?
    } else if bytes.trim_ascii_start().starts_with(b"solid") && !bytes.contains(&0) {
        Cow::from(one_solid(&String::from_utf8_lossy(bytes))?.into_bytes())
    } else if let Some(expected) = expected {
        let what = format!("its header announces {expected} bytes, but it has {}", bytes.len());
        return Err(Stl.broken(&what));
    } else {
        return Err(Stl.broken(&"it is too short for a binary file and does not start with \"solid\""));
    };
    faces(&stl).map_err(|error| Stl.broken(&error))
}

/// Number of triangles that the header of a binary file announces.
fn announced(bytes: &[u8]) -> Option<usize> {
    let count = bytes.get(HEAD_BYTES - 4..)?.first_chunk()?;
    usize::try_from(u32::from_le_bytes(*count)).ok()
}

/// A binary file. Many have a header like that of a text file, which would mislead `stl_io`.
fn binary(bytes: &[u8]) -> Result<Cow<'_, [u8]>, FileError> {
    at_most("triangles", (bytes.len() - HEAD_BYTES) / TRIANGLE_BYTES, TRIANGLES_MAX)?;
    let mut bytes = Cow::from(bytes);
    if bytes.starts_with(b"solid") {
        bytes.to_mut()[0] = b' ';
    }
    Ok(bytes)
}

/// A text with all its solids as one; `stl_io` reads but the first, and only one that has a name.
fn one_solid(text: &str) -> Result<String, FileError> {
    let mut one = String::from("solid all\n");
    let mut ended = false;
    for line in Stl.lines(text)? {
        match line.split_whitespace().next() {
            None => {}
            Some("solid") => ended = false,
            Some("endsolid") => ended = true,
            Some(_) => {
                one.push_str(line);
                one.push('\n');
            }
        }
    }
    if !ended {
        return Err(Stl.broken(&"the text ends before its \"endsolid\""));
    }
    one.push_str("endsolid\n");
    Ok(one)
}

fn faces(stl: &[u8]) -> io::Result<Faces> {
    let mesh = stl_io::read_stl(&mut Cursor::new(stl))?;
    let vertices_mm = mesh.vertices.iter().map(|vertex| vertex.0.map(f64::from)).collect();
    // Fewer than 3 * 5 million vertices.
    let index = |vertex: usize| u32::try_from(vertex).unwrap_or(u32::MAX);
    let triangles = mesh.faces.iter().map(|face| face.vertices.map(index)).collect();
    Ok(Faces { vertices_mm, triangles })
}
