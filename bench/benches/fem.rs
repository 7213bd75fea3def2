//! Time of the finite element model of the covering, at several numbers of bricks.

use anyhow::Result;
use criterion::{BenchmarkId, Criterion};
use tactus_solid::fem::Bricks;

fn main() -> Result<()> {
    let mut criterion = Criterion::default().configure_from_args();
    let mut group = criterion.benchmark_group("fem");
    for (across, layers) in [(100, 5), (100, 10), (200, 10), (100, 40)] {
        let bricks = Bricks::cubes(across, layers, 1.0, 0.45)?;
        let id = BenchmarkId::from_parameter(format!("{across}x{across}x{layers}"));
        group.bench_function(id, |bencher| bencher.iter(|| bricks.under_point()));
    }
    group.finish();
    criterion.final_summary();
    Ok(())
}
