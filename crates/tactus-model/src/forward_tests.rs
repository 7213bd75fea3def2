use std::sync::Arc;

use proptest::prelude::*;

use super::*;
use crate::Mesh;
use crate::fixtures::{block, rotation};

const THIN: Covering = Covering { thickness_mm: 1.016 };
/// Thick enough for the half ball.
const DEEP: Covering = Covering { thickness_mm: 2.5 };
const CYLINDER: Indenter = Indenter::Cylinder { diameter_mm: 1.0 };
const SPHERE: Indenter = Indenter::Sphere { diameter_mm: 4.0 };
const BOX: Indenter = Indenter::Box { size_mm: [3.0, 1.0] };

fn linear(elements: usize) -> Response {
    Response::uniform(elements, 1000.0, 100.0)
}

fn digitacts(psf: Psf) -> ForwardModel {
    ForwardModel::new(Array::digitacts(), psf, linear(48)).unwrap()
}

fn at(indenter: Indenter, position_mm: [f64; 2], depth_mm: f64) -> Contact {
    Contact { indenter, position_mm, rotation_deg: 0.0, depth_mm }
}

fn indentation(model: &ForwardModel, contact: &Contact, covering: Covering) -> Vec<f64> {
    let mut out = vec![0.0; model.array().elements()];
    model.indentation(contact, covering, &mut out);
    out
}

fn image(model: &ForwardModel, contact: &Contact) -> Vec<f64> {
    let mut out = vec![0.0; model.array().elements()];
    model.image(contact, THIN, &mut out);
    out
}

/// Share of what presses at `at` that arrives within `size` about `centre`: Boole's rule on the Gaussian
/// itself, without the error function.
fn share_by_quadrature(at: f64, centre: f64, size: f64, sigma: f64) -> f64 {
    let pieces = 48;
    let step = size / f64::from(pieces);
    let sum: f64 = (0..=pieces)
        .map(|k| {
            let z = (centre - size / 2.0 + step * f64::from(k) - at) / sigma;
            boole(k, pieces) * (-0.5 * z * z).exp()
        })
        .sum();
    sum * step * 2.0 / 45.0 / (sigma * (2.0 * std::f64::consts::PI).sqrt())
}

/// Weights of Boole's rule, in 2/45 of a step.
fn boole(k: i32, pieces: i32) -> f64 {
    match k {
        _ if k == 0 || k == pieces => 7.0,
        _ if k % 4 == 0 => 14.0,
        _ if k % 4 == 2 => 12.0,
        _ => 32.0,
    }
}

/// `d_e` of a round tool by direct quadrature over its face in polar coordinates, with the radii
/// `r = rim sin(t)` so that a penetration like that of a sphere is smooth in `t` too.
fn round_by_quadrature(
    [x, y]: [f64; 2],
    rim: f64,
    penetration: impl Fn(f64) -> f64,
    centre: [f64; 2],
    sigma: f64,
) -> f64 {
    let (radii, angles) = (96, 32);
    let step = std::f64::consts::FRAC_PI_2 / f64::from(radii);
    let turn = 2.0 * std::f64::consts::PI / f64::from(angles);
    let mut sum = 0.0;
    for k in 0..=radii {
        let (sin, cos) = (step * f64::from(k)).sin_cos();
        let r = rim * sin;
        let ring: f64 = (0..angles)
            .map(|a| {
                let (dy, dx) = (turn * f64::from(a)).sin_cos();
                share_by_quadrature(x + r * dx, centre[0], 1.8, sigma)
                    * share_by_quadrature(y + r * dy, centre[1], 1.8, sigma)
            })
            .sum();
        sum += boole(k, radii) * penetration(r) * r * rim * cos * ring * turn;
    }
    sum * step * 2.0 / 45.0
}

#[test]
fn a_cylinder_agrees_with_direct_quadrature() {
    let model = digitacts(Psf::PAPER);
    let (position, depth) = ([6.3, 5.2], 0.5);
    let d_ref = round_by_quadrature([0.0; 2], 0.5, |_| 1.0, [0.0; 2], Psf::PAPER.sigma_mm(THIN));
    for covering in [THIN, Covering { thickness_mm: 5.08 }] {
        let got = indentation(&model, &at(CYLINDER, position, depth), covering);
        for element in [0, 7, 18, 19, 26, 47] {
            let centre = model.array().centre_mm(element).unwrap();
            let want =
                round_by_quadrature(position, 0.5, |_| depth, centre, Psf::PAPER.sigma_mm(covering)) / d_ref;
            assert!((got[element] / want - 1.0).abs() < 1e-9, "element {element}: {} {want}", got[element]);
        }
    }
}

