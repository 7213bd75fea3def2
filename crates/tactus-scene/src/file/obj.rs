//! OBJ, by the crate `tobj`.

use tobj::{LoadError, LoadOptions};

use super::{Faces, FileError, Format::Obj, TRIANGLES_MAX, VERTICES_MAX, at_most};

pub(super) fn read(bytes: &[u8]) -> Result<Faces, FileError> {
    let geometry = geometry(&String::from_utf8_lossy(bytes))?;
    let options =
        LoadOptions { triangulate: true, ignore_points: true, ignore_lines: true, ..Default::default() };
    // Without lines that name one, no material is asked for.
    let (models, _) =
        tobj::load_obj_buf(&mut geometry.as_bytes(), &options, |_| Err(LoadError::OpenFileFailed))
            .map_err(|error| Obj.broken(&error))?;
    // One model, there being no groups.
    let faces = models.into_iter().next().map(|model| model.mesh).unwrap_or_default();
    let vertices_mm = faces.positions.as_chunks().0.to_vec();
    let triangles = faces.indices.as_chunks().0.to_vec();
    Ok(Faces { vertices_mm, triangles })
}

/// Vertices and faces only: of a vertex its coordinates, without colour and without the weight that only
/// curves have; of a corner its vertex.
///
/// Of what is left out, `tobj` would take polylines for faces, and its sums overflow on absurd indices of
/// normals.
fn geometry(text: &str) -> Result<String, FileError> {
    let mut geometry = String::new();
    let (mut vertices, mut faces) = (0, 0);
    for line in Obj.lines(text)? {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                vertices += 1;
                geometry.push('v');
                words.take(3).for_each(|word| geometry.extend([" ", word]));
            }
            Some("f") => {
                // Even a face of one corner costs as much as a triangle.
                faces += words.clone().count().saturating_sub(2).max(1);
                geometry.push('f');
                let corners = words.map(|word| word.split('/').next().unwrap_or_default());
                corners.for_each(|corner| geometry.extend([" ", corner]));
            }
            _ => continue,
        }
        geometry.push('\n');
    }
    at_most("vertices", vertices, VERTICES_MAX)?;
    at_most("triangles", faces, TRIANGLES_MAX)?;
    Ok(geometry)
}
