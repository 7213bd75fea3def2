//! What a tool presses as a sum of waves, in which blur, elements and splines are factors.

#![expect(clippy::inline_always, reason = "sums are inlined into the function that has the instructions")]

use std::f64::consts::TAU;

use pulp::{Arch, NullaryFnOnce};

use crate::contact::{Cut, Pressed, Slice};
use crate::quadrature::whole;

/// Waves whose share in the image is less than `exp(-REACH^2 / 2)`, or 1e-8, are left out.
const REACH: f64 = 6.1;

/// Points along edges are so many times as far apart as for single images. Sums over them still agree with the integrals to about 1e-9.
const APART: f64 = 2.0;

/// Evenly spaced nodes over a square of the tool's frame, its middle at the tool's axis.
#[derive(Debug, Clone, Copy)]
pub(super) struct Grid {
    /// Distance of neighbouring nodes.
    pub(super) step_mm: f64,
    /// Nodes along each axis from the middle to the border, the middle not counted.
    pub(super) steps: usize,
}

impl Grid {
    /// Nodes along each axis.
    pub(super) fn nodes(self) -> usize {
        2 * self.steps + 1
    }
}

/// The waves that a blur leaves over a grid: `exp(i (k_m x + k_n y))` with `k_m = m k_1`, for `m` from 0 to `count` and, for each, `n` from
/// `-count` to `count`. Those with a negative `m` are conjugates of others, because what they make is real.
#[derive(Debug)]
pub(super) struct Basis {
    nodes: usize,
    count: usize,
    /// `k_1`, in radians per mm. The waves repeat over a length in which what is pressed and its blur have room.
    first_per_mm: f64,
    /// Points along edges are chosen for this blur.
    apart_mm: f64,
    /// What the blur leaves of each wave, over the area on which the waves repeat.
    blurred: Vec<f64>,
    /// For each rotation of the elements what they get of each wave, so that the sum has the coefficients of a cubic B-spline.
    integrated: Vec<Vec<f64>>,
    /// For each `m` its cosine and sine at the nodes from the middle on.
    at_nodes: Vec<[Vec<f64>; 2]>,
}

/// Coefficients of the waves: real and imaginary parts.
#[derive(Debug, Clone)]
pub(super) struct Waves([Vec<f64>; 2]);

/// A complex number.
type Complex = [f64; 2];

impl Basis {
    /// `turns_rad`: rotations of the elements.
    pub(super) fn new(grid: Grid, sigma_mm: f64, element_mm: [f64; 2], turns_rad: &[f64]) -> Self {
        let nodes = grid.nodes();
        let period_mm = grid.step_mm * nodes as f64;
        let first_per_mm = TAU / period_mm;
        let count = whole(REACH / (sigma_mm * first_per_mm));
        let of_each = |rule: &dyn Fn([f64; 2]) -> f64| -> Vec<f64> {
            let across = 2 * count + 1;
            let wave = |place: usize| {
                let [m, n] = [(place / across) as f64, (place % across) as f64 - count as f64];
                rule([m * first_per_mm, n * first_per_mm])
            };
            (0..(count + 1) * across).map(wave).collect()
        };
        // `(c[i - 1] + 4 c[i] + c[i + 1]) / 6 = value[i]`.
        let spline = |k: f64| 6.0 / (4.0 + 2.0 * (k * grid.step_mm).cos());
        let [width_mm, height_mm] = element_mm;
        let integrated = |turn_rad: &f64| {
            let (sin, cos) = turn_rad.sin_cos();
            of_each(&|[kx, ky]| {
                let [along, aside] = [kx * cos - ky * sin, kx * sin + ky * cos];
                let of_width = width_mm * sinc(along * width_mm / 2.0);
                of_width * height_mm * sinc(aside * height_mm / 2.0) * spline(kx) * spline(ky)
            })
        };
        let at_nodes = |m: usize| {
            let angle = move |node: usize| TAU * ((m * node) % nodes) as f64 / nodes as f64;
            [f64::cos, f64::sin].map(|of| (0..=grid.steps).map(|node| of(angle(node))).collect())
        };
        let blurred = |[kx, ky]: [f64; 2]| {
            (-0.5 * sigma_mm * sigma_mm * (kx * kx + ky * ky)).exp() / (period_mm * period_mm)
        };
        Self {
            nodes,
            count,
            first_per_mm,
            apart_mm: APART * sigma_mm,
            blurred: of_each(&blurred),
            integrated: turns_rad.iter().map(integrated).collect(),
            at_nodes: (0..=count).map(at_nodes).collect(),
        }
    }

