use proptest::prelude::*;

use super::*;

const STL: &str = "solid one\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 2 0 0\nvertex 0 1 0\n\
                   endloop\nendfacet\nendsolid one\n";
const OBJ: &str = "v 0 0 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\n";
const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
                   property float z\nelement face 1\nproperty list uchar int vertex_index\nend_header\n\
                   0 0 0\n2 0 0\n0 1 0\n3 0 1 2\n";
const TRIANGLE_MM: [[f64; 3]; 3] = [[0.0; 3], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

/// A binary STL with one triangle, whose header announces `count`.
fn binary_stl(count: u32, x_mm: f32) -> Vec<u8> {
    let mut bytes = b"solid by some exporter".to_vec();
    bytes.resize(80, b' ');
    bytes.extend(count.to_le_bytes());
    let numbers = [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, x_mm, 0.0, 0.0, 0.0, 1.0, 0.0];
    bytes.extend(numbers.iter().flat_map(|number: &f32| number.to_le_bytes()));
    bytes.extend([0; 2]);
    bytes
}

/// A binary PLY with the elements of a header and the bytes below it.
fn binary_ply(elements: &str, payload: &[u8]) -> Vec<u8> {
    let header = format!("ply\nformat binary_little_endian 1.0\n{elements}\nend_header\n");
    [header.as_bytes(), payload].concat()
}

fn triangles(format: Format, text: &str) -> Vec<[[f64; 3]; 3]> {
    read(format, text.as_bytes()).unwrap().corners_mm().collect()
}

fn error(format: Format, bytes: impl AsRef<[u8]>) -> String {
    read(format, bytes.as_ref()).unwrap_err().to_string()
}

#[test]
fn one_triangle_is_the_same_in_every_format() {
    for (format, text) in [(Format::Stl, STL), (Format::Obj, OBJ), (Format::Ply, PLY)] {
        assert_eq!(triangles(format, text), [TRIANGLE_MM], "{format}");
        assert_eq!(triangles(format, &text.replace('\n', "\r\n")), [TRIANGLE_MM], "{format} of Windows");
    }
}

#[test]
fn a_binary_stl_may_call_itself_solid() {
    let mesh = read(Format::Stl, &binary_stl(1, 2.0)).unwrap();
    assert_eq!(mesh.corners_mm().collect::<Vec<_>>(), [TRIANGLE_MM]);
}

#[test]
fn all_solids_of_an_stl_are_read_and_none_needs_a_name() {
    let nameless = STL.replace(" one", "");
    assert_eq!(triangles(Format::Stl, &[STL, &nameless, STL].concat()), [TRIANGLE_MM; 3]);
}

#[test]
fn faces_of_many_corners_are_cut_in_fans() {
    let pentagon_mm = [[0.0, 0.0], [2.0, 0.0], [3.0, 1.0], [2.0, 2.0], [0.0, 2.0]];
    let obj = "v 0 0 0\nv 2 0 0\nv 3 1 0\nv 2 2 0\nv 0 2 0\nf 1 2 3 4 5\n";
    let ply =
        PLY.replace("vertex 3", "vertex 5").replace("0 1 0\n3 0 1 2", "3 1 0\n2 2 0\n0 2 0\n5 0 1 2 3 4");
    let corner = |place: usize| [pentagon_mm[place][0], pentagon_mm[place][1], 0.0];
    let fan = [[0, 1, 2], [0, 2, 3], [0, 3, 4]].map(|corners| corners.map(corner));
    assert_eq!(triangles(Format::Obj, obj), fan);
    assert_eq!(triangles(Format::Ply, &ply), fan);
}

#[test]
fn what_is_not_geometry_does_not_matter() {
    let coloured = OBJ.replacen("0 0 0", "0 0 0 1 0 0", 1).replacen("2 0 0", "2 0 0 0", 1);
    assert_eq!(triangles(Format::Obj, &coloured), [TRIANGLE_MM]);
    // A polyline is no face, and an index of a normal that would overflow is never looked at.
    let more = "vn 0 0 1\nvt 0 0\nl 1 2 3\np 1\nmtllib x.mtl\nusemtl red\nf 1//6148914691236517206 2/-9 3\n";
    assert_eq!(triangles(Format::Obj, &[OBJ, more].concat()), [TRIANGLE_MM; 2]);
    let latin1 = [b"# gr\xfc\xdfe\n", OBJ.as_bytes()].concat();
    assert!(read(Format::Obj, &latin1).is_ok());
    // Faces may come before vertices, and one of two corners has no area.
    let ply = "ply\nformat ascii 1.0\nelement face 2\nproperty list uchar uint vertex_indices\nelement vertex 3\n\
               property int x\nproperty float y\nproperty double z\nproperty list int int seen\nend_header\n\
               3 0 1 2\n2 0 1\n0 0 0 0\n2 0 0 2 7 7\n0 1 0 0\n";
    assert_eq!(triangles(Format::Ply, ply), [TRIANGLE_MM]);
}

#[test]
fn a_stl_that_announces_what_is_not_there_is_refused() {
    let expected =
        "the file is not a sound STL file: its header announces 214748364834 bytes, but it has 134";
    assert_eq!(error(Format::Stl, binary_stl(u32::MAX, 2.0)), expected);
    let whole = binary_stl(1, 2.0);
    for length in 0..whole.len() {
        assert!(matches!(read(Format::Stl, &whole[..length]), Err(FileError::Broken { .. })), "{length}");
    }
    // The format's oldest fault: a header that was never filled in.
    assert!(error(Format::Stl, binary_stl(0, 2.0)).contains("announces 84 bytes, but it has 134"));
}

#[test]
fn a_ply_that_announces_what_is_not_there_is_refused() {
    let many = PLY.replace("vertex 3", "vertex 18446744073709551615");
    assert!(
        error(Format::Ply, &many).contains("announces 18446744073709551615 bytes or more, but 26 follow")
    );
    let more = PLY.replace("face 1", "face 5");
    assert!(error(Format::Ply, &more).contains("expected 5, got 1"), "{}", error(Format::Ply, &more));

    let vertex = "element vertex 3\nproperty float x\nproperty float y\nproperty float z";
    let face = "element face 4000000000\nproperty list uint uint vertex_index";
    let bytes = binary_ply(&format!("{vertex}\n{face}"), &[0; 200]);
    assert!(error(Format::Ply, bytes).contains("announces 16000000036 bytes or more, but 200 follow"));
    // A list as long as it likes, of elements that take no bytes, and no elements at all.
    let list = format!("{vertex}\nelement face 1\nproperty list uint uint vertex_index");
    assert!(error(Format::Ply, binary_ply(&list, &[255; 200])).contains("at index 40"));
    let nothing =
        format!("{vertex}\nelement nothing 18446744073709551615\n{}", face.replace("4000000000", "1"));
    assert!(error(Format::Ply, binary_ply(&nothing, &[0; 200])).contains("or more, but 200 follow"));
}

#[test]
fn a_file_cut_off_is_refused() {
    for (format, text, name) in [(Format::Stl, STL, "one\n"), (Format::Ply, PLY, "\n")] {
        for length in 0..text.len() - name.len() - 1 {
            assert!(read(format, &text.as_bytes()[..length]).is_err(), "{format} of {length} bytes");
        }
    }
    // An OBJ has no end that could be missing; the last number may lose digits unseen.
    for length in 0..OBJ.len() - 2 {
        assert!(read(Format::Obj, &OBJ.as_bytes()[..length]).is_err(), "OBJ of {length} bytes");
    }
}

#[test]
fn what_is_no_mesh_is_refused_by_name() {
    let prefix = |format: Format| format!("the file is not a sound {format} file: ");
    let garbage = "It was a dark and stormy night.\n".repeat(9);
    assert_eq!(error(Format::Obj, &garbage), "the OBJ file has no faces");
    assert!(error(Format::Stl, &garbage).contains("its header announces"));
    assert!(error(Format::Ply, &garbage).contains("Line 1: Expected magic number 'ply'"));
    for format in [Format::Stl, Format::Ply] {
        assert!(error(format, "").starts_with(&prefix(format)), "{}", error(format, ""));
    }
    assert_eq!(error(Format::Stl, "solid none\nendsolid none\n"), "the STL file has no faces");
    let cloud = PLY.replace("face 1", "face 0").replace("3 0 1 2\n", "");
    assert_eq!(error(Format::Ply, cloud), "the PLY file has no faces");
    let upright = OBJ.replace("0 1 0", "0 0 1");
    assert!(matches!(read(Format::Obj, upright.as_bytes()), Err(FileError::Mesh(MeshError::Empty))));
    let flat = PLY.replace("property float z\n", "").replace(" 0\n", "\n");
    assert!(error(Format::Ply, flat).ends_with("its vertices have no property z"));
    let strips = PLY.replace("vertex_index", "strip");
    assert!(error(Format::Ply, strips).ends_with("its faces have no list vertex_indices"));
}

#[test]
fn an_index_of_no_vertex_is_refused() {
    for index in ["0", "4", "-4", "4294967297", "9223372036854775807", "-9223372036854775808"] {
        let text = error(Format::Obj, OBJ.replace("f 1", &format!("f {index}")));
        assert!(text.ends_with("face vertex index out of bounds"), "{index}: {text}");
    }
    assert!(error(Format::Obj, OBJ.replace("f 1", "f 99999999999999999999")).ends_with("face parse error"));
    assert!(error(Format::Obj, OBJ.replace("f 1 2 3", "f")).ends_with("invalid polygon"));
    assert_eq!(error(Format::Ply, PLY.replace("3 0 1 2", "3 0 1 3")), "triangle 0 names vertex 3 of 3");
    assert!(error(Format::Ply, PLY.replace("3 0 1 2", "3 0 1 -1")).contains("PLY property 'vertex_index'"));
}

#[test]
fn a_coordinate_that_is_no_number_is_refused() {
    assert_eq!(error(Format::Stl, binary_stl(1, f32::NAN)), "vertex 1 is not finite");
    for number in ["nan", "inf", "1e999", "x", "1,5"] {
        for (format, text) in [(Format::Stl, STL), (Format::Obj, OBJ), (Format::Ply, PLY)] {
            let text = text.replace("2 0 0", &format!("{number} 0 0"));
            assert!(read(format, text.as_bytes()).is_err(), "{format} with {number}");
        }
    }
}

#[test]
fn a_file_beyond_the_caps_is_refused_by_name() {
    let bytes = vec![b'\n'; BYTES_MAX + 1];
    let expected = "the file holds 268435457 bytes, more than 268435456: make the mesh coarser";
    assert_eq!(error(Format::Obj, &bytes), expected);

    let count = u32::try_from(TRIANGLES_MAX + 1).unwrap();
    let mut stl = binary_stl(count, 2.0);
    stl.resize(84 + 50 * (TRIANGLES_MAX + 1), 0);
    assert!(error(Format::Stl, stl).contains("5000001 triangles"));
    let fans = format!("{OBJ}{}", format!("f{}\n", " 1".repeat(30_002)).repeat(167));
    assert!(error(Format::Obj, fans).contains("5010001 triangles"));
    let points = format!("{OBJ}{}", "f 1\n".repeat(TRIANGLES_MAX));
    assert!(error(Format::Obj, points).contains("5000001 triangles"));
    let fan = binary_ply(
        "element vertex 1\nproperty char x\nproperty char y\nproperty char z\n\
         element face 1\nproperty list uint uchar vertex_index",
        &[&[0; 3], &(count + 2).to_le_bytes()[..], &vec![0; TRIANGLES_MAX + 3]].concat(),
    );
    assert!(error(Format::Ply, fan).contains("5000001 triangles"));
    let vertices = binary_ply(
        "element vertex 15000001\nproperty char x\nproperty char y\nproperty char z",
        &vec![0; 45_000_003],
    );
    assert!(error(Format::Ply, vertices).contains("15000001 vertices"));
}

#[test]
fn an_endless_line_is_refused_before_it_is_cut_in_words() {
    let line = "1 ".repeat(LINE_MAX_BYTES);
    for (format, before) in [(Format::Stl, STL), (Format::Obj, OBJ), (Format::Ply, PLY)] {
        let text = error(format, [before, &line].concat());
        assert!(text.contains("is over 65536 bytes long"), "{format}: {text}");
    }
    let comment = PLY.replace("element vertex", &format!("comment {line}\nelement vertex"));
    assert!(error(Format::Ply, comment).len() < 300);
}

/// A file of a format and what it holds.
fn file() -> impl Strategy<Value = (Format, Vec<u8>)> {
    let vertices = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
    let ply =
        binary_ply(&format!("{vertices}element face 1\nproperty list uchar int vertex_index"), &[0; 49]);
    prop_oneof![
        Just((Format::Stl, STL.into())),
        Just((Format::Stl, binary_stl(1, 2.0))),
        Just((Format::Obj, format!("vt 0 0\nvn 0 0 1\n{OBJ}f -1/1/-1 2//3 3/4\nl 1 2\n").into())),
        Just((Format::Ply, PLY.into())),
        Just((Format::Ply, ply)),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn any_bytes_are_read_or_refused(bytes: Vec<u8>, head in prop::sample::select(vec!["", "solid ", "v ", "ply\n"])) {
        let bytes = [head.as_bytes(), &bytes].concat();
        for format in [Format::Stl, Format::Obj, Format::Ply] {
            let _read_or_refused = read(format, &bytes);
        }
    }

    #[test]
    fn a_file_with_any_faults_is_read_or_refused(
        (format, mut bytes) in file(),
        faults in prop::collection::vec((any::<prop::sample::Index>(), 0..4u8, any::<u8>()), 1..6),
    ) {
        for (place, fault, byte) in faults {
            let place = place.index(bytes.len().max(1));
            match fault {
                _ if bytes.is_empty() => bytes.push(byte),
                0 => bytes[place] = byte,
                // Mostly numbers: a digit more or another one.
                1 => bytes.insert(place, b'0' + byte % 10),
                2 => drop(bytes.remove(place)),
                _ => bytes.extend_from_within(place..),
            }
        }
        let _read_or_refused = read(format, &bytes);
    }
}
