use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{Addition, Evidence, Signs};

fn additions(sizes: &[usize]) -> Vec<Addition> {
    let mut first = 0;
    let of = |(class, size): (usize, &usize)| {
        first += size;
        Addition {
            class,
            directions: (first - size..first).collect(),
            widths: vec![1.0; *size],
            signs: vec![Signs::Both; *size],
            among: 1.0,
            is_free: false,
        }
    };
    sizes.iter().enumerate().map(of).collect()
}

/// Logarithm of the density of `y` under a normal distribution with this covariance, but for the constant.
fn ln_density(y: &DVector<f64>, covariance: DMatrix<f64>) -> f64 {
    let factors = covariance.cholesky().unwrap();
    -0.5 * y.dot(&factors.solve(y)) - factors.l().diagonal().map(f64::ln).sum()
}

#[test]
fn odds_are_the_ratio_of_two_normal_densities_of_the_readings() {
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let x = DMatrix::from_fn(60, 5, |_, _| rng.random_range(-1.0..1.0));
    let y = DVector::from_fn(60, |_, _| rng.random_range(-2.0..2.0)) + x.column(0) * 1.5 + x.column(3) * 1.5;
    let mut all = x.clone().resize_horizontally(6, 0.0);
    all.set_column(5, &y);
    let products = all.transpose() * &all;
    let additions = additions(&[2, 3]);
    let evidence = Evidence { additions: &additions, products: &products, variance: 1.0, present: &[] };
    let first = evidence.set([0]);
    let both = evidence.set([0, 1]);
    let mut covariance = DMatrix::identity(60, 60);
    let none = ln_density(&y, covariance.clone());
    for (set, members) in [(&first, 1), (&both, 2)] {
        covariance = DMatrix::identity(60, 60);
        for (direction, precision) in &set.swept {
            covariance.ger(1.0 / precision, &x.column(*direction), &x.column(*direction), 1.0);
        }
        let charged = f64::from(members) * 20.0_f64.ln();
        let want = ln_density(&y, covariance) - none - charged;
        assert!((set.ln_odds - want).abs() < 1e-9, "{} {want}", set.ln_odds);
    }
}

#[test]
fn the_set_that_made_the_readings_has_the_greatest_odds() {
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let x = DMatrix::from_fn(200, 12, |_, _| rng.random_range(-1.0..1.0));
    let y = DVector::from_fn(200, |_, _| rng.random_range(-1.7..1.7)) + x.column(2) * 2.0 - x.column(7) * 1.5;
    let mut all = x.resize_horizontally(13, 0.0);
    all.set_column(12, &y);
    let products = all.transpose() * &all;
    let additions = additions(&[2; 6]);
    let evidence = Evidence { additions: &additions, products: &products, variance: 1.0, present: &[] };
    let mut members = evidence.sets(|_| true).remove(0).members;
    members.sort_unstable();
    assert_eq!(members, [1, 3]);
}

#[test]
fn a_coefficient_of_the_wrong_sign_gains_nothing() {
    let products = DMatrix::from_row_slice(2, 2, &[100.0, -80.0, -80.0, 100.0]);
    let mut additions = additions(&[1]);
    for (signs, gains) in [(Signs::Both, true), (Signs::Negative, true), (Signs::Positive, false)] {
        additions[0].signs = vec![signs];
        let evidence = Evidence { additions: &additions, products: &products, variance: 1.0, present: &[] };
        assert_eq!(evidence.gain(&evidence.none(), 0).ln_likelihood > 0.0, gains, "{signs:?}");
    }
}

/// Of orthogonal directions each is determined to `l / (l + precision)`.
#[test]
fn what_hardly_any_reading_sees_is_determined_by_the_prior() {
    let sizes = [400.0, 100.0, 1e-6];
    let mut products = DMatrix::zeros(4, 4);
    for (direction, size) in sizes.into_iter().enumerate() {
        products[(direction, direction)] = size;
        products[(direction, 3)] = size;
        products[(3, direction)] = size;
    }
    products[(3, 3)] = 2000.0;
    let additions = additions(&[3]);
    let evidence = Evidence { additions: &additions, products: &products, variance: 1.0, present: &[] };
    let set = evidence.set([0]);
    let precision = set.swept[0].1;
    let want: f64 = sizes.iter().map(|size| size / (size + precision)).sum();
    let got = evidence.determined(&set);
    assert!((got - want).abs() < 1e-9 && (1.8..2.001).contains(&got), "{got} {want}");
}