    /// The penetration map of what is pressed, or the area that is touched, under the blur.
    pub(super) fn waves(&self, pressed: &Pressed, cut: Cut) -> Waves {
        let mut parts = [0, 1].map(|_| vec![0.0; self.blurred.len()]);
        let mut products = Products::new(self.count, self.first_per_mm);
        match pressed {
            Pressed::Outline(edges) => {
                for node in edges.iter().flat_map(|edge| edge.nodes(cut, self.apart_mm)) {
                    products.up_to(node.x_mm, node.once, node.twice);
                    products.point(node.y_mm);
                    products.add_to(&mut parts);
                }
            }
            Pressed::Slices(slices) => {
                for Slice { x_mm, y_mm, weight_mm2, .. } in slices {
                    products.at(*x_mm, *weight_mm2);
                    products.line(*y_mm);
                    products.add_to(&mut parts);
                }
            }
        }
        for part in &mut parts {
            part.iter_mut().zip(&self.blurred).for_each(|(part, share)| *part *= share);
        }
        Waves(parts)
    }

    /// What elements get that are turned by each of the rotations, as the coefficients of a cubic B-spline through the grid's nodes; row-major.
    pub(super) fn tables(&self, Waves([re, im]): &Waves) -> Vec<Vec<f64>> {
        let of_turn = |shares: &Vec<f64>| {
            let part = |part: &[f64]| part.iter().zip(shares).map(|(part, share)| part * share).collect();
            let mut values = vec![0.0; self.nodes * self.nodes];
            Arch::new().dispatch(AtNodes { basis: self, parts: [part(re), part(im)], values: &mut values });
            values
        };
        self.integrated.iter().map(of_turn).collect()
    }
}

impl Waves {
    /// A sum of fields, each with its weight.
    pub(super) fn sum<const N: usize>(fields: [(&Self, f64); N]) -> Self {
        Self(std::array::from_fn(|part| {
            let mut sum = vec![0.0; fields.first().map_or(0, |(Self(parts), _)| parts[part].len())];
            for (Self(parts), weight) in fields {
                sum.iter_mut().zip(&parts[part]).for_each(|(sum, value)| *sum += weight * value);
            }
            sum
        }))
    }

    /// What the field reaches nowhere.
    pub(super) fn bound(&self) -> f64 {
        let Self([re, im]) = self;
        2.0 * re.iter().zip(im).map(|(re, im)| (re * re + im * im).sqrt()).sum::<f64>()
    }
}

/// Integrals of the waves' conjugates along x and along y, whose products are added up.
struct Products {
    first_per_mm: f64,
    of_x: Vec<Complex>,
    re_y: Vec<f64>,
    im_y: Vec<f64>,
}

impl Products {
    fn new(count: usize, first_per_mm: f64) -> Self {
        let across = 2 * count + 1;
        Self {
            first_per_mm,
            of_x: vec![[0.0; 2]; count + 1],
            re_y: vec![0.0; across],
            im_y: vec![0.0; across],
        }
    }

    /// Of a place along x, with a weight.
    fn at(&mut self, x_mm: f64, weight: f64) {
        for (of_x, wave) in self.of_x.iter_mut().zip(powers(x_mm * self.first_per_mm)) {
            *of_x = wave.map(|part| weight * part);
        }
    }

    /// Up to a place along x: `once` the integral, and `twice` the integral of that.
    fn up_to(&mut self, x_mm: f64, once: f64, twice: f64) {
        for ((m, of_x), wave) in self.of_x.iter_mut().enumerate().zip(powers(x_mm * self.first_per_mm)) {
            *of_x = if m == 0 {
                [once * x_mm + twice * x_mm * x_mm / 2.0, 0.0]
            } else {
                // The integral of exp(-i k x) is exp(-i k x) i / k.
                let per_k = 1.0 / (m as f64 * self.first_per_mm);
                times(wave, [-twice * per_k * per_k, once * per_k])
            };
        }
    }

    /// Of a place along y.
    fn point(&mut self, y_mm: f64) {
        let middle = self.re_y.len() / 2;
        for (n, [re, im]) in (0..=middle).zip(powers(y_mm * self.first_per_mm)) {
            (self.re_y[middle + n], self.im_y[middle + n]) = (re, im);
            (self.re_y[middle - n], self.im_y[middle - n]) = (re, -im);
        }
    }

    /// Of a line along y.
    fn line(&mut self, [from_mm, to_mm]: [f64; 2]) {
        self.point(f64::midpoint(from_mm, to_mm));
        let (half_mm, middle) = ((to_mm - from_mm) / 2.0, self.re_y.len() / 2);
        for (n, (re, im)) in self.re_y.iter_mut().zip(&mut self.im_y).enumerate() {
            let k = n.abs_diff(middle) as f64 * self.first_per_mm;
            let length_mm = 2.0 * half_mm * sinc(k * half_mm);
            (*re, *im) = (*re * length_mm, *im * length_mm);
        }
    }

