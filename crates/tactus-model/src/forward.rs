//! The base model: from a contact to the counts of every element.

use crate::blur::Blur;
use crate::contact::{Cut, Edge, Node, Pressed, Slice};
use crate::effect::Load;
use crate::{Array, Contact, Covering, Indenter, Psf};

/// Response of the elements to their signal `u_e`.
#[derive(Debug, Clone, PartialEq)]
pub struct Response {
    /// Counts per mm of equivalent indentation at small depths, one per element, row-major; either sign.
    pub sensitivity_counts_per_mm: Vec<f64>,
    /// Reading at rest, one per element, row-major.
    pub baseline_counts: Vec<f64>,
    /// `k` of `R(u) = u + k u^2`, in 1/mm, one per element, row-major: 0 for a linear response (Sec. 2.2).
    pub quadratic_per_mm: Vec<f64>,
    /// The tool for which sensitivity is stated.
    pub reference_indenter: Indenter,
    /// The covering for which sensitivity is stated.
    pub reference_covering: Covering,
}

/// Why parameters do not make a model.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum ModelError {
    /// A list does not have one value per element.
    #[error("{field} has {values} values for {elements} elements")]
    Length { field: &'static str, values: usize, elements: usize },
    /// A parameter is out of its range.
    #[error("{field} must be {range}, not {value}")]
    Range { field: &'static str, range: &'static str, value: f64 },
}

/// With a wider spread an element's share is lost in rounding.
const SIGMA_MAX_ELEMENTS: f64 = 10_000.0;

/// The static base model of an array (science of the paper's Sec. 2 and Eq. 4).
///
/// ```text
/// d_e      = integral over element e's square of (I * G_sigma)      mm^3; I in [0, t] the penetration map
/// u_e      = d_e / d_ref                                            mm, the equivalent indentation
/// counts_e = baseline_e + sensitivity_e * (u_e + k_e u_e^2)
/// ```
///
/// `d_ref` is what one mm of the reference indenter at an element's own centre gives under the reference
/// covering. So `u_e` is the depth in mm at which the reference press would have given the same signal,
/// and a reference press to depth `d` reads `sensitivity * (d + k d^2)` above the baseline, whatever the
/// element's size or the spread. (For a tool such as a sphere, whose signal is not proportional to depth,
/// this holds at a depth of 1 mm.)
///
/// The tool cannot go deeper than the covering: there `I` is the thickness `t`.
///
/// Accuracy: integrals agree with direct quadrature to 1e-9 and better; see the tests.
#[derive(Debug, Clone)]
pub struct ForwardModel {
    array: Array,
    psf: Psf,
    response: Response,
    pub(crate) reference_mm2: f64,
}

impl ForwardModel {
    /// A model from its parameters.
    ///
    /// # Errors
    /// [`ModelError`] names the parameter that is out of range or has the wrong length.
    pub fn new(array: Array, psf: Psf, response: Response) -> Result<Self, ModelError> {
        response.check(array.elements())?;
        let sigma_mm = psf.sigma_mm(response.reference_covering);
        let [width_mm, height_mm] = array.element_mm();
        if !(sigma_mm > 0.0 && sigma_mm <= SIGMA_MAX_ELEMENTS * width_mm.min(height_mm)) {
            let range = "positive and at most 10,000 element sizes";
            return Err(ModelError::Range { field: "sigma", range, value: sigma_mm });
        }
        let reference_mm2 = response.reference_mm2(sigma_mm, array.element_mm());
        if !(reference_mm2.is_finite() && reference_mm2 > 0.0) {
            let range = "a tool that reaches the element";
            return Err(ModelError::Range { field: "reference_indenter", range, value: reference_mm2 });
        }
        Ok(Self { array, psf, response, reference_mm2 })
    }

    /// Geometry of the array, sensor frame.
    pub fn array(&self) -> &Array {
        &self.array
    }

    /// Spread as a function of covering thickness.
    pub fn psf(&self) -> Psf {
        self.psf
    }

    /// Response of the elements.
    pub fn response(&self) -> &Response {
        &self.response
    }

    /// Counts of every element under a contact, before noise, saturation and quantisation.
    ///
    /// `counts`: one per element, row-major, overwritten.
    ///
    /// # Panics
    /// If `counts` has not one place per element.
    pub fn image(&self, contact: &Contact, covering: Covering, counts: &mut [f64]) {
        self.indentation(contact, covering, counts);
        self.respond(counts);
    }

