//! What the DigiTacts reads when a sphere of 6 mm presses it: the forward model without a rig.
//!
//! ```text
//! cargo run --package tactus-examples --example image
//! ```
#![expect(clippy::print_stdout, reason = "a program for the terminal")]

use std::error::Error;

use tactus_model::{Array, Contact, Covering, ForwardModel, Indenter, Psf, Response};

fn main() -> Result<(), Box<dyn Error>> {
    let array = Array::digitacts();
    let (rows, cols) = (array.rows(), array.cols());
    // 1000 counts per mm and 100 counts at rest, for every element.
    let response = Response::uniform(rows * cols, 1000.0, 100.0);
    let model = ForwardModel::new(array, Psf::PAPER, response)?;

    // Positions are in the sensor's frame; the depth is below the covering's undeformed surface.
    let press = Contact {
        indenter: Indenter::Sphere { diameter_mm: 6.0 },
        position_mm: [8.0, 6.0],
        rotation_deg: 0.0,
        depth_mm: 0.4,
    };
    let mut counts = vec![0.0; rows * cols];
    model.image(&press, Covering { thickness_mm: 1.016 }, &mut counts);

    for row in counts.chunks(cols) {
        let cells: Vec<String> = row.iter().map(|counts| format!("{counts:6.0}")).collect();
        println!("{}", cells.join(" "));
    }
    Ok(())
}
