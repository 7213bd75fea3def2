use std::fs;

use tactus_model::{Array, Contact, Psf};
use tactus_scene::shapes::{SCENES, Scene};
use tactus_solid::layered::{BaseContact, Layer};

use super::{
    COVERINGS, FigureError, ModelledPress, Progress, REFERENCE_INDENTER, Resolution, Widening, draw_all,
    point_spreads, pressed_view, side_by_side, uniform, zero_to_one,
};

#[test]
fn every_figure_is_drawn_whole_and_loads_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let mut steps = Vec::new();
    let paths = draw_all(&dir.path().join("figures"), |step| steps.push(step)).unwrap();
    assert_eq!(steps.len(), 10);
    let written: Vec<usize> = steps.iter().map(|step: &Progress| step.finished).collect();
    assert_eq!(written, (1..=10).collect::<Vec<_>>());
    assert!(steps.iter().any(|step| step.title == "Wrench and spaceship" && step.figures == 10));

    let names: Vec<_> = paths.iter().map(|path| path.file_name().unwrap().to_str().unwrap()).collect();
    // Images and colour bars.
    let panels = [
        ("figure-3.svg", 0),
        ("figure-4.svg", 16 + 1),
        ("figure-5b.svg", 4),
        ("figure-6a.svg", 2 + 1),
        ("figure-6b.svg", 2 + 1),
        ("figure-8a.svg", 12 + 1),
        ("figure-8b.svg", 8 + 1),
        ("figure-9b.svg", 0),
        ("figure-10a.svg", 9 + 1),
        ("figure-10b.svg", 0),
    ];
    assert_eq!(names[..10], panels.map(|(name, _)| name));
    assert_eq!(names[10], "index.html");
    let page = fs::read_to_string(&paths[10]).unwrap();
    for (path, (name, panels)) in paths.iter().zip(panels) {
        let svg = fs::read_to_string(path).unwrap();
        assert_well_formed(&svg);
        assert_eq!(svg.matches(r#"class="cells""#).count(), panels, "{name}");
        assert!(svg.contains("<style>") && !svg.contains("NaN") && !svg.contains("inf"), "{name}");
        assert!(page.contains(&svg), "{name} is on the page");
    }
    // Links to its own sections load nothing.
    let page = page.replace("http://www.w3.org/2000/svg", "").replace("href=\"#", "");
    for outside in ["http:", "https:", "//", "url(", "src=", "href=", "<script", "@import", "<link", "<image"]
    {
        assert!(!page.contains(outside), "{outside}");
    }
}

#[test]
fn a_folder_that_cannot_be_made_is_named() {
    let file = tempfile::NamedTempFile::new().unwrap();
    let error = draw_all(file.path(), |_| ()).unwrap_err();
    assert!(matches!(&error, FigureError::Write { path, .. } if path == file.path()), "{error}");
}

#[test]
fn after_the_elements_finite_elements_and_their_gaussian_are_nearly_identical() {
    for (covering, place_mm) in [(COVERINGS[0], [7.1, 4.9]), (COVERINGS[3], [6.1, 5.9])] {
        let press = ModelledPress::new(covering, "somewhere", place_mm).unwrap();
        for image in &press.images {
            let peak = image.iter().copied().fold(0.0, f64::max);
            assert!((peak - 1.0).abs() < 1e-12 && image.iter().all(|value| *value > -0.05), "{covering:?}");
        }
        assert!(press.difference_percent(1, 0) < 3.0, "{covering:?}");
        assert!(press.difference_percent(3, 2) < 4.0, "{covering:?}");
        // The sensor's own spread, which elasticity does not give.
        assert!(press.difference_percent(2, 0) > 30.0, "{covering:?}");
    }
}

#[test]
fn the_elements_see_no_bricks() {
    let (array, [x, y]) = (Array::digitacts(), [6.1, 5.9]);
    let [width, height] = array.element_mm().map(|size_mm| size_mm / 2.0);
    for covering in [COVERINGS[0], COVERINGS[3]] {
        let press = ModelledPress::new(covering, "between four", [x, y]).unwrap();
        let layer = Layer::new(covering.thickness_mm, 0.49, BaseContact::Bonded).unwrap().under_disc(1.0);
        let exact: Vec<_> = (0..array.elements())
            .map(|element| array.centre_mm(element).unwrap())
            .map(|[cx, cy]| {
                layer.force_on([[cx - width - x, cx + width - x], [cy - height - y, cy + height - y]])
            })
            .collect();
        let peak = exact.iter().copied().fold(0.0, f64::max);
        let off = press.images[0].iter().zip(&exact).map(|(found, exact)| (found - exact / peak).abs());
        let off = off.fold(0.0, f64::max);
        assert!(off < 2e-3, "{covering:?}: {off}");
    }
}

#[test]
fn the_slope_of_the_papers_spread_is_elasticity_and_its_intercept_is_not() {
    for poisson_ratio in [0.3, 0.45, 0.49] {
        let Widening { line: [intercept, slope], sigmas, of_layer, .. } =
            Widening::new(poisson_ratio).unwrap();
        assert_eq!(sigmas.len(), 6);
        assert!((0.43..0.47).contains(&slope), "nu {poisson_ratio}: {slope}");
        assert!((0.15..0.25).contains(&intercept), "nu {poisson_ratio}: {intercept}");
        assert!((slope - of_layer).abs() < 0.02, "nu {poisson_ratio}: {slope} for {of_layer}");
    }
}

#[test]
fn the_spreads_of_equation_4_are_named() {
    let svg = point_spreads(Psf::PAPER, 2.0, &COVERINGS).to_string();
    // 1.11 + 0.497 t with t = 0.508, 1.27, 1.778 and 2.54 pitches.
    for sigma in ["= 1.36", "= 1.74", "= 1.99", "= 2.37"] {
        assert!(svg.contains(sigma), "{sigma}");
    }
}

#[test]
fn images_span_zero_to_one() {
    assert_eq!(zero_to_one(&[2.0, 4.0, 3.0]), [0.0, 1.0, 0.5]);
    assert_eq!(zero_to_one(&[2.0, 2.0]), [0.0, 0.0]);
    for contact in side_by_side::angles().unwrap() {
        for image in [&contact.sensor, &contact.model] {
            assert!(image.iter().all(|value| (0.0..=1.0).contains(value)), "{}", contact.heading);
            assert!(image.contains(&0.0) && image.contains(&1.0), "{}", contact.heading);
        }
    }
}

#[test]
fn the_h_turns_in_the_model_and_the_sensor_follows() {
    let contacts = side_by_side::angles().unwrap();
    for (index, contact) in contacts.iter().enumerate() {
        assert!(contact.difference_percent() < 3.0, "{}", contact.heading);
        for other in &contacts[..index] {
            let apart =
                contact.model.iter().zip(&other.model).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(apart > 0.03, "{} and {}: {apart}", contact.heading, other.heading);
        }
    }
    // Upright and lying, the H and the array are each their own mirror image; between, a half turn is left.
    let mirrored = |image: &[f32], place: usize| image[place / 8 * 8 + 7 - place % 8];
    for contact in &contacts {
        let turned =
            (0..48).map(|place| (contact.model[place] - contact.model[47 - place]).abs()).fold(0.0, f32::max);
        assert!(turned < 1e-5, "{}", contact.heading);
        let lopsided = (0..48).map(|place| (contact.model[place] - mirrored(&contact.model, place)).abs());
        let straight = ["0\u{b0}", "90\u{b0}"].contains(&contact.heading.as_str());
        assert_eq!(lopsided.fold(0.0, f32::max) < 1e-5, straight, "{}", contact.heading);
    }
}

#[test]
fn a_thicker_covering_spreads_the_h_further() {
    let spreads = side_by_side::coverings().unwrap();
    let spreads =
        spreads.iter().map(|contact| [&contact.sensor, &contact.model].map(|image| second_moment(image)));
    let spreads: Vec<_> = spreads.collect();
    for row in [0, 1] {
        assert!(spreads.windows(2).all(|pair| pair[1][row] > pair[0][row]), "{spreads:?}");
    }
}

/// About the middle of the 6 x 8 array, in elements squared.
fn second_moment(image: &[f32]) -> f32 {
    let square = |place: usize| ((place % 8) as f32 - 3.5).powi(2) + ((place / 8) as f32 - 2.5).powi(2);
    let moment: f32 = image.iter().enumerate().map(|(place, value)| value * square(place)).sum();
    moment / image.iter().sum::<f32>()
}

#[test]
fn finer_elements_show_more_of_the_h() {
    // How bright the gap between the upper strokes is.
    let gaps = Array::shipped().map(|array| {
        let resolution = Resolution::new(array, &[Scene::H]).unwrap();
        let (array, image) = (&resolution.array, &resolution.images[0]);
        let [[left, right], [front, back]] = array.extent_mm();
        let [x, y] = [f64::midpoint(left, right), f64::midpoint(front, back) + 3.5];
        let nearest = |centres: &[f64], at: f64| {
            (0..centres.len())
                .min_by(|a, b| (centres[*a] - at).abs().total_cmp(&(centres[*b] - at).abs()))
                .unwrap()
        };
        image[nearest(array.row_centres_mm(), y) * array.cols() + nearest(array.col_centres_mm(), x)]
    });
    assert!(gaps[0] > gaps[1] && gaps[1] > gaps[2] && gaps[2] < 0.05, "{gaps:?}");
}

#[test]
fn tools_fit_on_the_smallest_array() {
    let array = Array::digitacts();
    let [width_mm, height_mm] = array.extent_mm().map(|[least, most]| most - least);
    for tool in SCENES {
        let [x, y, _] = tool.mesh().bounds_mm().map(|[least, most]| most - least);
        let lying = super::resolutions::pose(tool).0 > 0.0;
        let [x, y] = if lying { [y, x] } else { [x, y] };
        assert!(x < width_mm && y < height_mm, "{tool:?}");
    }
}

#[test]
fn the_pressed_view_shows_elements_covering_and_tool() {
    let svg = pressed_view(&Array::digitacts(), COVERINGS[1], &Scene::H.surface(), 0.7).to_string();
    assert_well_formed(&svg);
    assert!(svg.contains("fill-opacity"), "the covering is translucent");
}

#[test]
fn figures_come_out_the_same_every_time() {
    let draw = || side_by_side::draw_coverings().unwrap().sheet.to_string();
    assert_eq!(draw(), draw());
}

#[test]
fn elements_of_the_model_answer_alike() {
    let array = Array::digitacts();
    let model = uniform(array.clone(), Psf::PAPER).unwrap();
    let mut image = vec![0.0; array.elements()];
    for element in [0, 20, 47] {
        let position_mm = array.centre_mm(element).unwrap();
        let contact = Contact { indenter: REFERENCE_INDENTER, position_mm, rotation_deg: 0.0, depth_mm: 0.4 };
        model.image(&contact, COVERINGS[0], &mut image);
        assert!((image[element] - 0.4).abs() < 1e-9);
    }
}

/// Every tag is closed in its turn, and attributes are quoted.
fn assert_well_formed(xml: &str) {
    let mut open = Vec::new();
    for tag in xml.split('<').skip(1) {
        let (tag, text) = tag.split_once('>').unwrap_or_else(|| panic!("no end: {tag:.80}"));
        assert!(!text.contains('>'), "stray bracket in {text:.80}");
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name), "closed out of turn");
            continue;
        }
        assert_eq!(tag.matches('"').count() % 2, 0, "open quote in {tag:.80}");
        let mut names = tag.split('"').step_by(2);
        let name = names.next().and_then(|head| head.split_whitespace().next()).unwrap();
        assert!(tag.split('"').step_by(2).all(|between| between.matches('=').count() <= 1), "{tag:.80}");
        if !tag.ends_with('/') {
            open.push(name);
        }
    }
    assert!(open.is_empty(), "left open: {open:?}");
}
