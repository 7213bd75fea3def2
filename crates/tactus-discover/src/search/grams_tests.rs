use std::ops::Range;

use nalgebra::DVector;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use tactus_model::Effect;
use tactus_model::effect::Definition;

use super::{Score, standardised};
use crate::fit::{Direction, FOLDS, Few, Fitted, Free, Hat, Prepared, Problem, Sparse, Term};
use crate::fixtures::{ELEMENTS, OPTIONS, known, measured, processes};

/// The same products from whole columns, orthogonal to gains, baselines and the model's own parameters one by one.
#[test]
fn products_are_those_of_whole_columns_that_are_projected_one_by_one() {
    let known = known();
    let hidden =
        Effect::new("hardening", [("growth_at_1_mm", 0.5), ("exponent", 2.0), ("own_share", 0.0)]).unwrap();
    let noise = processes(ELEMENTS, 1.0, 1e-3, &mut ChaCha8Rng::seed_from_u64(3));
    let frames = measured(&known, &[hidden], &noise);
    let prepared = Prepared::new(&known, &frames, OPTIONS.seed).unwrap();
    let problem = prepared.problem();
    let term = Term::of(&Effect::new("surface-offset", [("offset_mm", 0.01)]).unwrap());
    let at = problem.fit_from(prepared.base.parameters.with(term), 3).unwrap();
    let tried: Vec<_> = ["hardening", "crosstalk", "imprint"]
        .into_iter()
        .map(|name| {
            let term = Term::neutral(Definition::find(name).unwrap());
            let start = at.parameters.with(term);
            let term = start.terms.len() - 1;
            (start, Free::Of { term, parameter: 0 })
        })
        .collect();
    let mut columns: Vec<Vec<f64>> =
        tried.iter().map(|(start, free)| problem.slope(start, &at.predicted, *free).unwrap()).collect();
    // Of single elements: two of one, and one of another.
    let of_one: Vec<(usize, Vec<f64>)> = [(0, 5), (2, 5), (0, 7)]
        .into_iter()
        .map(|(column, element): (usize, usize)| {
            (element, columns[column].iter().skip(element).step_by(ELEMENTS).copied().collect())
        })
        .collect();
    for (element, values) in &of_one {
        let mut column = vec![0.0; columns[0].len()];
        column.iter_mut().skip(*element).step_by(ELEMENTS).zip(values).for_each(|(to, value)| *to = *value);
        columns.push(column);
    }
    let directions = || {
        let of_one = of_one.iter().map(|(element, values)| {
            Direction::computed(Some(*element), |bins: Range<usize>| values[bins].to_vec())
        });
        tried.iter().map(|(start, free)| problem.towards(start, *free)).chain(of_one).collect::<Vec<_>>()
    };
    let grams = problem.grams(&at, directions()).unwrap();
    let of_each = problem.grams_of_each(&at, directions()).unwrap();

    let whole = Whole::of(&problem, &at, columns);
    let last = whole.columns.len();
    for (i, one) in whole.columns.iter().enumerate() {
        let near = |found: f64, wanted: f64, scale: f64| {
            assert!((found - wanted).abs() < 1e-5 * scale, "{i}: {found} {wanted} {scale}");
        };
        for (j, other) in whole.columns.iter().enumerate() {
            near(grams.reduced()[(i, j)], one.dot(other), one.norm() * other.norm());
        }
        near(grams.reduced()[(i, last)], one.dot(&whole.residual), one.norm() * 100.0);
        near(of_each.reduced()[(i, i)], one.norm_squared(), one.norm_squared());
        near(of_each.wanted(i), one.dot(&whole.residual), one.norm() * 100.0);
        let (of_grams, of_columns) = (Score::of_grams(&grams, &[i]).z, whole.score(&problem, one));
        assert!((of_grams - of_columns).abs() < 1e-2 * of_columns.max(1.0), "{i}: {of_grams} {of_columns}");
    }
    let left = problem.left(&at).unwrap();
    for ((left, weight), wanted) in left.iter().zip(problem.weights()).zip(whole.residual.iter()) {
        assert!((left * weight.sqrt() - wanted).abs() < 1e-4, "{left} {wanted}");
    }
}

