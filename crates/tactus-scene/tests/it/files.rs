//! The committed tools, and the same shapes in every format, load as what was made.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::{fmt::Write, fs, path::Path};

use tactus_model::Mesh;
use tactus_scene::{
    FileError, Format, load, read,
    shapes::{SCENES, Surface, wrench},
};

fn same_triangles(loaded: &Mesh, made: &Mesh) {
    assert!(loaded.corners_mm().eq(made.corners_mm()));
}

#[test]
fn every_committed_tool_is_the_made_one() {
    for scene in SCENES {
        let path = format!("{}/../../assets/{}.stl", env!("CARGO_MANIFEST_DIR"), scene.name());
        same_triangles(&load(Path::new(&path)).unwrap(), &scene.mesh());
    }
}

#[test]
fn every_format_holds_the_same_tools() {
    for scene in SCENES {
        let surface = scene.surface();
        for (format, text) in [
            (Format::Stl, stl(&surface)),
            (Format::Obj, obj(&surface)),
            (Format::Ply, ply(&surface).into_bytes()),
            (Format::Ply, binary_ply(&surface, false)),
            (Format::Ply, binary_ply(&surface, true)),
        ] {
            same_triangles(&read(format, &text).unwrap(), &scene.mesh());
        }
    }
}

#[test]
fn the_name_of_a_file_tells_its_format() {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [
        ("tool.stl", stl(&wrench())),
        ("TOOL.OBJ", obj(&wrench())),
        ("wrench.v2.Ply", ply(&wrench()).into_bytes()),
    ] {
        let path = folder.path().join(name);
        fs::write(&path, text).unwrap();
        assert!(load(&path).is_ok(), "{name}");
    }
    let unknown = load(&folder.path().join("tool.step")).unwrap_err();
    assert!(matches!(unknown, FileError::UnknownFormat { .. }));
    assert!(unknown.to_string().ends_with("tool.step: its name must end in .stl, .obj or .ply"));
    let missing = load(&folder.path().join("none.stl")).unwrap_err();
    assert!(matches!(missing, FileError::Io { .. }));
}

fn stl(surface: &Surface) -> Vec<u8> {
    let mut text = String::from("solid tool of ours\n");
    for corners in surface.corners_mm() {
        text.push_str("  facet normal 0 0 0\n    outer loop\n");
        for [x, y, z] in corners {
            writeln!(text, "      vertex {x} {y} {z:e}").unwrap();
        }
        text.push_str("    endloop\n  endfacet\n");
    }
    (text + "endsolid tool of ours\n").into_bytes()
}

fn obj(surface: &Surface) -> Vec<u8> {
    let mut text = String::from("# by hand\nmtllib none.mtl\no tool\nvt 0 0\nvn 0 0 1\n");
    for [x, y, z] in surface.vertices_mm() {
        writeln!(text, "v {x} {y} {z}").unwrap();
    }
    let count = surface.vertices_mm().len();
    for (triangle, [a, b, c]) in
        surface.triangles().iter().map(|corners| corners.map(|v| v as usize)).enumerate()
    {
        // Counted from the start, counted back from the end, and with texture and normal.
        match triangle % 3 {
            0 => writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1),
            1 => writeln!(text, "g part\nf -{} -{} -{}", count - a, count - b, count - c),
            _ => writeln!(text, "usemtl red\nf {}/1/1 {}//1 {}/1", a + 1, b + 1, c + 1),
        }
        .unwrap();
    }
    text.into_bytes()
}

fn ply_header(surface: &Surface, encoding: &str) -> String {
    format!(
        "ply\nformat {encoding} 1.0\ncomment by hand\nelement vertex {}\nproperty double x\n\
         property float y\nproperty float z\nproperty uchar red\nelement edge 1\nproperty int from\n\
         element face {}\nproperty float area\nproperty list uchar int vertex_indices\nend_header\n",
        surface.vertices_mm().len(),
        surface.triangles().len()
    )
}

fn ply(surface: &Surface) -> String {
    let mut text = ply_header(surface, "ascii");
    for [x, y, z] in surface.vertices_mm() {
        writeln!(text, "{x} {y} {z} 255").unwrap();
    }
    text.push_str("0\n");
    for [a, b, c] in surface.triangles() {
        writeln!(text, "0.5 3 {a} {b} {c}").unwrap();
    }
    text
}

#[expect(clippy::cast_possible_truncation, reason = "made shapes have coordinates of f32")]
fn binary_ply(surface: &Surface, big: bool) -> Vec<u8> {
    let encoding = if big { "binary_big_endian" } else { "binary_little_endian" };
    let mut bytes = ply_header(surface, encoding).into_bytes();
    let mut push = |little: &[u8]| {
        let mut number = little.to_vec();
        if big {
            number.reverse();
        }
        bytes.extend(number);
    };
    for [x, y, z] in surface.vertices_mm() {
        push(&x.to_le_bytes());
        push(&(*y as f32).to_le_bytes());
        push(&(*z as f32).to_le_bytes());
        push(&[255]);
    }
    push(&7_i32.to_le_bytes());
    for corners in surface.triangles() {
        push(&0.5_f32.to_le_bytes());
        push(&[3]);
        for corner in corners {
            push(&corner.to_le_bytes());
        }
    }
    bytes
}
