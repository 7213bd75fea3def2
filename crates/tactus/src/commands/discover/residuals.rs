//! Residuals of each frame, of the base model and of the grown model.

use std::path::Path;

use anyhow::ensure;
use tactus_discover::predict;
use tactus_record::{rows, table::ResidualWriter};

use super::Discovered;

/// Writes the residuals. Reads the files again instead of keeping all frames in memory.
pub(super) fn write(discovered: &Discovered, path: &Path) -> anyhow::Result<()> {
    let Discovered { measured, known, discovery, .. } = discovered;
    let before = predict(known, &measured.frames, &discovery.recalibrated, &known.effects)?;
    let after = predict(known, &measured.frames, &discovery.grown, &discovery.effects)?;
    let elements = measured.rig.array.elements();
    let predicted = before.chunks_exact(elements).zip(after.chunks_exact(elements));
    let mut predicted = discovery.heldout_frames.iter().zip(predicted);
    let mut table = ResidualWriter::create(path, &measured.rig, measured.simulated)?;
    let (mut rows, mut written) = (0, Ok(()));
    rows::visit(&measured.files, |_, row| {
        rows += 1;
        if let (Ok(()), Some((held_out, (before, after)))) = (&written, predicted.next()) {
            written = table.push(&row, *held_out, before, after);
        }
    })?;
    written?;
    ensure!(rows == measured.frames.len(), "the files changed while they were read");
    Ok(table.finish()?)
}
