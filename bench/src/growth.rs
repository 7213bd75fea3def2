//! Growth of the time of an image with the array's elements and the tool's triangles, and of the time of the finite
//! element model with its bricks.

use std::time::Instant;

use anyhow::Result;
use tactus_model::Indenter;
use tactus_solid::fem::Bricks;

use crate::{Fem, Method, Painter, Tool, even, fine_sphere, per_image_s};

/// Rows and columns against those of the `DigiTacts` array: 48, 192 and 768 elements.
const FINENESSES: [u32; 3] = [1, 2, 4];
/// Triangles of the spheres.
const TRIANGLES: [u32; 4] = [500, 2_000, 8_000, 32_000];
/// Slabs: bricks along a side, and layers.
const SLABS: [(&str, [[u32; 2]; 3]); 2] =
    [("wider", [[50, 10], [100, 10], [200, 10]]), ("thicker", [[100, 10], [100, 20], [100, 40]])];

/// Times at several sizes, and the power of the size that fits them best.
#[derive(Debug, Clone)]
pub struct Growth {
    /// The timed work.
    pub what: String,
    /// Unit of the size, such as `elements`.
    pub size_of: &'static str,
    /// Size and seconds.
    pub points: Vec<[f64; 2]>,
}

impl Growth {
    /// All growths.
    ///
    /// # Errors
    /// If an image cannot be made.
    pub fn measure() -> Result<Vec<Self>> {
        let mut growths = Vec::new();
        for method in [Method::PressTable, Method::Outline, Method::Raster, Method::Exact] {
            growths.push(Self::with_elements(Tool::H, method)?);
        }
        for method in [Method::PressTable, Method::Exact] {
            growths.push(Self::with_elements(Tool::Cylinder, method)?);
        }
        growths.extend(Self::with_triangles(Method::PressTable)?);
        for method in [Method::Outline, Method::Raster, Method::Exact] {
            let [_, image] = Self::with_triangles(method)?;
            growths.push(image);
        }
        for (how, slabs) in SLABS {
            growths.push(Self::with_bricks(how, &slabs)?);
        }
        Ok(growths)
    }

    /// `p`, where time grows as `size^p`: the least-squares slope of the logarithms.
    pub fn exponent(&self) -> f64 {
        let logs = self.points.iter().map(|point| point.map(f64::ln));
        let count = self.points.len() as f64;
        let mean = |axis: usize| logs.clone().map(|log| log[axis]).sum::<f64>() / count;
        let (mean_size, mean_time) = (mean(0), mean(1));
        let product = |a: f64, b: f64| (a - mean_size) * b;
        let along: f64 = logs.clone().map(|[size, time]| product(size, time - mean_time)).sum();
        along / logs.clone().map(|[size, _]| product(size, size - mean_size)).sum::<f64>()
    }

    fn with_elements(tool: Tool, method: Method) -> Result<Self> {
        let indenter = tool.indenter();
        let point = |fineness: &u32| {
            let model = even(*fineness)?;
            let mut painter = Painter::new(method, &model, &indenter)?;
            Ok([model.array().elements() as f64, per_image_s(&mut painter, model.array())?])
        };
        let points = FINENESSES.iter().map(point).collect::<Result<_>>()?;
        Ok(Self { what: format!("image, {tool:?}, {method:?}").to_lowercase(), size_of: "elements", points })
    }

    /// Growth of the preparation before the first pose, and of an image.
    fn with_triangles(method: Method) -> Result<[Self; 2]> {
        let model = even(1)?;
        let (mut ready, mut image) = (Vec::new(), Vec::new());
        for triangles in TRIANGLES {
            let indenter = fine_sphere(triangles)?;
            let started = Instant::now();
            let mut painter = Painter::new(method, &model, &indenter)?;
            let size = of_mesh(&indenter);
            ready.push([size, started.elapsed().as_secs_f64()]);
            image.push([size, per_image_s(&mut painter, model.array())?]);
        }
        let named = |what: &str, points| {
            let what = format!("{what}, sphere, {method:?}").to_lowercase();
            Self { what, size_of: "triangles", points }
        };
        Ok([named("preparation", ready), named("image", image)])
    }

    fn with_bricks(how: &str, slabs: &[[u32; 2]]) -> Result<Self> {
        let point = |[across, layers]: &[u32; 2]| {
            let bricks = Bricks::cubes(*across, *layers, 1.0, 0.45)?;
            Ok([f64::from(across * across * layers), Fem::measure(bricks).solve_s])
        };
        let points = slabs.iter().map(point).collect::<Result<_>>()?;
        Ok(Self { what: format!("finite elements, {how}"), size_of: "bricks", points })
    }
}

fn of_mesh(indenter: &Indenter) -> f64 {
    if let Indenter::Mesh(mesh) = indenter { mesh.triangles().len() as f64 } else { 0.0 }
}

#[cfg(test)]
#[path = "growth_tests.rs"]
mod tests;