#[test]
fn a_sphere_agrees_with_direct_quadrature() {
    let psf = Psf { sigma_intercept_mm: 1.0, sigma_per_mm: 0.0 };
    let model = digitacts(psf);
    let (position, depth, radius) = ([6.3, 5.2], 0.7_f64, 2.0);
    let rim = (depth * (2.0 * radius - depth)).sqrt();
    let penetration = |r: f64| depth - radius + (radius * radius - r * r).sqrt();
    let d_ref = round_by_quadrature([0.0; 2], 0.5, |_| 1.0, [0.0; 2], 1.0);
    let got = indentation(&model, &at(SPHERE, position, depth), THIN);
    for element in [11, 18, 19, 26] {
        let centre = model.array().centre_mm(element).unwrap();
        let want = round_by_quadrature(position, rim, penetration, centre, 1.0) / d_ref;
        assert!((got[element] / want - 1.0).abs() < 1e-9, "element {element}: {} {want}", got[element]);
    }
}

#[test]
fn a_cone_agrees_with_direct_quadrature() {
    let psf = Psf { sigma_intercept_mm: 1.0, sigma_per_mm: 0.0 };
    let model = digitacts(psf);
    let (position, depth) = ([6.3, 5.2], 0.7_f64);
    let d_ref = round_by_quadrature([0.0; 2], 0.5, |_| 1.0, [0.0; 2], 1.0);
    let cone = Indenter::Cone { diameter_mm: 3.0, apex_deg: 90.0 };
    let got = indentation(&model, &at(cone, position, depth), THIN);
    for element in [11, 18, 19, 26] {
        let centre = model.array().centre_mm(element).unwrap();
        let want = round_by_quadrature(position, depth, |r| depth - r, centre, 1.0) / d_ref;
        assert!((got[element] / want - 1.0).abs() < 1e-9, "element {element}: {} {want}", got[element]);
    }
}

#[test]
fn a_mesh_agrees_with_the_box_that_it_is() {
    let model = digitacts(Psf::PAPER);
    let corners = [[-1.5, -0.5, 2.0], [1.5, -0.5, 2.0], [1.5, 0.5, 2.0], [-1.5, 0.5, 2.0]];
    let mesh = Indenter::Mesh(Arc::new(Mesh::new(&corners, &[[0, 1, 2], [0, 2, 3]]).unwrap()));
    for rotation_deg in [0.0, 30.0, 90.0] {
        let press = |indenter| Contact { rotation_deg, ..at(indenter, [6.3, 5.2], 0.5) };
        let got = indentation(&model, &press(mesh.clone()), THIN);
        let want = indentation(&model, &press(BOX), THIN);
        assert!(got.iter().zip(&want).all(|(got, want)| (got / want - 1.0).abs() < 1e-9));
    }
}

/// Closed, unlike the mesh above, so that its image follows from its edges.
const BLOCK_MM: [f64; 3] = [3.0, 1.0, 2.0];

#[test]
fn a_closed_mesh_agrees_with_the_box_that_it_is() {
    for sigma_mm in [0.3, 1.0, 5.0] {
        let model = digitacts(Psf { sigma_intercept_mm: sigma_mm, sigma_per_mm: 0.0 });
        for rotation_deg in [0.0, 30.0, 90.0] {
            let press = |indenter| Contact { rotation_deg, ..at(indenter, [6.3, 5.2], 0.5) };
            let mesh = press(Indenter::Mesh(Arc::new(block(BLOCK_MM))));
            assert!(matches!(mesh.pressed(Cut::Penetration, [0.0; 2], 1.0), Pressed::Outline(_)));
            let (got, want) = (indentation(&model, &mesh, THIN), indentation(&model, &press(BOX), THIN));
            let most = got.iter().zip(&want).map(|(got, want)| (got - want).abs()).fold(0.0, f64::max);
            assert!(most < 1e-9, "{sigma_mm} {rotation_deg}: {most:e}");
        }
    }
}

