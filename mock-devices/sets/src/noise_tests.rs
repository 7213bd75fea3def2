use rand::SeedableRng;

use super::*;

#[test]
fn coloured_noise_has_its_variance_and_its_correlation() {
    let noise = Noise { rms_counts: 2.0, phi: 0.8 };
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut series = noise.series(&mut rng, 48);
    let mut row = vec![0.0; 48];
    let rows: Vec<Vec<f64>> = (0..5000)
        .map(|_| {
            series(&mut row);
            row.clone()
        })
        .collect();
    let mean = |f: &dyn Fn(usize, usize) -> f64| {
        (1..5000).flat_map(|k| (0..48).map(move |e| (k, e))).map(|(k, e)| f(k, e)).sum::<f64>()
            / (4999.0 * 48.0)
    };
    let variance = mean(&|k, e| rows[k][e] * rows[k][e]);
    let lagged = mean(&|k, e| rows[k][e] * rows[k - 1][e]);
    assert!((variance - 4.0).abs() < 0.1, "{variance}");
    assert!((lagged / variance - 0.8).abs() < 0.01, "{}", lagged / variance);
}

#[test]
fn a_mean_of_coloured_readings_counts_as_fewer() {
    let noise = Noise { rms_counts: 2.0, phi: 0.5 };
    assert!((noise.effective_rms_counts(0.0) - 2.0 * 3.0_f64.sqrt()).abs() < 1e-12);
    let fine = Noise { rms_counts: 0.0, phi: 0.0 };
    assert!((fine.effective_rms_counts(1.0) - (1.0_f64 / 12.0).sqrt()).abs() < 1e-12);
}

#[test]
fn every_kind_draws_noise_within_its_ranges() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    for _ in 0..100 {
        assert_eq!(Noise::draw(NoiseKind::White, &mut rng).phi.to_bits(), 0.0_f64.to_bits());
        assert!((0.3..0.9).contains(&Noise::draw(NoiseKind::Coloured, &mut rng).phi));
        assert!((0.3..1.0).contains(&Noise::draw(NoiseKind::Quantised, &mut rng).rms_counts));
    }
}
