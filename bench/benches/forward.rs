//! Time of one image: every array, tool and method, and several numbers of elements and triangles.

use anyhow::Result;
use criterion::{BenchmarkGroup, BenchmarkId, Criterion, measurement::WallTime};
use tactus_bench::{Method, Painter, Tool, even, fine_sphere, model, poses};
use tactus_model::{Array, ForwardModel, Indenter};

fn main() -> Result<()> {
    let mut criterion = Criterion::default().configure_from_args();
    arrays(&mut criterion)?;
    elements(&mut criterion)?;
    triangles(&mut criterion)?;
    criterion.final_summary();
    Ok(())
}

/// The methods for a tool; `outline` and `raster` need a mesh.
fn methods(tool: Tool) -> &'static [Method] {
    match tool {
        Tool::H | Tool::TiltedH => &[Method::PressTable, Method::Outline, Method::Raster, Method::Exact],
        Tool::Cylinder => &[Method::PressTable, Method::Exact],
    }
}

/// Every shipped array.
fn arrays(criterion: &mut Criterion) -> Result<()> {
    for tool in [Tool::Cylinder, Tool::H] {
        let mut group = criterion.benchmark_group(format!("{tool:?}").to_lowercase());
        for array in Array::shipped() {
            let model = model(array.clone())?;
            for method in methods(tool) {
                press(&mut group, array.name(), *method, &model, &tool.indenter())?;
            }
        }
        group.finish();
    }
    Ok(())
}

/// The same area in ever finer elements.
fn elements(criterion: &mut Criterion) -> Result<()> {
    let mut group = criterion.benchmark_group("elements");
    for fineness in [1, 2, 4] {
        let model = even(fineness)?;
        for method in methods(Tool::H) {
            press(&mut group, model.array().elements(), *method, &model, &Tool::H.indenter())?;
        }
    }
    group.finish();
    Ok(())
}

/// The same sphere in ever finer triangles.
fn triangles(criterion: &mut Criterion) -> Result<()> {
    let mut group = criterion.benchmark_group("triangles");
    group.sample_size(10);
    let model = even(1)?;
    for triangles in [500, 2_000, 8_000, 32_000] {
        for method in methods(Tool::H) {
            press(&mut group, triangles, *method, &model, &fine_sphere(triangles)?)?;
        }
    }
    group.finish();
    Ok(())
}

fn press(
    group: &mut BenchmarkGroup<'_, WallTime>,
    size: impl std::fmt::Display,
    method: Method,
    model: &ForwardModel,
    indenter: &Indenter,
) -> Result<()> {
    let mut painter = Painter::new(method, model, indenter)?;
    let mut image = vec![0.0; model.array().elements()];
    let mut poses = poses(model.array(), 1024).into_iter().cycle();
    let id = BenchmarkId::new(format!("{method:?}").to_lowercase(), size);
    group.bench_function(id, |bencher| {
        bencher.iter(|| poses.next().map(|pose| painter.image(&pose, &mut image)));
    });
    Ok(())
}
