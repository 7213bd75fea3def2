use libm::exp;

use super::*;
use crate::layered::{BaseContact, Layer};

#[path = "fem/element_tests.rs"]
mod element;
use element::{Element, Volume, reactions};

fn cubes(across: u32, layers: u32, poisson_ratio: f64) -> Bricks {
    Bricks::cubes(across, layers, 1.0, poisson_ratio).unwrap()
}

fn bonded(poisson_ratio: f64) -> Layer {
    Layer::new(1.0, poisson_ratio, BaseContact::Bonded).unwrap()
}

#[test]
fn a_brick_resists_no_rigid_motion() {
    let height = 0.6;
    let element = Element::new(height, 0.49, Volume::Mean);
    let motions: [fn([f64; 3]) -> [f64; 3]; 6] = [
        |_| [1.0, 0.0, 0.0],
        |_| [0.0, 1.0, 0.0],
        |_| [0.0, 0.0, 1.0],
        |[_, y, z]| [0.0, -z, y],
        |[x, _, z]| [z, 0.0, -x],
        |[x, y, _]| [-y, x, 0.0],
    ];
    for motion in motions {
        let moved: Vec<f64> = element::CORNERS
            .iter()
            .flat_map(|[x, y, z]| motion([*x as f64, *y as f64, height * *z as f64]))
            .collect();
        for row in &element.0 {
            let force: f64 = row.iter().zip(&moved).map(|(stiffness, moved)| stiffness * moved).sum();
            assert!(force.abs() < 1e-12, "{force}");
        }
    }
}

#[test]
fn a_layers_stiffness_is_that_of_its_bricks() {
    for (height, poisson_ratio) in [(1.0, 0.3), (0.6, 0.49), (2.0, 0.0)] {
        let bricks = Bricks::new(8, 1, [1.5, 1.5 * height], poisson_ratio).unwrap();
        for (bricks, volume) in [(bricks, Volume::Mean), (bricks.integrated_in_full(), Volume::Full)] {
            let element = Element::new(height, poisson_ratio, volume);
            for wave in [[0.0, 0.0], [0.7, 0.0], [-0.4, 1.1], [2.0, -3.0], [PI, PI]] {
                let (found, summed) = (bricks.layer_stiffness(wave), element.layer(wave));
                for (found, summed) in found.iter().flatten().zip(summed.iter().flatten()) {
                    let close = (found - summed).abs() < 1e-13 * (1.0 + summed.abs());
                    assert!(close, "{wave:?}: {found} for {summed}");
                }
            }
        }
    }
}

#[test]
fn the_reactions_are_those_of_the_assembled_equations() {
    for (layers, height, poisson_ratio) in [(3, 1.0, 0.3), (2, 0.7, 0.49), (3, 1.0, 0.4999)] {
        let bricks = Bricks::new(8, layers, [1.0, height], poisson_ratio).unwrap();
        let assembled = reactions(&Element::new(height, poisson_ratio, Volume::Mean), 8, layers as usize);
        let found = bricks.under_point().forces();
        assert_eq!(found.len(), assembled.len());
        for (found, assembled) in found.iter().zip(&assembled) {
            assert!((found - assembled).abs() < 1e-11, "nu {poisson_ratio}: {found} for {assembled}");
        }
    }
}

#[test]
fn even_pressure_and_even_shear_pass_the_patch_test() {
    let layer = Bricks::new(8, 1, [1.0, 0.5], 0.45).unwrap().layer_stiffness([0.0, 0.0]);
    // In shear moduli: the modulus of compression between stiff sides is 2 (1 - nu)/(1 - 2 nu).
    for (axis, modulus) in [(0, 1.0), (1, 1.0), (2, 2.0 * 0.55 / 0.1)] {
        for (row, stiffness) in layer.iter().enumerate() {
            let force = match row {
                row if row == axis => modulus / 0.5,
                row if row == axis + 3 => -modulus / 0.5,
                _ => 0.0,
            };
            assert!((stiffness[axis] - force).abs() < 1e-13, "{axis} {row}: {} for {force}", stiffness[axis]);
        }
    }
}

