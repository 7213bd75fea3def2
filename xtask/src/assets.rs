//! Writes the tools that are made in code as binary STL files, to print, view or simulate.

use std::{fs, path::Path};

use anyhow::{Context, Result};
use stl_io::{Triangle, Vertex};
use tactus_scene::shapes::{SCENES, Surface};

/// Folder of the committed files, relative to the repository.
const FOLDER: &str = "assets";

/// Writes every scene's tool into [`FOLDER`] in `out`.
pub(crate) fn write(out: &Path) -> Result<()> {
    let folder = out.join(FOLDER);
    fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
    for scene in SCENES {
        let path = folder.join(format!("{}.stl", scene.name()));
        fs::write(&path, stl(&scene.surface())?)
            .with_context(|| format!("cannot write {}", path.display()))?;
    }
    Ok(())
}

fn stl(surface: &Surface) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    stl_io::write_stl(&mut bytes, surface.corners_mm().map(triangle))?;
    Ok(bytes)
}

/// A triangle with its outward unit normal.
fn triangle([a, b, c]: [[f64; 3]; 3]) -> Triangle {
    let [u, v] = [b, c].map(|corner| [0, 1, 2].map(|axis| corner[axis] - a[axis]));
    let across = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let length = across.iter().map(|along| along * along).sum::<f64>().sqrt();
    let vector = |mm: [f64; 3]| {
        #[expect(clippy::cast_possible_truncation, reason = "STL holds f32")]
        Vertex::new(mm.map(|along| along as f32))
    };
    Triangle { normal: vector(across.map(|along| along / length)), vertices: [a, b, c].map(vector) }
}

#[cfg(test)]
#[path = "assets_tests.rs"]
mod tests;