    /// Equivalent indentation `u_e` of every element under a contact, in mm.
    ///
    /// `indentation_mm`: one per element, row-major, overwritten.
    ///
    /// # Panics
    /// If `indentation_mm` has not one place per element.
    pub fn indentation(&self, contact: &Contact, covering: Covering, indentation_mm: &mut [f64]) {
        let (contact, sigma_mm) = (contact.clone(), [self.psf.sigma_mm(covering); 2]);
        self.indentation_of(
            &Load { weight: 1.0, contact, lean: [0.0; 2], sigma_mm },
            covering,
            indentation_mm,
        );
    }

    /// As [`ForwardModel::indentation`], for a load with its own lean and spread; both of its `sigma_mm` are positive. The
    /// caller applies its weight. The unit is the base model's reference press.
    ///
    /// # Panics
    /// If `indentation_mm` has not one place per element.
    pub fn indentation_of(&self, press: &Load, covering: Covering, indentation_mm: &mut [f64]) {
        self.indentation_again(press, covering, &mut Shares::default(), indentation_mm);
    }

    /// As [`ForwardModel::indentation_of`], to the bit. `shares` are those of the last press of this model: a flat tool that only
    /// goes deeper, or less deep, blurs as before.
    pub(crate) fn indentation_again(
        &self,
        press: &Load,
        covering: Covering,
        shares: &mut Shares,
        indentation_mm: &mut [f64],
    ) {
        assert_eq!(indentation_mm.len(), self.array.elements(), "one place per element");
        indentation_mm.fill(0.0);
        let Load { contact, lean, sigma_mm, .. } = press;
        let finest_mm = sigma_mm[0].min(sigma_mm[1]);
        let blurs = sigma_mm.map(|sigma_mm| Blur { sigma_mm });
        let pressed = contact.pressed(Cut::Penetration, *lean, finest_mm);
        self.press(&pressed, blurs, 1.0, shares, indentation_mm);
        // The tool cannot go deeper than the covering: min(I, t) = max(0, I) - max(0, I - t).
        if contact.depth_mm > covering.thickness_mm {
            let beyond = Contact { depth_mm: contact.depth_mm - covering.thickness_mm, ..contact.clone() };
            let pressed = beyond.pressed(Cut::Penetration, *lean, finest_mm);
            self.press(&pressed, blurs, -1.0, &mut Shares::default(), indentation_mm);
        }
    }

    /// Adds what is pressed, spread along x and y, times `sign`.
    fn press(
        &self,
        pressed: &Pressed,
        blurs: [Blur; 2],
        sign: f64,
        shares: &mut Shares,
        indentation_mm: &mut [f64],
    ) {
        let scale = sign / self.reference_mm2;
        match pressed {
            Pressed::Outline(edges) => self.press_edges(edges, blurs, scale, shares, indentation_mm),
            Pressed::Slices(slices) => self.press_slices(slices, blurs, scale, shares, indentation_mm),
        }
    }

    fn press_edges(
        &self,
        edges: &[Edge],
        blurs: [Blur; 2],
        scale: f64,
        shares: &mut Shares,
        indentation_mm: &mut [f64],
    ) {
        let [cols, rows] = self.array.sides_mm();
        let finest_mm = blurs[0].sigma_mm.min(blurs[1].sigma_mm);
        let nodes: Vec<Node> =
            edges.iter().flat_map(|edge| edge.nodes(Cut::Penetration, finest_mm)).collect();
        shares.keep_up_nodes(&nodes, blurs, [&cols, &rows]);
        let of_cols = shares.up_to_cols.chunks_exact(cols.len());
        let of_rows = shares.of_rows_mm.chunks_exact(rows.len());
        let mut of_node = vec![0.0; cols.len()];
        for ((Node { once, twice, .. }, of_cols), of_rows) in nodes.iter().zip(of_cols).zip(of_rows) {
            for (of_node, [once_mm, twice_mm2]) in of_node.iter_mut().zip(of_cols) {
                *of_node = scale * (once * once_mm + twice * twice_mm2);
            }
            for (row, of_row) in indentation_mm.chunks_exact_mut(cols.len()).zip(of_rows) {
                for (element, of_node) in row.iter_mut().zip(&of_node) {
                    *element += of_row * of_node;
                }
            }
        }
    }

