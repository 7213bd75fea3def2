//! The plain method: a brick's stiffness by quadrature, and the slab's equations assembled and eliminated.

/// Places of the corners; the first four are the upper ones, as z points down.
pub(super) const CORNERS: [[usize; 3]; 8] =
    [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1], [1, 1, 1]];

/// Where the change of volume is taken.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Volume {
    /// Its mean over the brick.
    Mean,
    /// At each point of the quadrature.
    Full,
}

/// Stiffness of a brick of 1 x 1 x height, in shear moduli: `[3 * corner + axis]` both ways.
pub(super) struct Element(pub(super) Vec<Vec<f64>>);

impl Element {
    pub(super) fn new(height: f64, poisson_ratio: f64, volume: Volume) -> Self {
        let bulk = 2.0 * (1.0 + poisson_ratio) / (3.0 * (1.0 - 2.0 * poisson_ratio));
        let gauss = [0.5 - 1.0 / 12.0_f64.sqrt(), 0.5 + 1.0 / 12.0_f64.sqrt()];
        let slopes = CORNERS.map(|corner| slopes(corner.map(|end| gauss[end]), height));
        let mut stiffness = vec![vec![0.0; 24]; 24];
        for slopes_here in &slopes {
            let strains: Vec<[[f64; 3]; 3]> = (0..24).map(|unknown| strain(slopes_here, unknown)).collect();
            let swell = |unknown: usize| match volume {
                Volume::Full => trace(&strains[unknown]),
                Volume::Mean => {
                    slopes.iter().map(|slopes| slopes[unknown / 3][unknown % 3]).sum::<f64>() / 8.0
                }
            };
            for (row, stiffness) in stiffness.iter_mut().enumerate() {
                for (col, sum) in stiffness.iter_mut().enumerate() {
                    let (a, b) = (&strains[row], &strains[col]);
                    let product: f64 = a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| a * b).sum();
                    let shear = 2.0 * (product - trace(a) * trace(b) / 3.0);
                    *sum += (shear + bulk * swell(row) * swell(col)) * height / 8.0;
                }
            }
        }
        Self(stiffness)
    }

    /// Of an endless layer of such bricks against a wave, `u` and `v` a quarter of a wave behind.
    pub(super) fn layer(&self, wave: [f64; 2]) -> [[f64; 6]; 6] {
        let phase = |unknown: usize| {
            let ([x, y, _], axis) = (CORNERS[unknown / 3], unknown % 3);
            wave[0] * x as f64 + wave[1] * y as f64 - if axis < 2 { std::f64::consts::FRAC_PI_2 } else { 0.0 }
        };
        let place = |unknown: usize| 3 * CORNERS[unknown / 3][2] + unknown % 3;
        let (mut real, mut imaginary) = ([[0.0; 6]; 6], [[0.0; 6]; 6]);
        for (row, stiffness) in self.0.iter().enumerate() {
            for (col, stiffness) in stiffness.iter().enumerate() {
                let turn: f64 = phase(col) - phase(row);
                real[place(row)][place(col)] += stiffness * turn.cos();
                imaginary[place(row)][place(col)] += stiffness * turn.sin();
            }
        }
        assert!(imaginary.iter().flatten().all(|rest| rest.abs() < 1e-12 * real[2][2].abs().max(1.0)));
        real
    }
}

/// Slopes of the corners' trilinear shape functions at a point of the unit cube.
fn slopes(point: [f64; 3], height: f64) -> [[f64; 3]; 8] {
    CORNERS.map(|corner| {
        let share = |axis: usize| if corner[axis] == 1 { point[axis] } else { 1.0 - point[axis] };
        let slope = |axis: usize| if corner[axis] == 1 { 1.0 } else { -1.0 };
        [
            slope(0) * share(1) * share(2),
            share(0) * slope(1) * share(2),
            share(0) * share(1) * slope(2) / height,
        ]
    })
}

