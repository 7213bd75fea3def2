use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use tactus_model::Effect;

use super::{Fitting, Score};
use crate::fit::{Free, Prepared, Term};
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
            let term = Term::neutral(tactus_model::effect::Definition::find(name).unwrap());
            let start = at.parameters.with(term);
            let term = start.terms.len() - 1;
            (start, Free::Of { term, parameter: 0 })
        })
        .collect();
    let directions = tried.iter().map(|(start, free)| problem.towards(start, *free)).collect();
    let grams = problem.grams(&at, directions).unwrap();

    let fitting = Fitting::at(&problem, &at.parameters, &at.predicted).unwrap();
    let columns: Vec<Vec<f64>> = tried
        .iter()
        .map(|(start, free)| {
            let mut column = problem.slope(start, &at.predicted, *free).unwrap();
            fitting.free(&mut column);
            column
        })
        .collect();
    let last = columns.len();
    for (i, one) in columns.iter().enumerate() {
        let near = |found: f64, wanted: f64, scale: f64| {
            assert!((found - wanted).abs() < 1e-5 * scale, "{i}: {found} {wanted} {scale}");
        };
        for (j, other) in columns.iter().enumerate() {
            let scale = fitting.size(one) * fitting.size(other);
            near(grams.reduced()[(i, j)], fitting.inner(one, other), scale);
        }
        near(grams.reduced()[(i, last)], fitting.wanted(one), fitting.size(one) * 100.0);
        let (of_grams, of_columns) =
            (Score::of_grams(&grams, &[i]).z, fitting.score(std::slice::from_ref(one)).z);
        assert!((of_grams - of_columns).abs() < 1e-2 * of_columns.max(1.0), "{i}: {of_grams} {of_columns}");
    }
    let (of_grams, of_columns) = (Score::of_grams(&grams, &[0, 1, 2]).z, fitting.score(&columns).z);
    assert!((of_grams - of_columns).abs() < 0.1 * of_columns, "{of_grams} {of_columns}");
}
