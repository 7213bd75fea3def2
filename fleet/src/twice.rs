//! Frames that a fleet has twice, in two of its runs.

use std::collections::BTreeMap;

use crate::RunHead;

/// Runs that go on with another one, whose file still has the presses that were done again; the other one first.
pub(crate) fn not_cut(heads: &[RunHead]) -> impl Iterator<Item = (&RunHead, &RunHead)> {
    let by_name: BTreeMap<_, _> =
        heads.iter().map(|head| ((head.rig.as_str(), head.run.as_str()), head)).collect();
    heads.iter().filter_map(move |later| {
        let earlier = by_name.get(&(later.rig.as_str(), later.continues.as_deref()?))?;
        earlier.continued_by.is_none().then_some((*earlier, later))
    })
}
