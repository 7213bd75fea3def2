//! Residuals of each frame that was read, of the base model and of the grown model. Of frames that were read as their mean the one in the middle
//! stands for all, with what the models predict of the mean.

use std::path::Path;

use anyhow::ensure;
use tactus_discover::predict;
use tactus_record::{rows, table::ResidualWriter};

use super::Discovered;

/// Writes the residuals. Reads the files again, for all columns of the frames.
pub(super) fn write(discovered: &Discovered, path: &Path) -> anyhow::Result<()> {
    let Discovered { measured, known, discovery, .. } = discovered;
    let before = predict(known, &measured.frames, &discovery.recalibrated, &known.effects)?;
    let after = predict(known, &measured.frames, &discovery.grown, &discovery.effects)?;
    let elements = measured.rig.array.elements();
    let predicted = before.chunks_exact(elements).zip(after.chunks_exact(elements));
    let frames = &measured.frames;
    let mut predicted = frames.numbers().zip(discovery.heldout_frames.iter().zip(predicted)).peekable();
    let mut table = ResidualWriter::create(path, &measured.rig, measured.simulated)?;
    let (mut rows, mut written) = (0, Ok(()));
    rows::visit(&measured.files, |_, row| {
        if let (Ok(()), Some((_, (held_out, (before, after))))) =
            (&written, predicted.next_if(|(number, _)| *number == rows))
        {
            written = table.push(&row, *held_out, before, after);
        }
        rows += 1;
    })?;
    written?;
    ensure!(rows == frames.given(), "the files changed while they were read");
    Ok(table.finish()?)
}