#[test]
fn edges_and_slices_of_a_tilted_mesh_give_one_image() {
    for sigma_mm in [0.5, 2.7] {
        let model = digitacts(Psf { sigma_intercept_mm: sigma_mm, sigma_per_mm: 0.0 });
        for [pitch_deg, roll_deg] in [[0.3, 0.1], [2.0, -5.0], [40.0, 25.0]] {
            let tilted = block(BLOCK_MM).turned(rotation([0.0, pitch_deg, roll_deg])).unwrap();
            let contact =
                Contact { rotation_deg: 20.0, ..at(Indenter::Mesh(Arc::new(tilted)), [6.3, 5.2], 0.4) };
            let got = indentation(&model, &contact, THIN);
            let mut want = vec![0.0; 48];
            let slices = Pressed::Slices(contact.slices(sigma_mm));
            model.press(&slices, [Blur { sigma_mm }; 2], 1.0, &mut Shares::default(), &mut want);
            let most = got.iter().zip(&want).map(|(got, want)| (got - want).abs()).fold(0.0, f64::max);
            assert!(most < 1e-7, "{sigma_mm} {pitch_deg} {roll_deg}: {most:e}");
        }
    }
}

#[test]
fn an_outline_that_goes_deeper_blurs_as_before_to_the_bit() {
    let model = digitacts(Psf::PAPER);
    let mut shares = Shares::default();
    for (position_mm, depth_mm) in
        [([6.3, 5.2], 0.1), ([6.3, 5.2], 0.4), ([7.0, 5.2], 0.4), ([7.0, 5.2], 0.2)]
    {
        let contact = at(Indenter::Mesh(Arc::new(block(BLOCK_MM))), position_mm, depth_mm);
        let load = Load { weight: 1.0, contact: contact.clone(), lean: [0.0; 2], sigma_mm: [2.7; 2] };
        let mut again = vec![0.0; 48];
        model.indentation_again(&load, THIN, &mut shares, &mut again);
        let mut anew = vec![0.0; 48];
        model.indentation_of(&load, THIN, &mut anew);
        assert_eq!(again, anew);
    }
}

#[test]
fn a_tool_nearly_along_the_axes_is_as_exact_as_any() {
    // A long bar turned by a little: by Gauss-Legendre over the bar itself, in its own frame.
    let model = digitacts(Psf { sigma_intercept_mm: 1.0, sigma_per_mm: 0.0 });
    let d_ref = round_by_quadrature([0.0; 2], 0.5, |_| 1.0, [0.0; 2], 1.0);
    let corners = [[-1.0, -5.0, 0.0], [1.0, -5.0, 0.0], [1.0, 5.0, 0.0], [-1.0, 5.0, 0.0]];
    let mesh = Indenter::Mesh(Arc::new(Mesh::new(&corners, &[[0, 1, 2], [0, 2, 3]]).unwrap()));
    for rotation_deg in [0.01, 0.3, 2.0, 89.8] {
        let (sin, cos) = f64::to_radians(rotation_deg).sin_cos();
        for tool in [Indenter::Box { size_mm: [2.0, 10.0] }, mesh.clone()] {
            let contact = Contact { rotation_deg, ..at(tool, [6.3, 5.2], 0.5) };
            let got = indentation(&model, &contact, THIN);
            for element in [3, 18, 27, 42] {
                let centre = model.array().centre_mm(element).unwrap();
                let (across, along) = (48, 192);
                let (du, dv) = (2.0 / f64::from(across), 10.0 / f64::from(along));
                let mut want = 0.0;
                for i in 0..=across {
                    for j in 0..=along {
                        let (u, v) = (-1.0 + du * f64::from(i), -5.0 + dv * f64::from(j));
                        want += boole(i, across)
                            * boole(j, along)
                            * share_by_quadrature(6.3 + cos * u - sin * v, centre[0], 1.8, 1.0)
                            * share_by_quadrature(5.2 + sin * u + cos * v, centre[1], 1.8, 1.0);
                    }
                }
                want *= 0.5 * du * dv * (2.0_f64 / 45.0).powi(2) / d_ref;
                assert!(
                    (got[element] - want).abs() < 1e-9,
                    "{rotation_deg} degrees, element {element}: {} {want}",
                    got[element]
                );
            }
        }
    }
}

