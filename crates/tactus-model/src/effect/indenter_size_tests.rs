use std::sync::Arc;

use crate::effect::bench::{CYLINDER, effect, simulator, still, upon};
use crate::{Indenter, Mesh};

fn square(side_mm: f64) -> Indenter {
    let s = side_mm / 2.0;
    let corners = [[-s, -s, 0.0], [s, -s, 0.0], [s, s, 0.0], [-s, s, 0.0]];
    Indenter::Mesh(Arc::new(Mesh::new(&corners, &[[0, 1, 2], [0, 2, 3]]).unwrap()))
}

#[test]
fn every_tool_of_half_the_size_is_the_smaller_tool() {
    let cone = |diameter_mm| Indenter::Cone { diameter_mm, apex_deg: 90.0 };
    for (declared, true_one) in [
        (CYLINDER, Indenter::Cylinder { diameter_mm: 0.5 }),
        (Indenter::Sphere { diameter_mm: 4.0 }, Indenter::Sphere { diameter_mm: 2.0 }),
        (cone(0.5), cone(0.25)),
        (Indenter::Box { size_mm: [3.0, 1.0] }, Indenter::Box { size_mm: [1.5, 0.5] }),
        (square(2.0), square(1.0)),
    ] {
        let mut narrow = simulator([effect("indenter-size", [("ratio", 0.5)])]);
        let mut plain = simulator([]);
        (narrow.indenter, plain.indenter) = (declared, true_one);
        let tip_mm = upon(&plain, 21, 0.4);
        assert_eq!(still(&narrow, tip_mm), still(&plain, tip_mm), "{:?}", plain.indenter);
    }
}

#[test]
fn a_small_flat_tool_gives_a_signal_in_proportion_to_its_area() {
    let plain = simulator([]);
    let wide = simulator([effect("indenter-size", [("ratio", 1.2)])]);
    // Far off, where the response is linear and the spread is the same over the tool.
    let rise = |one: &_| still(one, upon(&plain, 21, 0.4))[23] - 100.0;
    assert!((rise(&wide) / rise(&plain) / 1.44 - 1.0).abs() < 0.02);
}
