//! PLY, by the crate `ply-rs-bw`.

use ply_rs_bw::{
    parser::{Parser, Reader},
    ply::{
        ElementDef, Encoding, Header, Property, PropertyAccess, PropertyAccessResult, PropertyType,
        ScalarType,
    },
};

use super::{Faces, FileError, Format::Ply, TRIANGLES_MAX, VERTICES_MAX, at_most};

/// Most bytes of the header, all its comments included.
const HEADER_MAX_BYTES: usize = 65_536;

/// Names of the list of a face's corners; the first is the commoner one.
const CORNERS: [&str; 2] = ["vertex_indices", "vertex_index"];

pub(super) fn read(bytes: &[u8]) -> Result<Faces, FileError> {
    let (top, _) = bytes.split_at(bytes.len().min(HEADER_MAX_BYTES));
    let mut reader = Reader::new(top);
    let header = Parser::<Other>::new().read_header(&mut reader).map_err(|error| Ply.broken(&error))?;
    let payload = &bytes[top.len() - reader.get_ref().len()..];
    check(&header, payload)?;
    *reader.get_mut() = payload;
    let mut faces = Faces::default();
    for element in header.elements.values() {
        match element.name.as_str() {
            "vertex" => {
                let vertices = elements(&mut reader, element, &header)?;
                faces.vertices_mm = vertices.into_iter().map(|Vertex(mm)| mm).collect();
            }
            "face" => faces.triangles = fans(&elements(&mut reader, element, &header)?)?,
            _ => drop(elements::<Other>(&mut reader, element, &header)?),
        }
    }
    Ok(faces)
}

/// Checks what the header announces; the crate trusts it, and would make elements without end of a
/// binary payload that takes no bytes for one.
fn check(header: &Header, payload: &[u8]) -> Result<(), FileError> {
    let least_bytes = header.elements.values().map(|element| {
        let properties = element.properties.values().map(|property| least_bytes(&property.data_type));
        let line = header.encoding == Encoding::Ascii;
        element.count.saturating_mul(if line { 1 } else { properties.sum::<usize>().max(1) })
    });
    let least_bytes = least_bytes.fold(0, usize::saturating_add);
    if least_bytes > payload.len() {
        let what = format!("its header announces {least_bytes} bytes or more, but {} follow", payload.len());
        return Err(Ply.broken(&what));
    }
    if header.encoding == Encoding::Ascii {
        Ply.lines(&String::from_utf8_lossy(payload)).map(drop)?;
    }
    if let Some(vertex) = header.elements.get("vertex") {
        at_most("vertices", vertex.count, VERTICES_MAX)?;
        if let Some(axis) = ["x", "y", "z"].iter().find(|axis| !vertex.properties.contains_key(**axis)) {
            return Err(Ply.broken(&format!("its vertices have no property {axis}")));
        }
    }
    if let Some(face) = header.elements.get("face") {
        at_most("triangles", face.count, TRIANGLES_MAX)?;
        if !CORNERS.iter().any(|name| face.properties.contains_key(*name)) {
            return Err(Ply.broken(&format!("its faces have no list {}", CORNERS[0])));
        }
    }
    Ok(())
}

/// Bytes that every binary element gives to a property: a list may be empty.
fn least_bytes(property: &PropertyType) -> usize {
    match property {
        PropertyType::Scalar(scalar) | PropertyType::List(scalar, _) => match scalar {
            ScalarType::Char | ScalarType::UChar => 1,
            ScalarType::Short | ScalarType::UShort => 2,
            ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
            ScalarType::Double => 8,
        },
    }
}

fn elements<E: PropertyAccess>(
    reader: &mut Reader<&[u8]>,
    element: &ElementDef,
    header: &Header,
) -> Result<Vec<E>, FileError> {
    Parser::new().read_payload_for_element(reader, element, header).map_err(|error| Ply.broken(&error))
}

fn fans(faces: &[Face]) -> Result<Vec<[u32; 3]>, FileError> {
    let triangles = faces.iter().map(|Face(corners)| corners.len().saturating_sub(2)).sum();
    at_most("triangles", triangles, TRIANGLES_MAX)?;
    let fan = |Face(corners): &Face| {
        let first = corners.first().copied().unwrap_or_default();
        corners.windows(2).skip(1).map(|pair| [first, pair[0], pair[1]]).collect::<Vec<_>>()
    };
    Ok(faces.iter().flat_map(fan).collect())
}

/// Coordinates in mm.
struct Vertex([f64; 3]);

/// Indices of the corners.
struct Face(Vec<u32>);

/// An element that is skipped.
struct Other;

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self([0.0; 3])
    }

    fn set_double(&mut self, name: &str, value: f64) -> PropertyAccessResult {
        let Some(axis) = ["x", "y", "z"].iter().position(|axis| *axis == name) else {
            return PropertyAccessResult::Ignored;
        };
        self.0[axis] = value;
        PropertyAccessResult::Set
    }

    fn set_property(&mut self, name: &str, value: Property) -> PropertyAccessResult {
        match value.to_f32_lossy() {
            Some(value) => self.set_double(name, value.into()),
            None if ["x", "y", "z"].contains(&name) => PropertyAccessResult::UnsupportedType,
            None => PropertyAccessResult::Ignored,
        }
    }
}

impl PropertyAccess for Face {
    fn new() -> Self {
        Self(Vec::new())
    }

    fn set_property(&mut self, name: &str, value: Property) -> PropertyAccessResult {
        if !CORNERS.contains(&name) {
            return PropertyAccessResult::Ignored;
        }
        let Some(corners) = value.to_u32_list() else {
            return PropertyAccessResult::UnsupportedType;
        };
        self.0 = corners;
        PropertyAccessResult::Set
    }
}

impl PropertyAccess for Other {
    fn new() -> Self {
        Self
    }
}