    fn add_to(&self, parts: &mut [Vec<f64>; 2]) {
        Arch::new().dispatch(Add { products: self, parts });
    }
}

/// `exp(-i m angle)` for `m` from 0 on.
fn powers(angle: f64) -> impl Iterator<Item = Complex> {
    let (sin, cos) = angle.sin_cos();
    std::iter::successors(Some([1.0, 0.0]), move |power| Some(times(*power, [cos, -sin])))
}

/// Adds products to waves.
struct Add<'a> {
    products: &'a Products,
    parts: &'a mut [Vec<f64>; 2],
}

impl NullaryFnOnce for Add<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Products { of_x, re_y, im_y, .. } = self.products;
        let [re, im] = self.parts;
        let rows = re.chunks_exact_mut(re_y.len()).zip(im.chunks_exact_mut(im_y.len()));
        for ([re_x, im_x], (re, im)) in of_x.iter().zip(rows) {
            for (((re, im), re_y), im_y) in re.iter_mut().zip(im).zip(re_y).zip(im_y) {
                *re += re_x * re_y - im_x * im_y;
                *im += re_x * im_y + im_x * re_y;
            }
        }
    }
}

/// Adds up waves at the nodes.
struct AtNodes<'a> {
    basis: &'a Basis,
    parts: [Vec<f64>; 2],
    /// Row-major.
    values: &'a mut [f64],
}

impl NullaryFnOnce for AtNodes<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { basis: Basis { nodes, count, at_nodes: waves, .. }, parts: [re, im], values } = self;
        let (nodes, count, across) = (*nodes, *count, 2 * count + 1);
        let half = nodes.div_ceil(2);
        // Along y: for each wave along x, even and odd parts about the middle.
        let of_rows = |m: usize| {
            let (re, im) = (&re[m * across..][..across], &im[m * across..][..across]);
            let share = if m == 0 { 1.0 } else { 2.0 };
            let mut even = [vec![share * re[count]; half], vec![share * im[count]; half]];
            let mut odd = [vec![0.0; half], vec![0.0; half]];
            for (n, [cos, sin]) in waves.iter().enumerate().skip(1) {
                let [there, back] = [count + n, count - n];
                let sums = [re[there] + re[back], im[there] + im[back]].map(|part| share * part);
                let differences = [im[back] - im[there], re[there] - re[back]].map(|part| share * part);
                for part in [0, 1] {
                    for ((even, odd), (cos, sin)) in
                        even[part].iter_mut().zip(&mut odd[part]).zip(cos.iter().zip(sin))
                    {
                        *even += sums[part] * cos;
                        *odd += differences[part] * sin;
                    }
                }
            }
            [even, odd]
        };
        let by_wave: Vec<_> = (0..=count).map(of_rows).collect();
        let (mut even, mut odd) = (vec![0.0; half], vec![0.0; half]);
        for (row, values) in values.chunks_exact_mut(nodes).enumerate() {
            let (aside, sign) = (row.abs_diff(half - 1), if row < half - 1 { -1.0 } else { 1.0 });
            even.fill(0.0);
            odd.fill(0.0);
            for ([[re_even, im_even], [re_odd, im_odd]], [cos, sin]) in
                by_wave.iter().map(|[even, odd]| [[&even[0], &even[1]], [&odd[0], &odd[1]]]).zip(waves)
            {
                let re = re_even[aside] + sign * re_odd[aside];
                let im = im_even[aside] + sign * im_odd[aside];
                for ((even, odd), (cos, sin)) in even.iter_mut().zip(&mut odd).zip(cos.iter().zip(sin)) {
                    *even += re * cos;
                    *odd -= im * sin;
                }
            }
            let (before, after) = values.split_at_mut(half - 1);
            for ((value, even), odd) in after.iter_mut().zip(&even).zip(&odd) {
                *value = even + odd;
            }
            for ((value, even), odd) in before.iter_mut().rev().zip(&even[1..]).zip(&odd[1..]) {
                *value = even - odd;
            }
        }
    }
}

fn times([a, b]: Complex, [c, d]: Complex) -> Complex {
    [a * c - b * d, a * d + b * c]
}

/// `sin x / x`.
fn sinc(x: f64) -> f64 {
    if x.abs() < 1e-4 { 1.0 - x * x / 6.0 } else { x.sin() / x }
}

#[cfg(test)]
#[path = "waves_tests.rs"]
mod tests;