#[test]
fn a_tool_goes_no_deeper_than_the_covering() {
    let model = digitacts(Psf::PAPER);
    let press =
        |indenter: &Indenter, depth| indentation(&model, &at(indenter.clone(), [6.3, 5.2], depth), THIN);
    for flat in [CYLINDER, BOX] {
        let (through, foot) = (press(&flat, 1.5), press(&flat, THIN.thickness_mm));
        assert!(through.iter().zip(&foot).all(|(through, foot)| (through - foot).abs() < 1e-12));
    }
    // A cylinder's worth of covering is all that a thick needle displaces, however deep it goes.
    let needle = Indenter::Cone { diameter_mm: 1.0, apex_deg: 1.0 };
    let deep = at(needle, [6.3, 5.2], 200.0);
    let (got, want) = (indentation(&model, &deep, THIN), press(&CYLINDER, THIN.thickness_mm));
    assert!(got.iter().zip(&want).all(|(got, want)| (got / want - 1.0).abs() < 1e-9));
}

#[test]
fn a_box_agrees_with_its_closed_form() {
    let model = digitacts(Psf::PAPER);
    let sigma = Psf::PAPER.sigma_mm(THIN);
    let d_ref = round_by_quadrature([0.0; 2], 0.5, |_| 1.0, [0.0; 2], sigma);
    let got = indentation(&model, &at(BOX, [6.3, 5.2], 0.5), THIN);
    let blur = Blur { sigma_mm: sigma };
    for element in [0, 18, 26, 47] {
        let [x, y] = model.array().centre_mm(element).unwrap();
        let want = 0.5
            * blur.of_line([6.3 - 1.5, 6.3 + 1.5], [x - 0.9, x + 0.9])
            * blur.of_line([5.2 - 0.5, 5.2 + 0.5], [y - 0.9, y + 0.9])
            / d_ref;
        assert!((got[element] / want - 1.0).abs() < 1e-9, "element {element}: {} {want}", got[element]);
    }
}

#[test]
fn the_reference_press_reads_the_sensitivity() {
    let quadratic = Response { quadratic_per_mm: vec![0.15; 48], ..linear(48) };
    let model = ForwardModel::new(Array::digitacts(), Psf::PAPER, quadratic).unwrap();
    for element in [0, 21, 47] {
        let centre = model.array().centre_mm(element).unwrap();
        for depth in [0.2, 0.6] {
            let counts = image(&model, &at(CYLINDER, centre, depth));
            let want = 100.0 + 1000.0 * (depth + 0.15 * depth * depth);
            assert!((counts[element] - want).abs() < 1e-9, "{} {want}", counts[element]);
        }
    }
}

#[test]
fn the_neighbour_reads_what_a_spread_of_1_36_pitches_gives() {
    // Two pitches of 2.0 mm apart a Gaussian of 1.36 pitches falls to exp(-1/(2 1.36^2)) = 0.763;
    // integration over tool and element widens it to 0.77.
    let model = digitacts(Psf::PAPER);
    let got = indentation(&model, &at(CYLINDER, [0.9, 4.9], 0.5), THIN);
    let share = got[24] / got[16];
    assert!((share - 0.77).abs() < 0.005, "{share}");
}

#[test]
fn all_that_presses_arrives_on_an_array_without_gaps() {
    let centres: Vec<f64> = (0..40).map(|k| 1.8 * f64::from(k)).collect();
    let array = Array::new("wide", [1.8, 1.8], centres.clone(), centres, 30.0, 4095.0, 1.0).unwrap();
    let model = ForwardModel::new(array, Psf::PAPER, linear(1600)).unwrap();
    let volume_of =
        |contact: &Contact| indentation(&model, contact, DEEP).iter().sum::<f64>() * model.reference_mm2;
    let middle = [35.3, 34.6];
    let half_ball = 2.0 * std::f64::consts::PI * 8.0 / 3.0;
    for (tool, depth, want) in
        [(CYLINDER, 0.5, 0.125 * std::f64::consts::PI), (BOX, 0.5, 1.5), (SPHERE, 2.0, half_ball)]
    {
        let got = volume_of(&at(tool.clone(), middle, depth));
        assert!((got / want - 1.0).abs() < 1e-12, "{tool:?}: {got} {want}");
    }
    let turned = Contact { rotation_deg: 30.0, ..at(BOX, middle, 0.5) };
    assert!((volume_of(&turned) / 1.5 - 1.0).abs() < 1e-12);
}