    fn press_slices(
        &self,
        slices: &[Slice],
        blurs: [Blur; 2],
        scale: f64,
        shares: &mut Shares,
        indentation_mm: &mut [f64],
    ) {
        let [cols, rows] = self.array.sides_mm();
        shares.keep_up(slices, blurs, [&cols, &rows]);
        let lines_mm = shares.of_rows_mm.chunks_exact(rows.len());
        let mut strips = slices.iter().zip(lines_mm);
        let groups = slices.chunk_by(|one, other| is_same(one.x_mm, other.x_mm));
        for (of_one_x, of_cols) in groups.zip(shares.of_cols.chunks_exact(cols.len())) {
            let of_one_x: Vec<_> = strips.by_ref().take(of_one_x.len()).collect();
            for ((row, side_mm), index) in
                indentation_mm.chunks_exact_mut(cols.len()).zip(&rows).zip(0_usize..)
            {
                let of_slice = |(slice, lines_mm): &(&Slice, &[f64])| {
                    of_sloped(blurs[1], slice, *side_mm, lines_mm[index])
                };
                let of_row: f64 = of_one_x.iter().map(of_slice).sum();
                for (element, of_col) in row.iter_mut().zip(of_cols) {
                    *element += scale * of_col * of_row;
                }
            }
        }
    }

    /// Turns equivalent indentations in mm into counts, in place.
    ///
    /// # Panics
    /// If there is not one value per element.
    pub fn respond(&self, values: &mut [f64]) {
        assert_eq!(values.len(), self.array.elements(), "one value per element");
        for (element, value) in values.iter_mut().enumerate() {
            *value = self.response.counts(element, *value);
        }
    }

    /// `d_ref`: signal per mm of the reference indenter at an element's own centre, in mm^3 per mm.
    pub fn reference_mm2(&self) -> f64 {
        self.reference_mm2
    }
}

impl Response {
    /// Elements with the same linear response. The sensitivity is stated for the paper's press: a cylinder of 1 mm under a
    /// covering of 1.016 mm (0.04 inch).
    pub fn uniform(elements: usize, sensitivity_counts_per_mm: f64, baseline_counts: f64) -> Self {
        Self {
            sensitivity_counts_per_mm: vec![sensitivity_counts_per_mm; elements],
            baseline_counts: vec![baseline_counts; elements],
            quadratic_per_mm: vec![0.0; elements],
            reference_indenter: Indenter::Cylinder { diameter_mm: 1.0 },
            reference_covering: Covering { thickness_mm: 1.016 },
        }
    }

    /// Counts of an element under an equivalent indentation, before noise, saturation and quantisation.
    ///
    /// # Panics
    /// If there is no such element.
    pub fn counts(&self, element: usize, indentation_mm: f64) -> f64 {
        let (sensitivity, quadratic) =
            (self.sensitivity_counts_per_mm[element], self.quadratic_per_mm[element]);
        self.baseline_counts[element]
            + sensitivity * (indentation_mm + quadratic * indentation_mm * indentation_mm)
    }

    fn check(&self, elements: usize) -> Result<(), ModelError> {
        for (field, values) in [
            ("sensitivity_counts_per_mm", &self.sensitivity_counts_per_mm),
            ("baseline_counts", &self.baseline_counts),
            ("quadratic_per_mm", &self.quadratic_per_mm),
        ] {
            if values.len() != elements {
                return Err(ModelError::Length { field, values: values.len(), elements });
            }
            if let Some(&value) = values.iter().find(|value| !value.is_finite()) {
                return Err(ModelError::Range { field, range: "finite", value });
            }
        }
        Ok(())
    }

    /// The reference indenter, 1 mm deep at the frame's origin.
    pub(crate) fn reference_press(&self) -> Contact {
        let indenter = self.reference_indenter.clone();
        Contact { indenter, position_mm: [0.0, 0.0], rotation_deg: 0.0, depth_mm: 1.0 }
    }

    /// `d_ref`: what the reference press gives at an element's own centre, in mm^3 per mm of depth.
    fn reference_mm2(&self, sigma_mm: f64, element_mm: [f64; 2]) -> f64 {
        let [side_x, side_y] = element_mm.map(|side| [-side / 2.0, side / 2.0]);
        let blur = Blur { sigma_mm };
        let slices = self.reference_press().slices(sigma_mm).into_iter();
        slices.map(|s| s.weight_mm2 * blur.of_point(s.x_mm, side_x) * blur.of_line(s.y_mm, side_y)).sum()
    }
}