#[test]
fn the_base_carries_the_load() {
    for poisson_ratio in [0.0, 0.3, 0.45, 0.499] {
        for layers in [1, 5, 10] {
            let bricks = cubes(100, layers, poisson_ratio);
            for reaction in [bricks.under_point(), bricks.under_disc(7.3).unwrap()] {
                let sum: f64 = reaction.forces().iter().sum();
                assert!((sum - 1.0).abs() < 1e-12, "nu {poisson_ratio}, {layers}: {sum}");
                let all = reaction.force_on([[-60.0, 60.0], [-60.0, 60.0]]);
                assert!((all - 1.0).abs() < 1e-12, "nu {poisson_ratio}, {layers}: {all}");
            }
        }
    }
}

#[test]
fn the_reactions_are_symmetric() {
    let forces = cubes(20, 5, 0.45).under_point().forces();
    for (node, force) in forces.iter().enumerate() {
        let (row, col) = (node / 21, node % 21);
        for (row, col) in [(20 - row, col), (row, 20 - col), (col, row)] {
            assert!((force - forces[21 * row + col]).abs() < 1e-15);
        }
    }
}

#[test]
fn the_centre_line_is_a_row_of_the_forces() {
    let reaction = Bricks::cubes(10, 3, 0.5, 0.3).unwrap().under_point();
    let (line, forces) = (reaction.centre_line(), reaction.forces());
    assert_eq!(line.iter().map(|[place_mm, _]| *place_mm).collect::<Vec<_>>()[..3], [-2.5, -2.0, -1.5]);
    assert_eq!(line.iter().map(|[_, force]| *force).collect::<Vec<_>>(), forces[55..66]);
    assert!((reaction.pressure_per_mm2([1, 0]) - line[6][1] / 0.25).abs() < 1e-15);
    assert!((reaction.pressure_per_mm2([5, 0]) - 2.0 * line[10][1] / 0.25).abs() < 1e-15, "half a brick");
    assert!(reaction.pressure_per_mm2([6, 0]).abs() < 1e-300, "beyond the slab");
}

/// Errors at `n` and `2 n` layers: the power of the brick's side with which they fall.
fn order(error: impl Fn(u32) -> f64, layers: u32) -> f64 {
    (error(layers) / error(2 * layers)).log2()
}

#[test]
fn a_wave_arrives_as_in_the_elastic_layer_to_second_order() {
    for poisson_ratio in [0.0, 0.3, 0.45, 0.499] {
        for waves in [1.0_f64, 2.0, 4.0] {
            for [x, y] in [[1.0, 0.0], [0.6, 0.8]] {
                let error = |layers: u32| {
                    let wave = [x, y].map(|part| part * waves / f64::from(layers));
                    (cubes(2, layers, poisson_ratio).transfer(wave) - bonded(poisson_ratio).transfer(waves))
                        .abs()
                };
                let order = order(error, 32);
                assert!((1.8..2.2).contains(&order), "nu {poisson_ratio}, K {waves}: {order}");
                assert!(error(64) < 2e-3, "nu {poisson_ratio}, K {waves}: {}", error(64));
            }
        }
    }
}

/// `p h^2 / P` of the elastic layer at seven distances, as in its own tests.
const QUARTERS: [u32; 7] = [0, 1, 2, 4, 6, 8, 12];
const SOLVED: [(f64, [f64; 7]); 3] = [
    (0.30, [0.69417, 0.58632, 0.36805, 0.08115, 0.00990, 0.00024, 0.00044]),
    (0.45, [0.72483, 0.60639, 0.36924, 0.06977, 0.00537, 0.00049, 0.00154]),
    (0.49, [0.74401, 0.62004, 0.37274, 0.06527, 0.00329, 0.00042, 0.00187]),
];

#[test]
fn the_pressure_tends_to_that_of_the_elastic_layer_with_the_square_of_the_side() {
    for (poisson_ratio, solved) in SOLVED {
        let error = |layers: u32| {
            let reaction = cubes(8 * layers, layers, poisson_ratio).under_point();
            let area = f64::from(layers * layers);
            let off = QUARTERS.into_iter().zip(solved).map(|(quarters, solved)| {
                area * reaction.pressure_per_mm2([quarters * layers / 4, 0]) - solved
            });
            off.map(f64::abs).fold(0.0, f64::max)
        };
        let order = order(error, 32);
        assert!((1.9..2.3).contains(&order), "nu {poisson_ratio}: {order}");
        assert!(error(64) < 1.1e-3 * solved[0], "nu {poisson_ratio}: {}", error(64));
    }
}

