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

/// Files of `tactus collect` that have frames of a recorded run of their rig, too; the collection first.
pub(crate) fn collected_too(heads: &[RunHead]) -> impl Iterator<Item = (&RunHead, &RunHead)> {
    let mut runs: BTreeMap<&str, Vec<(i64, &RunHead)>> = BTreeMap::new();
    for head in heads.iter().filter(|head| !is_collection(head)) {
        runs.entry(&head.rig).or_default().extend(head.started_ns.map(|ns| (ns, head)));
    }
    for of_rig in runs.values_mut() {
        of_rig.sort_by_key(|(started_ns, _)| *started_ns);
    }
    heads.iter().filter(|head| is_collection(head)).filter_map(move |collection| {
        let of_rig = runs.get(collection.rig.as_str())?;
        let ended_ns = collection.ended_ns()?;
        // A rig has one run at a time: the last one that began before the end is the last to end.
        let (_, run) = of_rig.get(of_rig.partition_point(|(ns, _)| *ns <= ended_ns).checked_sub(1)?)?;
        (run.ended_ns() >= collection.started_ns).then_some((collection, *run))
    })
}

/// True if nobody ran it: `tactus collect` recorded what the rig published.
fn is_collection(head: &RunHead) -> bool {
    head.experiment.as_deref() == Some("collect")
}