/// What the sides of an array get of slices, or of points of an outline, by their places alone, whatever their weights.
#[derive(Debug, Default)]
pub(crate) struct Shares {
    /// Spread along x and y.
    sigma_mm: [f64; 2],
    /// Of each slice: position along x, least and greatest y. Of each point: x and twice its y.
    places_mm: Vec<[f64; 3]>,
    /// For each x among the slices: the share of each column.
    of_cols: Vec<f64>,
    /// For each point: what is up to it of each column, as of [`Blur::up_to`].
    up_to_cols: Vec<[f64; 2]>,
    /// For each slice its length along each row, for each point its share.
    of_rows_mm: Vec<f64>,
}

impl Shares {
    /// Whether these places were the last ones, under the same spread. If not, from now on they are.
    fn knows(
        &mut self,
        places_mm: impl ExactSizeIterator<Item = [f64; 3]> + Clone,
        sigma_mm: [f64; 2],
    ) -> bool {
        let is_known = self.places_mm.len() == places_mm.len()
            && self.places_mm.iter().zip(places_mm.clone()).all(|(known, place)| are_same(*known, place))
            && are_same(self.sigma_mm, sigma_mm);
        if !is_known {
            self.sigma_mm = sigma_mm;
            self.places_mm.clear();
            self.places_mm.extend(places_mm);
        }
        is_known
    }

    /// As [`Shares::keep_up`], for points of an outline.
    fn keep_up_nodes(&mut self, nodes: &[Node], blurs: [Blur; 2], [cols, rows]: [&[[f64; 2]]; 2]) {
        let places_mm = nodes.iter().map(|node| [node.x_mm, node.y_mm, node.y_mm]);
        if self.knows(places_mm, blurs.map(|blur| blur.sigma_mm)) {
            return;
        }
        let [along_x, along_y] = blurs;
        let of_x = |node: &Node| {
            let x_mm = node.x_mm;
            cols.iter().map(move |side_mm| along_x.up_to(x_mm, *side_mm))
        };
        let of_y = |node: &Node| {
            let y_mm = node.y_mm;
            rows.iter().map(move |side_mm| along_y.of_point(y_mm, *side_mm))
        };
        self.up_to_cols.clear();
        self.up_to_cols.extend(nodes.iter().flat_map(of_x));
        self.of_rows_mm.clear();
        self.of_rows_mm.extend(nodes.iter().flat_map(of_y));
    }

    /// Computes them, unless they are of the same places under the same spread. The array is always the same.
    fn keep_up(&mut self, slices: &[Slice], blurs: [Blur; 2], [cols, rows]: [&[[f64; 2]]; 2]) {
        let places_mm = slices.iter().map(|Slice { x_mm, y_mm: [from, to], .. }| [*x_mm, *from, *to]);
        if self.knows(places_mm, blurs.map(|blur| blur.sigma_mm)) {
            return;
        }
        let [along_x, along_y] = blurs;
        let xs_mm =
            slices.chunk_by(|one, other| is_same(one.x_mm, other.x_mm)).map(|of_one_x| of_one_x[0].x_mm);
        let of_x = |x_mm: f64| cols.iter().map(move |side_mm| along_x.of_point(x_mm, *side_mm));
        let of_y = |y_mm: [f64; 2]| rows.iter().map(move |side_mm| along_y.of_line(y_mm, *side_mm));
        self.of_cols.clear();
        self.of_cols.extend(xs_mm.flat_map(of_x));
        self.of_rows_mm.clear();
        self.of_rows_mm.extend(slices.iter().flat_map(|slice| of_y(slice.y_mm)));
    }
}

fn are_same<const N: usize>(these: [f64; N], those: [f64; N]) -> bool {
    these.into_iter().zip(those).all(|(this, that)| is_same(this, that))
}

/// To the bit.
fn is_same(this: f64, that: f64) -> bool {
    this.total_cmp(&that).is_eq()
}

/// What a slice whose weight may grow along y gives to a side that gets `line_mm` of it, in mm^3 per mm of x.
fn of_sloped(along_y: Blur, slice: &Slice, side_mm: [f64; 2], line_mm: f64) -> f64 {
    let even = slice.weight_mm2 * line_mm;
    if slice.slope_mm == 0.0 {
        return even;
    }
    let middle_mm = f64::midpoint(slice.y_mm[0], slice.y_mm[1]);
    even + slice.slope_mm * (along_y.moment_of_line(slice.y_mm, side_mm) - middle_mm * line_mm)
}

#[cfg(test)]
#[path = "forward_tests.rs"]
mod tests;