#[test]
fn the_stated_accuracy_of_the_papers_meshes_holds() {
    let stated = [
        (5, [(0.3, 0.105), (0.45, 0.100), (0.49, 0.151)]),
        (10, [(0.3, 0.034), (0.45, 0.040), (0.49, 0.091)]),
        (32, [(0.3, 0.0035), (0.45, 0.0038), (0.49, 0.0040)]),
    ];
    for (layers, stated) in stated {
        for (poisson_ratio, stated) in stated {
            let reaction = Bricks::cubes(10 * layers, layers, 1.0 / f64::from(layers), poisson_ratio)
                .unwrap()
                .under_point();
            let pressure = bonded(poisson_ratio).under_point();
            let off = (0..=3 * layers).map(|steps| {
                let solved = pressure.pressure_per_mm2(f64::from(steps) / f64::from(layers));
                (reaction.pressure_per_mm2([steps, 0]) - solved).abs()
            });
            let worst = off.fold(0.0, f64::max) / pressure.pressure_per_mm2(0.0);
            assert!((0.95 * stated..stated).contains(&worst), "{layers}, nu {poisson_ratio}: {worst}");
        }
    }
}

#[test]
fn nothing_locks_where_bricks_integrated_in_full_do() {
    for (poisson_ratio, locked) in [(0.49, 2e-3), (0.499, 2e-2), (0.4999, 1e-1)] {
        // A long wave, six thicknesses from crest to crest.
        let wave = [0.1, 0.0];
        let arrived = bonded(poisson_ratio).transfer(1.0);
        let full = cubes(2, 10, poisson_ratio).integrated_in_full().transfer(wave);
        let mean = cubes(2, 10, poisson_ratio).transfer(wave);
        assert!((mean - arrived).abs() < 4e-4, "nu {poisson_ratio}: {mean} for {arrived}");
        assert!((full - arrived).abs() > locked, "nu {poisson_ratio}: {full} for {arrived}");
    }
}

#[test]
fn plain_bricks_sharpen_the_response_of_a_nearly_incompressible_covering() {
    let [plain, mean, layer] = [
        cubes(100, 10, 0.49).integrated_in_full().under_point().pressure_per_mm2([0, 0]),
        cubes(100, 10, 0.49).under_point().pressure_per_mm2([0, 0]),
        bonded(0.49).under_point().pressure_per_mm2(0.0) / 100.0,
    ];
    assert!(
        (plain / layer - 1.54).abs() < 0.01 && (mean / layer - 0.91).abs() < 0.01,
        "{plain} {mean} {layer}"
    );
}

/// Forces in N from the middle along a row of the base of 20 x 20 x 5 cubes, Poisson's ratio 0.45, by the C3D8 of
/// `CalculiX` 2.20: what `bench/peers/fem.py --peers CalculiX --meshes 20x5` compares.
const CALCULIX: [f64; 8] = [
    3.199_946e-02,
    2.724_191e-02,
    1.995_396e-02,
    1.247_326e-02,
    6.814_864e-03,
    3.355_189e-03,
    1.534_524e-03,
    6.842_094e-04,
];

#[test]
fn the_reactions_are_those_of_calculix() {
    let line = cubes(20, 5, 0.45).integrated_in_full().under_point().centre_line();
    for (found, calculix) in line[10..].iter().zip(CALCULIX) {
        assert!((found[1] - calculix).abs() < 1e-8, "{found:?} for {calculix}");
    }
}

#[test]
fn a_discs_forces_are_those_of_an_even_pressure() {
    /// Of the node's shape function over rings of the disc.
    fn mean(radius: f64, node: [f64; 2]) -> f64 {
        const RINGS: u32 = 500;
        const TURNS: u32 = 1_500;
        let share = |ring: u32| (f64::from(ring) + 0.5) / f64::from(RINGS);
        let turn = |turn: u32| 2.0 * PI * (f64::from(turn) + 0.5) / f64::from(TURNS);
        let places = (0..RINGS).flat_map(|ring| (0..TURNS).map(move |t| (share(ring), turn(t))));
        let shape = |(share, turn): (f64, f64)| {
            let [x, y] = [radius * share * turn.cos() - node[0], radius * share * turn.sin() - node[1]];
            2.0 * share * (1.0 - x.abs()).max(0.0) * (1.0 - y.abs()).max(0.0)
        };
        places.map(shape).sum::<f64>() / f64::from(RINGS * TURNS)
    }
    for radius in [0.3, 1.0, 2.5, 4.921] {
        for node in [[0.0, 0.0], [1.0, 0.0], [2.0, 1.0], [3.0, 3.0], [5.0, 0.0]] {
            let (found, summed) = (force_of_disc(radius, node), mean(radius, node));
            assert!((found - summed).abs() < 1e-5, "{radius} {node:?}: {found} for {summed}");
        }
        let places = || (-6..=6).map(f64::from);
        let all: f64 = places().flat_map(|x| places().map(move |y| force_of_disc(radius, [x, y]))).sum();
        assert!((all - 1.0).abs() < 1e-12, "{radius}: {all}");
    }
}