/// Of a curve that all elements share, of one with a weight for each element, and of two columns that act everywhere.
#[test]
fn products_of_sparse_columns_are_those_of_whole_columns() {
    let known = known();
    let noise = processes(ELEMENTS, 1.0, 1e-3, &mut ChaCha8Rng::seed_from_u64(5));
    let frames = measured(&known, &[], &noise);
    let prepared = Prepared::new(&known, &frames, OPTIONS.seed).unwrap();
    let problem = prepared.problem();
    let term = Term::of(&Effect::new("surface-offset", [("offset_mm", 0.01)]).unwrap());
    let at = problem.fit_from(prepared.base.parameters.with(term), 3).unwrap();
    let bins = problem.predictor.bins;
    let (predicted, t_s) = (&at.predicted, &bins.t_s);
    let knots: Vec<f64> = (0..5).map(|knot| 0.2 * f64::from(knot) * t_s[bins.len() - 1]).collect();
    let acting = |group: usize, bin: usize, element: usize| -> Few {
        let counts = predicted[bin * ELEMENTS + element] - 100.0;
        let hats = (0..knots.len()).map(|knot| (knot, Hat::of(&knots, knot).at(t_s[bin])));
        match group {
            0 => Few::of(hats.filter(|(_, hat)| *hat > 0.0)).after(0, counts),
            1 => Few::of([(0, t_s[bin].sin())]).after(element, counts),
            _ => Few::of([(0, t_s[bin].sin()), (1, (3.0 * t_s[bin]).cos())]).after(0, 0.1),
        }
    };
    let groups = [
        0..knots.len(),
        knots.len()..knots.len() + ELEMENTS,
        knots.len() + ELEMENTS..knots.len() + ELEMENTS + 2,
    ];
    let sparse = || {
        let of_group = |(group, columns): (usize, &Range<usize>)| {
            Sparse::of(columns.len(), move |bins: Range<usize>| {
                bins.flat_map(|bin| (0..ELEMENTS).map(move |element| (bin, element)))
                    .map(|(bin, element)| acting(group, bin, element))
                    .collect()
            })
        };
        groups.iter().enumerate().map(of_group).collect::<Vec<_>>()
    };
    let mut columns = vec![vec![0.0; predicted.len()]; groups[2].end];
    for reading in 0..predicted.len() {
        for (group, first) in groups.iter().map(|columns| columns.start).enumerate() {
            for (column, value) in acting(group, reading / ELEMENTS, reading % ELEMENTS).each() {
                columns[first + column][reading] = value;
            }
        }
    }
    let grams = problem.grams(&at, sparse()).unwrap();
    let of_each = problem.grams_of_each(&at, sparse()).unwrap();
    let whole = Whole::of(&problem, &at, columns);
    let group_of = |column: usize| groups.iter().position(|columns| columns.contains(&column)).unwrap();
    let last = whole.columns.len();
    assert_eq!(grams.reduced().nrows(), last + 1);
    for (i, one) in whole.columns.iter().enumerate() {
        let near = |found: f64, wanted: f64, scale: f64| {
            assert!((found - wanted).abs() < 1e-5 * scale, "{i}: {found} {wanted} {scale}");
        };
        for (j, other) in whole.columns.iter().enumerate() {
            let groups = [group_of(i), group_of(j)];
            let is_kept = groups[0] == groups[1] || groups.contains(&0);
            let wanted = if is_kept { one.dot(other) } else { 0.0 };
            near(grams.reduced()[(i, j)], wanted, one.norm() * other.norm());
        }
        for grams in [&grams, &of_each] {
            near(grams.reduced()[(i, i)], one.norm_squared(), one.norm_squared());
            near(grams.wanted(i), one.dot(&whole.residual), one.norm() * 100.0);
            let (of_grams, of_columns) = (Score::of_grams(grams, &[i]).z, whole.score(&problem, one));
            assert!(
                (of_grams - of_columns).abs() < 1e-2 * of_columns.max(1.0),
                "{i}: {of_grams} {of_columns}"
            );
        }
    }
}

