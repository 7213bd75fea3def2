use std::f64::consts::PI;

use super::*;
use crate::blur::Blur;
use crate::{Contact, Indenter};

const GRID: Grid = Grid { step_mm: 0.2, steps: 40 };
const SIGMA_MM: f64 = 0.9;

/// The value of a spline at a node, from its coefficients there and around.
fn value(table: &[f64], col: usize, row: usize) -> f64 {
    let nodes = GRID.nodes();
    let along = |row: usize| {
        let at = |col: usize| table[row * nodes + col];
        (at(col - 1) + 4.0 * at(col) + at(col + 1)) / 6.0
    };
    (along(row - 1) + 4.0 * along(row) + along(row + 1)) / 6.0
}

#[test]
fn elements_get_what_the_closed_form_gives_them() {
    // A box is a rectangle: what an element gets of it is a product of closed forms.
    let indenter = Indenter::Box { size_mm: [2.0, 1.2] };
    let contact = Contact { indenter, position_mm: [0.3, -0.2], rotation_deg: 0.0, depth_mm: 0.4 };
    let basis = Basis::new(GRID, SIGMA_MM, [1.0, 0.7], &[0.0, PI / 2.0]);
    let pressed = contact.pressed(Cut::Penetration, [0.0; 2], SIGMA_MM);
    let tables = basis.tables(&basis.waves(&pressed, Cut::Penetration));
    let blur = Blur { sigma_mm: SIGMA_MM };
    for (table, [width_mm, height_mm]) in tables.iter().zip([[1.0, 0.7], [0.7, 1.0]]) {
        for (col, row) in [(40, 40), (44, 37), (33, 46), (52, 40), (20, 61)] {
            let [x, y] = [col, row].map(|node| (node as f64 - 40.0) * GRID.step_mm);
            let along_x = blur.of_line([-0.7, 1.3], [x - width_mm / 2.0, x + width_mm / 2.0]);
            let along_y = blur.of_line([-0.8, 0.4], [y - height_mm / 2.0, y + height_mm / 2.0]);
            let (got, want) = (value(table, col, row), 0.4 * along_x * along_y);
            assert!((got - want).abs() < 1e-7, "{col} {row}: {got} {want}");
        }
    }
}

#[test]
fn a_field_stays_within_its_bound() {
    let indenter = Indenter::Cylinder { diameter_mm: 1.0 };
    let contact = Contact { indenter, position_mm: [0.0; 2], rotation_deg: 0.0, depth_mm: 0.5 };
    let basis = Basis::new(GRID, SIGMA_MM, [1e-3, 1e-3], &[0.0]);
    let field = basis.waves(&contact.pressed(Cut::Penetration, [0.0; 2], SIGMA_MM), Cut::Penetration);
    // An element so small that it gets the field in its middle.
    let tables = basis.tables(&field);
    let greatest = value(&tables[0], 40, 40) / 1e-6;
    let bound = field.bound();
    assert!(greatest <= bound && bound < 1.3 * greatest, "{greatest} {bound}");
    let nothing = Waves::sum([(&field, 0.3), (&field, -0.3)]);
    assert!(nothing.bound() < 1e-15);
}