#[test]
fn a_disc_may_reach_the_sides() {
    let forces = cubes(8, 3, 0.45).under_disc(8.0).unwrap().forces();
    assert!((forces.iter().sum::<f64>() - 1.0).abs() < 1e-12);
}

#[test]
fn a_small_disc_is_a_point() {
    let bricks = cubes(20, 4, 0.45);
    let [point, disc] =
        [bricks.under_point(), bricks.under_disc(1e-4).unwrap()].map(|reaction| reaction.forces());
    assert!(point.iter().zip(&disc).all(|(point, disc)| (point - disc).abs() < 1e-4));
    assert_eq!(bricks.under_disc(0.0).unwrap().forces(), point);
}

#[test]
fn elements_measure_what_they_measure_under_the_elastic_layer() {
    // The paper's cylinder on its thinnest covering; the element below, its neighbour, and one askew.
    let layer = Layer::new(1.016, 0.45, BaseContact::Bonded).unwrap().under_disc(1.0);
    let elements = [[[-0.9, 0.9], [-0.9, 0.9]], [[1.1, 2.9], [-0.9, 0.9]], [[-0.3, 1.5], [0.2, 2.0]]];
    for (layers, within) in [(5, 9e-3), (10, 4e-3), (40, 2e-4)] {
        let bricks = Bricks::cubes(10 * layers, layers, 1.016 / f64::from(layers), 0.45).unwrap();
        let reaction = bricks.under_disc(1.0).unwrap();
        for element in elements {
            let off = (reaction.force_on(element) - layer.force_on(element)).abs();
            assert!(off < within, "{layers} {element:?}: {off}");
        }
    }
}

#[test]
fn the_best_gaussian_tends_to_that_of_the_elastic_layer() {
    for poisson_ratio in [0.3, 0.45, 0.49] {
        let sigma = bonded(poisson_ratio).gaussian_sigma_mm();
        let bricks = Bricks::cubes(320, 32, 1.0 / 32.0, poisson_ratio).unwrap();
        assert!((bricks.under_point().gaussian_sigma_mm() - sigma).abs() < 1e-3, "nu {poisson_ratio}");
    }
    // Five layers: the brick's own width widens it.
    assert!((cubes(100, 5, 0.45).under_point().gaussian_sigma_mm() - 2.41).abs() < 0.01);
}

#[test]
fn the_best_gaussian_of_a_gaussian_is_itself() {
    let forces = Even::new(51, |x, y| exp(-((x * x + y * y) as f64) / (2.0 * 3.4 * 3.4)));
    let bricks = Bricks::cubes(100, 5, 2.0, 0.3).unwrap();
    assert!((Reaction { bricks, forces }.gaussian_sigma_mm() - 6.8).abs() < 1e-5);
}

#[test]
fn numbers_out_of_range_are_named() {
    for across in [0, 1, 7, BRICKS_MAX + 2] {
        assert_eq!(Bricks::cubes(across, 5, 1.0, 0.3), Err(BricksError::Across(across)));
    }
    assert_eq!(Bricks::cubes(8, 0, 1.0, 0.3), Err(BricksError::Layers(0)));
    assert_eq!(Bricks::new(8, 5, [1.0, 0.0], 0.3), Err(BricksError::Side(0.0)));
    assert!(matches!(Bricks::cubes(8, 5, f64::NAN, 0.3), Err(BricksError::Side(_))));
    assert_eq!(Bricks::cubes(8, 5, 1.0, 0.5), Err(BricksError::PoissonRatio(0.5)));
    for diameter_mm in [-1.0, 8.5, f64::INFINITY] {
        assert_eq!(
            cubes(8, 5, 0.3).under_disc(diameter_mm),
            Err(BricksError::Disc { diameter_mm, width_mm: 8.0 })
        );
    }
}