/// The strain of a unit displacement.
fn strain(slopes: &[[f64; 3]; 8], unknown: usize) -> [[f64; 3]; 3] {
    let (corner, axis) = (unknown / 3, unknown % 3);
    let mut strain = [[0.0; 3]; 3];
    for other in 0..3 {
        strain[axis][other] += slopes[corner][other] / 2.0;
        strain[other][axis] += slopes[corner][other] / 2.0;
    }
    strain
}

fn trace(strain: &[[f64; 3]; 3]) -> f64 {
    strain[0][0] + strain[1][1] + strain[2][2]
}

/// Vertical reactions of the bottom of a slab on rollers under 1 N at the middle of its top, row-major.
pub(super) fn reactions(element: &Element, across: usize, layers: usize) -> Vec<f64> {
    let side = across + 1;
    let node = |[x, y, z]: [usize; 3]| (y * side + x) * (layers + 1) + z;
    let nodes = side * side * (layers + 1);
    let mut stiffness = vec![vec![0.0; 3 * nodes]; 3 * nodes];
    let mut held = vec![false; 3 * nodes];
    for (x, y, z) in places(across, across, layers) {
        let unknown = |local: usize| {
            let [dx, dy, dz] = CORNERS[local / 3];
            3 * node([x + dx, y + dy, z + dz]) + local % 3
        };
        for (row, values) in element.0.iter().enumerate() {
            for (col, value) in values.iter().enumerate() {
                stiffness[unknown(row)][unknown(col)] += value;
            }
        }
    }
    for (x, y, z) in places(side, side, layers + 1) {
        let at = 3 * node([x, y, z]);
        let bottom = z == layers;
        held[at] = bottom || x == 0 || x == across;
        held[at + 1] = bottom || y == 0 || y == across;
        held[at + 2] = bottom;
    }
    let mut load = vec![0.0; 3 * nodes];
    load[3 * node([across / 2, across / 2, 0]) + 2] = 1.0;
    let moved = solved(&stiffness, &load, &held);
    let reaction = |(x, y, _): (usize, usize, usize)| {
        let row = &stiffness[3 * node([x, y, layers]) + 2];
        -row.iter().zip(&moved).map(|(stiffness, moved)| stiffness * moved).sum::<f64>()
    };
    let mut bottom: Vec<_> = places(side, side, 1).collect();
    bottom.sort_by_key(|(x, y, _)| (*y, *x));
    bottom.into_iter().map(reaction).collect()
}

fn places(x: usize, y: usize, z: usize) -> impl Iterator<Item = (usize, usize, usize)> {
    (0..x).flat_map(move |x| (0..y).flat_map(move |y| (0..z).map(move |z| (x, y, z))))
}

/// Displacements by Gauss elimination; 0 where held.
fn solved(stiffness: &[Vec<f64>], load: &[f64], held: &[bool]) -> Vec<f64> {
    let free: Vec<usize> = (0..held.len()).filter(|unknown| !held[*unknown]).collect();
    let mut rows: Vec<Vec<f64>> = free
        .iter()
        .map(|row| free.iter().map(|col| stiffness[*row][*col]).chain([load[*row]]).collect())
        .collect();
    for pivot in 0..rows.len() {
        let (above, below) = rows.split_at_mut(pivot + 1);
        let above = &above[pivot];
        for row in below {
            let share = row[pivot] / above[pivot];
            if share != 0.0 {
                row[pivot..].iter_mut().zip(&above[pivot..]).for_each(|(sum, above)| *sum -= share * above);
            }
        }
    }
    let mut moved = vec![0.0; held.len()];
    for (row, unknown) in rows.iter().zip(&free).rev() {
        let rest: f64 = row.iter().zip(&free).map(|(stiffness, other)| stiffness * moved[*other]).sum();
        let pivot = row[free.iter().position(|other| other == unknown).unwrap()];
        moved[*unknown] = (row[free.len()] - rest) / pivot;
    }
    moved
}
