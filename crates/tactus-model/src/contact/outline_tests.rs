use std::sync::Arc;

use super::*;
use crate::Mesh;
use crate::fixtures::{prism, rotation};

/// A letter with a notch, so that parts of it hide others when it leans.
fn letter() -> Mesh {
    let outline = [[-3.0, -4.0], [3.0, -4.0], [3.0, -2.0], [-1.0, -2.0], [-1.0, 4.0], [-3.0, 4.0]];
    prism(&outline, &[[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]], 5.0)
}

fn turned(mesh: &Mesh, [pitch_deg, roll_deg]: [f64; 2]) -> Mesh {
    mesh.turned(rotation([0.0, pitch_deg, roll_deg])).unwrap()
}

fn contact(mesh: Mesh, depth_mm: f64) -> Contact {
    let indenter = Indenter::Mesh(Arc::new(mesh));
    Contact { indenter, position_mm: [0.7, -0.4], rotation_deg: 20.0, depth_mm }
}

/// Volume and first moments of what is pressed, from the nodes of its outline: `a = 1` or `x`, `b = 1` or `y`.
fn moments(edges: &[Edge], cut: Cut) -> [f64; 3] {
    let nodes = edges.iter().flat_map(|edge| edge.nodes(cut, 1.0));
    nodes.fold([0.0; 3], |[all, of_x, of_y], Node { x_mm: x, y_mm: y, once, twice }| {
        let flat = once * x + twice * x * x / 2.0;
        let rising = once * x * x / 2.0 + twice * x * x * x / 6.0;
        [all + flat, of_x + rising, of_y + flat * y]
    })
}

/// The same from slices, which have nothing in common with outlines.
fn sliced(contact: &Contact, cut: Cut) -> [f64; 3] {
    let slices = match cut {
        Cut::Penetration => contact.slices(0.3),
        Cut::Footprint => contact.footprint(0.3),
    };
    slices.iter().fold([0.0; 3], |[all, of_x, of_y], slice| {
        let [from, to] = slice.y_mm;
        let weight = slice.weight_mm2 * (to - from);
        [all + weight, of_x + weight * slice.x_mm, of_y + weight * f64::midpoint(from, to)]
    })
}

fn assert_as_sliced(contact: &Contact) {
    let edges = contact.outline([0.0; 2]).expect("nothing is hidden twice");
    for cut in [Cut::Penetration, Cut::Footprint] {
        let (got, want) = (moments(&edges, cut), sliced(contact, cut));
        for (got, want) in got.into_iter().zip(want) {
            assert!((got - want).abs() < 1e-6 * want.abs().max(1.0), "{cut:?} {got} {want}, {contact:?}");
        }
    }
}

#[test]
fn an_upright_prism_has_its_outline_and_nothing_else() {
    let contact = contact(letter(), 0.4);
    let edges = contact.outline([0.0; 2]).unwrap();
    assert_eq!(edges.len(), 6);
    assert!(edges.iter().all(|edge| edge.rim > 0.0 && edge.bend.abs() < SAME_BEND));
    let [volume_mm3, ..] = moments(&edges, Cut::Penetration);
    assert!((volume_mm3 - 0.4 * 24.0).abs() < 1e-12, "{volume_mm3}");
    assert!((moments(&edges, Cut::Footprint)[0] - 24.0).abs() < 1e-12);
}

#[test]
fn a_prism_that_leans_presses_what_slices_say() {
    for lean_deg in [[1.0, 0.0], [0.0, -2.0], [2.0, 1.0], [-4.0, 3.0], [25.0, -40.0], [80.0, 10.0]] {
        for depth_mm in [0.05, 0.2, 0.6] {
            assert_as_sliced(&contact(turned(&letter(), lean_deg), depth_mm));
        }
    }
}

#[test]
fn what_a_notch_hides_is_taken_off() {
    let contact = contact(turned(&letter(), [4.0, 3.0]), 0.8);
    let edges = contact.outline([0.0; 2]).unwrap();
    assert!(edges.iter().any(|edge| edge.rim < 0.0), "{edges:?}");
    assert_as_sliced(&contact);
}

#[test]
fn a_lean_is_that_of_the_face() {
    let upright = contact(letter(), 0.5);
    let lean = [0.02, -0.03];
    let edges = upright.outline(lean).unwrap();
    let slices = upright.leaning(lean, 0.3);
    let want: f64 = slices.iter().map(|s| s.weight_mm2 * (s.y_mm[1] - s.y_mm[0])).sum();
    let [got, ..] = moments(&edges, Cut::Penetration);
    assert!((got - want).abs() < 1e-6, "{got} {want}");
}

#[test]
fn a_tool_above_the_surface_presses_nothing() {
    for depth_mm in [0.0, -1.0] {
        assert_eq!(contact(letter(), depth_mm).outline([0.0; 2]), Some(Vec::new()));
    }
}

#[test]
fn an_open_mesh_has_no_outline() {
    let square = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]];
    let mesh = Mesh::new(&square, &[[0, 1, 2], [0, 2, 3]]).unwrap();
    assert_eq!(contact(mesh, 0.5).outline([0.0; 2]), None);
}

#[test]
fn what_is_hidden_twice_has_no_outline() {
    // A comb on its side: three teeth, one above the other, all below the surface.
    let comb = [
        [0.0, 0.0],
        [2.0, 0.0],
        [2.0, 0.1],
        [1.0, 0.1],
        [1.0, 0.2],
        [2.0, 0.2],
        [2.0, 0.3],
        [1.0, 0.3],
        [1.0, 0.4],
        [2.0, 0.4],
        [2.0, 0.5],
        [0.0, 0.5],
    ];
    let face = [
        [0, 1, 3],
        [1, 2, 3],
        [0, 3, 4],
        [0, 4, 7],
        [4, 5, 7],
        [5, 6, 7],
        [0, 7, 8],
        [0, 8, 11],
        [8, 9, 11],
        [9, 10, 11],
    ];
    // Turned about x, its y becomes its height.
    let on_its_side =
        prism(&comb, &face, 1.0).turned([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]).unwrap();
    assert!(on_its_side.skin().is_some());
    let shallow = contact(on_its_side.clone(), 0.35);
    assert_as_sliced(&shallow);
    assert_eq!(contact(on_its_side, 0.6).outline([0.0; 2]), None);
}
