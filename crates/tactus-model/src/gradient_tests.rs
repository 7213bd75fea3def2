use std::sync::Arc;

use crate::{Array, Contact, Covering, ForwardModel, Gradient, Indenter, Mesh, Psf, Response};

const THIN: Covering = Covering { thickness_mm: 1.016 };
const THICK: Covering = Covering { thickness_mm: 5.08 };

/// A model whose parameters are all at work.
fn model(psf: Psf) -> ForwardModel {
    let each = |from: f64, step: f64| (0..48).map(|element| from + step * f64::from(element % 5)).collect();
    let response = Response {
        sensitivity_counts_per_mm: each(900.0, 40.0),
        baseline_counts: each(100.0, 1.0),
        quadratic_per_mm: each(-0.02, 0.05),
        reference_indenter: Indenter::Cylinder { diameter_mm: 1.0 },
        reference_covering: THIN,
    };
    ForwardModel::new(Array::digitacts(), psf, response).unwrap()
}

/// A wedge with a slanting underside, which has every kind of slice of a mesh.
fn wedge() -> Indenter {
    let corners = [[-2.0, -1.0, 0.0], [2.0, -1.0, 1.0], [2.0, 1.5, 1.0], [-2.0, 1.5, 0.0]];
    Indenter::Mesh(Arc::new(Mesh::new(&corners, &[[0, 1, 2], [0, 2, 3]]).unwrap()))
}

fn tools() -> [Indenter; 5] {
    [
        Indenter::Cylinder { diameter_mm: 1.0 },
        Indenter::Sphere { diameter_mm: 4.0 },
        Indenter::Cone { diameter_mm: 3.0, apex_deg: 100.0 },
        Indenter::Box { size_mm: [3.0, 1.0] },
        wedge(),
    ]
}

fn press(indenter: &Indenter) -> Contact {
    Contact { indenter: indenter.clone(), position_mm: [6.3, 5.2], rotation_deg: 20.0, depth_mm: 0.5 }
}

fn image(psf: Psf, contact: &Contact, covering: Covering) -> Vec<f64> {
    let model = model(psf);
    let mut counts = vec![0.0; 48];
    model.image(contact, covering, &mut counts);
    counts
}

/// Central differences: `change` makes the image with a parameter changed by its argument.
fn assert_derivative(name: &str, got: &[f64], step: f64, change: impl Fn(f64) -> Vec<f64>) {
    let (up, down) = (change(step), change(-step));
    let peak = got.iter().fold(0.0_f64, |peak, value| peak.max(value.abs()));
    for (element, got) in got.iter().enumerate() {
        let want = (up[element] - down[element]) / (2.0 * step);
        assert!((got - want).abs() < 1e-6 * peak.max(1.0), "{name}, element {element}: {got} {want}");
    }
}

#[test]
fn every_derivative_agrees_with_central_differences() {
    let psf = Psf::PAPER;
    for tool in tools() {
        for covering in [THIN, THICK] {
            let contact = press(&tool);
            let Gradient {
                counts,
                by_position_mm: [by_x, by_y],
                by_rotation_deg,
                by_depth_mm,
                by_sigma_intercept_mm,
                by_sigma_per_mm,
                ..
            } = model(psf).gradient(&contact, covering);
            assert!(
                counts
                    .iter()
                    .zip(image(psf, &contact, covering))
                    .all(|(got, want)| (got - want).abs() < 1e-9)
            );
            let [x, y] = contact.position_mm;
            let moved = |position_mm| image(psf, &Contact { position_mm, ..contact.clone() }, covering);
            assert_derivative("x", &by_x, 1e-4, |step| moved([x + step, y]));
            assert_derivative("y", &by_y, 1e-4, |step| moved([x, y + step]));
            assert_derivative("rotation", &by_rotation_deg, 1e-2, |step| {
                image(psf, &Contact { rotation_deg: 20.0 + step, ..contact.clone() }, covering)
            });
            assert_derivative("depth", &by_depth_mm, 1e-4, |step| {
                image(psf, &Contact { depth_mm: 0.5 + step, ..contact.clone() }, covering)
            });
            assert_derivative("sigma_intercept", &by_sigma_intercept_mm, 1e-4, |step| {
                let sigma_intercept_mm = psf.sigma_intercept_mm + step;
                image(Psf { sigma_intercept_mm, ..psf }, &contact, covering)
            });
            assert_derivative("sigma_per_mm", &by_sigma_per_mm, 1e-4, |step| {
                image(Psf { sigma_per_mm: psf.sigma_per_mm + step, ..psf }, &contact, covering)
            });
        }
    }
}

#[test]
fn by_its_own_response_an_element_changes_as_the_formula_says() {
    let model = model(Psf::PAPER);
    let contact = press(&Indenter::Sphere { diameter_mm: 4.0 });
    let gradient = model.gradient(&contact, THIN);
    let with = |change: &dyn Fn(&mut Response)| {
        let mut response = model.response().clone();
        change(&mut response);
        let mut counts = vec![0.0; 48];
        ForwardModel::new(model.array().clone(), model.psf(), response).unwrap().image(
            &contact,
            THIN,
            &mut counts,
        );
        counts
    };
    assert_derivative("sensitivity", &gradient.by_sensitivity, 1e-2, |step| {
        with(&|response| response.sensitivity_counts_per_mm.iter_mut().for_each(|each| *each += step))
    });
    assert_derivative("quadratic", &gradient.by_quadratic, 1e-5, |step| {
        with(&|response| response.quadratic_per_mm.iter_mut().for_each(|each| *each += step))
    });
}

#[test]
fn beyond_the_coverings_foot_depth_adds_only_where_the_tool_widens() {
    let model = model(Psf::PAPER);
    let deep = |indenter| Contact { depth_mm: 1.2, ..press(&indenter) };
    let flat = model.gradient(&deep(Indenter::Cylinder { diameter_mm: 1.0 }), THIN);
    assert!(flat.by_depth_mm.iter().all(|by_depth| by_depth.abs() < 1e-9));
    let round = model.gradient(&deep(Indenter::Sphere { diameter_mm: 4.0 }), THIN);
    assert!(round.by_depth_mm.iter().all(|by_depth| *by_depth > 0.0));
}