/// What is planted alike in all presses is gained on each fold as on all, apart from the noise; noise alone gains nothing.
#[test]
fn a_step_gains_on_presses_that_had_no_say_in_it() {
    let gained = |growth: f64, seed: u64| -> [f64; 2] {
        let known = known();
        let effect = [("growth_at_1_mm", growth), ("exponent", 2.0), ("own_share", 0.0)];
        let noise = processes(ELEMENTS, 1.0, 1e-3, &mut ChaCha8Rng::seed_from_u64(seed));
        let frames = measured(&known, &[Effect::new("hardening", effect).unwrap()], &noise);
        let prepared = Prepared::new(&known, &frames, OPTIONS.seed).unwrap();
        let (problem, base) = (prepared.problem(), &prepared.base);
        let definition = Definition::find("hardening").unwrap();
        let term = Term { values: vec![0.0, 2.0, 0.0], ..Term::neutral(definition) };
        let start = base.parameters.with(term);
        let free = Free::Of { term: start.terms.len() - 1, parameter: 0 };
        let grams = problem.grams(base, vec![problem.towards(&start, free)]).unwrap();
        let step = |fold| {
            let products = grams.without(fold);
            [(0, products[(0, 1)] / products[(0, 0)])]
        };
        let steps: Vec<[(usize, f64); 1]> = (0..FOLDS).map(step).collect();
        let of_all = grams.wanted(0).powi(2) / grams.size(0).powi(2);
        [grams.gains(|fold| &steps[fold]).iter().sum(), of_all]
    };
    let [unseen, of_all] = gained(0.01, 4);
    assert!(of_all > 100.0 && unseen < of_all && unseen > 0.9 * of_all, "{unseen} {of_all}");
    let of_noise = (0..12).map(|seed| gained(0.0, seed));
    let [unseen, of_all] = of_noise.fold([0.0; 2], |sums, of| [sums[0] + of[0], sums[1] + of[1]]);
    assert!(of_all > 3.0 && unseen < 0.0, "{unseen} {of_all}");
}

/// Columns and the residual, times the root of the weight, orthogonal to the columns of every baseline, gain and parameter of the model.
struct Whole {
    columns: Vec<DVector<f64>>,
    residual: DVector<f64>,
}

impl Whole {
    fn of(problem: &Problem<'_>, at: &Fitted, columns: Vec<Vec<f64>>) -> Self {
        let weigh = |column: Vec<f64>| -> DVector<f64> {
            let readings = column.len();
            DVector::from_iterator(
                readings,
                column.iter().zip(problem.weights()).map(|(value, weight)| value * weight.sqrt()),
            )
        };
        let mut more = at.parameters.clone();
        more.sensitivity.iter_mut().for_each(|gain| *gain *= 1.001);
        let more = problem.predict(&more).unwrap();
        let by_gain: Vec<f64> =
            more.iter().zip(&at.predicted).map(|(more, now)| (more - now) / 1e-3).collect();
        let elements = ELEMENTS;
        let of_element = |element: usize, value: &dyn Fn(usize) -> f64| -> DVector<f64> {
            let only = |place: usize| if place % elements == element { value(place) } else { 0.0 };
            weigh((0..by_gain.len()).map(only).collect())
        };
        let mut taken: Vec<DVector<f64>> = Vec::new();
        let baselines = (0..elements).map(|element| of_element(element, &|_| 1.0));
        let gains = (0..elements).map(|element| of_element(element, &|place| by_gain[place]));
        let own = problem.free(&at.parameters).into_iter();
        let own = own.map(|free| weigh(problem.slope(&at.parameters, &at.predicted, free).unwrap()));
        for mut column in baselines.chain(gains).chain(own) {
            orthogonal(&mut column, &taken);
            taken.push(column.normalize());
        }
        let project = |column: Vec<f64>| {
            let mut column = weigh(column);
            orthogonal(&mut column, &taken);
            column
        };
        let residual: Vec<f64> = problem.residuals(&at.predicted).collect();
        Self { columns: columns.into_iter().map(project).collect(), residual: project(residual) }
    }

    fn score(&self, problem: &Problem<'_>, column: &DVector<f64>) -> f64 {
        let bins = problem.predictor.bins;
        let (mut along, mut squares) = (vec![0.0; bins.blocks], vec![0.0; bins.blocks]);
        for (place, (value, residual)) in column.iter().zip(self.residual.iter()).enumerate() {
            let block = bins.block[place / ELEMENTS];
            along[block] += value * residual;
            squares[block] += value * value;
        }
        Score::of(vec![standardised(&along, &squares)]).z
    }
}

fn orthogonal(column: &mut DVector<f64>, to: &[DVector<f64>]) {
    for other in to {
        column.axpy(-other.dot(column), other, 1.0);
    }
}