#[test]
fn without_spread_an_element_reads_what_stands_on_it() {
    let model = digitacts(Psf { sigma_intercept_mm: 1e-3, sigma_per_mm: 0.0 });
    // The tool's axis on the right edge of element 0, 0.2 mm from element 1.
    let got = indentation(&model, &at(CYLINDER, [1.8, 0.9], 1.0), THIN);
    let a: f64 = 0.5;
    let beyond =
        |distance: f64| a * a * (distance / a).acos() - distance * (a * a - distance * distance).sqrt();
    let area = std::f64::consts::PI * a * a;
    for (element, want) in [(0, 0.5), (1, beyond(0.2) / area), (8, 0.0), (47, 0.0)] {
        assert!((got[element] - want).abs() < 1e-5, "element {element}: {} {want}", got[element]);
    }
}

#[test]
fn with_endless_spread_every_element_reads_the_same() {
    let model = digitacts(Psf { sigma_intercept_mm: 1e4, sigma_per_mm: 0.0 });
    let got = indentation(&model, &at(SPHERE, [1.8, 0.9], 0.5), THIN);
    for value in &got {
        assert!((value / got[0] - 1.0).abs() < 2e-6, "{value} {}", got[0]);
    }
    // The share of the volume is the element's area under the Gaussian's peak.
    let volume = std::f64::consts::PI * 0.25 * (2.0 - 0.5 / 3.0);
    let want = volume * 1.8 * 1.8 / (2.0 * std::f64::consts::PI * 1e8);
    assert!((got[0] * model.reference_mm2 / want - 1.0).abs() < 2e-6);
}

#[test]
fn unfit_parameters_are_refused_by_name() {
    let refused =
        |psf, response| ForwardModel::new(Array::digitacts(), psf, response).unwrap_err().to_string();
    let short = Response { baseline_counts: vec![0.0; 47], ..linear(48) };
    assert_eq!(refused(Psf::PAPER, short), "baseline_counts has 47 values for 48 elements");
    let unknown = Response { quadratic_per_mm: vec![f64::NAN; 48], ..linear(48) };
    assert!(refused(Psf::PAPER, unknown).starts_with("quadratic_per_mm"));
    let sharp = Psf { sigma_intercept_mm: 0.0, sigma_per_mm: 0.0 };
    assert!(refused(sharp, linear(48)).starts_with("sigma"));
    let pointless = Response { reference_indenter: Indenter::Cylinder { diameter_mm: 0.0 }, ..linear(48) };
    assert!(refused(Psf::PAPER, pointless).starts_with("reference_indenter"));
}

proptest! {
    #[test]
    fn a_press_mirrored_about_the_middle_gives_the_mirrored_image(
        x in 0.0..16.2, y in 0.0..11.8, depth in 0.05..0.7, tool in prop::sample::select(vec![CYLINDER, SPHERE, BOX]),
    ) {
        let model = digitacts(Psf::PAPER);
        let one = image(&model, &at(tool.clone(), [x, y], depth));
        let other = image(&model, &at(tool, [16.2 - x, 11.8 - y], depth));
        for (a, b) in one.iter().zip(other.iter().rev()) {
            prop_assert!((a - b).abs() < 1e-9, "{a} {b}");
        }
    }

    #[test]
    fn flat_tools_press_in_proportion_to_depth(x in 0.0..16.2, y in 0.0..11.8, depth in 0.05..0.7) {
        let model = digitacts(Psf::PAPER);
        for tool in [CYLINDER, BOX] {
            let unit = indentation(&model, &at(tool.clone(), [x, y], 1.0), THIN);
            let got = indentation(&model, &at(tool, [x, y], depth), THIN);
            for (a, b) in got.iter().zip(&unit) {
                prop_assert!((a - depth * b).abs() <= 1e-14 + 1e-12 * a.abs(), "{a} {b}");
            }
        }
    }

    #[test]
    fn a_deeper_press_reads_more_everywhere(x in 0.0..16.2, y in 0.0..11.8, depth in 0.05..3.0) {
        let model = digitacts(Psf::PAPER);
        let less = indentation(&model, &at(SPHERE, [x, y], depth), THIN);
        let more = indentation(&model, &at(SPHERE, [x, y], depth + 0.01), THIN);
        prop_assert!(less.iter().zip(&more).all(|(less, more)| more > less));
    }
}
