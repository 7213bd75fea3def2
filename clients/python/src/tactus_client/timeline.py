"""Where the stage was, what it did and when each frame was sampled: the columns of the measurement table.

The same rules as those of ``tactus export``: ``crates/tactus-record/src/timeline.rs`` and its folder.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from tactus_client.clock import Array, EpochClock
from tactus_client.scan import Contents

PHASES = ("idle", "approach", "load", "hold", "unload", "retract")
#: At most this many frames before the first press make a zero: two seconds of the paper's sensor.
FIRST_FRAMES_MAX = 60

_DISCONNECTED = 1
_IDLE = 3
_NEVER_NS = np.iinfo(np.int64).max
_ALWAYS_NS = np.iinfo(np.int64).min


class Timeline:
    """The columns that belong to the frames of ``contents``, for those frames of which it is known what the stage did."""

    def __init__(self, contents: Contents, rig: dict[str, Any]):
        self.warnings: list[str] = []
        frames = contents.frames
        sampled_ns = self._sampled_ns(frames, contents.tick_ns)
        phases, coverings, untold = _told(contents)
        #: Indices of the frames that are here.
        self.kept = np.flatnonzero(_outside(untold, sampled_ns))
        if len(self.kept) < len(frames):
            left_out = len(frames) - len(self.kept)
            self.warnings.append(f"{left_out} frames are left out: the events that say what the stage did then are lost")
        if untold:
            self.warnings.append("events are lost: a change of the covering among them would go unnoticed")
        #: When each frame was sampled, on the service's monotonic clock: later than the one before.
        self.t_ns = _rising(sampled_ns[self.kept])
        moved = int((self.t_ns != sampled_ns[self.kept]).sum())
        if moved:
            self.warnings.append(f"{moved} frames did not come after the one before; moved to do so")
        #: Index into ``PHASES``, and of the press; -1 outside a press.
        self.phase, self.press = _at(phases, self.t_ns, (0, -1))
        self._coverings = coverings
        self._first_covering_mm: float = coverings[0][1] if coverings else rig["covering"]["thickness_mm"]
        #: Of the tip in the robot's frame, frames x 3; None if the stage never said where it is.
        self.position_mm = _position_mm(_reports(contents.stage), self.t_ns)

    def covering_mm(self, t_ns: Array) -> Array:
        """Thickness of the covering in place at each time."""
        return _at(self._coverings, t_ns, (self._first_covering_mm,))[0].astype(float)

    def _sampled_ns(self, frames: Array, last_tick_ns: int) -> Array:
        """By the device's clock, or the time of arrival where there is none."""
        sampled_ns: Array = frames["t_mono_ns"].copy()
        for epoch in np.unique(frames["epoch"]):
            of_epoch = frames["epoch"] == epoch
            own = frames[of_epoch]
            told = own["tick_ns"][own["tick_ns"] > 0]
            tick_ns = int(told[0]) if len(told) else last_tick_ns
            clock = EpochClock.estimate(tick_ns, own["device_tick"], own["t_mono_ns"]) if own["has_tick"].all() else None
            if clock is None:
                self.warnings.append(f"connection {epoch}: no usable device clock; its {len(own)} frames are dated by their arrival")
            else:
                sampled_ns[of_epoch] = clock.sampled_ns(own["device_tick"], own["t_mono_ns"])
        return sampled_ns


class Zeros:
    """The zero at any time: of the last tare, else the mean of the first frames before a press, else the rig file's."""

    def __init__(self, contents: Contents, timeline: Timeline, rig: dict[str, Any]):
        elements = contents.counts.shape[1]
        tares = [
            (event.t_mono_ns, np.array(event.tare_done.baseline_counts, dtype=np.float32))
            for event in contents.events
            if event.WhichOneof("event") == "tare_done" and len(event.tare_done.baseline_counts) == elements
        ]
        tares.sort(key=lambda tare: tare[0])
        pressed = np.flatnonzero(timeline.press >= 0)
        before = contents.counts[timeline.kept][: pressed[0] if len(pressed) else None]
        before = before[np.isfinite(before).all(axis=1)][:FIRST_FRAMES_MAX]
        if len(before):
            first = before.mean(axis=0, dtype=np.float64).astype(np.float32)
        else:
            first = np.broadcast_to(np.asarray(rig["baseline_counts"], dtype=np.float32), elements)
        self._from_ns = np.array([at for at, _ in tares], dtype=np.int64)
        self._counts = np.array([first, *(baseline for _, baseline in tares)])

    def at(self, t_ns: Array) -> Array:
        """Times x elements."""
        zeros: Array = self._counts[np.searchsorted(self._from_ns, t_ns, side="right")]
        return zeros


def _told(contents: Contents) -> tuple[list[Any], list[Any], list[tuple[int, int]]]:
    """Phases and coverings by the time from which they hold, and the times of which events are lost."""
    phases: list[Any] = []
    coverings: list[Any] = []
    untold: list[list[int]] = []
    next_seq, last_ns = 0, _ALWAYS_NS
    for event in contents.events:
        at, kind = event.t_mono_ns, event.WhichOneof("event")
        if event.seq > next_seq:
            untold.append([last_ns, _NEVER_NS])
        next_seq, last_ns = event.seq + 1, at
        if kind == "phase_changed":
            for gap in untold:
                gap[1] = min(at, gap[1])
            if 1 <= event.phase_changed.phase <= len(PHASES):
                phases.append((at, event.phase_changed.phase - 1, max(event.phase_changed.press, -1)))
        elif kind == "started" and event.started.covering_mm > 0.0:
            coverings.append((at, event.started.covering_mm))
        elif kind == "covering_changed":
            coverings.append((at, event.covering_changed.covering_mm))
    has_ended = any(event.WhichOneof("event") == "finished" for event in contents.events)
    if contents.lost_chunks and not has_ended:
        # Nothing tells whether the last event here was the last.
        untold.append([last_ns, _NEVER_NS])
    phases.sort(key=lambda phase: phase[0])
    coverings.sort(key=lambda covering: covering[0])
    return phases, coverings, [(since, until) for since, until in untold]


def _outside(gaps: list[tuple[int, int]], t_ns: Array) -> Array:
    outside = np.ones(len(t_ns), dtype=bool)
    for since, until in gaps:
        outside &= (t_ns < since) | (t_ns >= until)
    return outside


def _rising(t_ns: Array) -> Array:
    """Each at least 1 ns after the one before."""
    steps = np.arange(len(t_ns))
    rising: Array = np.maximum.accumulate(t_ns - steps) + steps
    return rising


def _at(told: list[Any], t_ns: Array, before: tuple[Any, ...]) -> list[Array]:
    """What held at each time, column by column."""
    now = np.searchsorted(np.array([row[0] for row in told], dtype=np.int64), t_ns, side="right")
    return [np.array([first, *(row[index] for row in told)])[now] for index, first in enumerate(before, start=1)]


def _reports(stage: Array) -> Array:
    """The stage's reports of a position, in order of time; of several at one time the last."""
    finite = np.isfinite(stage["x_mm"]) & np.isfinite(stage["y_mm"]) & np.isfinite(stage["z_mm"])
    reports = stage[(stage["status"] != _DISCONNECTED) & finite]
    reports = reports[np.argsort(reports["t_mono_ns"], kind="stable")]
    times = reports["t_mono_ns"]
    last: Array = reports[np.append(times[1:] != times[:-1], True)] if len(reports) else reports
    return last


def _position_mm(reports: Array, t_ns: Array) -> Array | None:
    """Between two reports it follows from the speeds before and after them; before the first and after the last it is theirs."""
    if len(reports) == 0:
        return None
    at_ns, stands = reports["t_mono_ns"], reports["status"] == _IDLE
    places = np.stack([reports["x_mm"], reports["y_mm"], reports["z_mm"]], axis=1)
    after = np.searchsorted(at_ns, t_ns, side="right")
    position: Array = places[np.clip(after - 1, 0, None)]
    between = np.flatnonzero((after > 0) & (after < len(reports)))
    two = after[between]
    one = two - 1
    at_s = ((t_ns[between] - at_ns[one]) * 1e-9)[:, None]
    two_s = ((at_ns[two] - at_ns[one]) * 1e-9)[:, None]
    x_1, x_2 = places[one], places[two]
    arriving = _speed(one, one - 1, two, at_ns, places, stands)
    leaving = _speed(two, two + 1, one, at_ns, places, stands)
    with np.errstate(divide="ignore", invalid="ignore"):
        corner_s = (x_2 - leaving * two_s - x_1) / (arriving - leaving)
    path = np.where(at_s < corner_s, x_1 + arriving * at_s, x_2 + leaving * (at_s - two_s))
    # Comparisons with NaN are false: where a speed is not known or the lines do not meet, the straight line counts.
    meets = (corner_s >= 0.0) & (corner_s <= two_s)
    position[between] = np.where(meets, path, x_1 + (x_2 - x_1) * at_s / two_s)
    return position


def _speed(report: Array, beside: Array, other: Array, at_ns: Array, places: Array, stands: Array) -> Array:
    """Speed in mm/s at a report, from the report on the side away from ``other``; NaN if it is not known."""
    inside = np.clip(beside, 0, len(at_ns) - 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        by_s = ((at_ns[inside] - at_ns[report]) * 1e-9)[:, None]
        speed: Array = (places[inside] - places[report]) / by_s
    known = (beside >= 0) & (beside < len(at_ns)) & (~stands[inside] | stands[other])
    speed[~known] = np.nan
    speed[stands[report]] = 0.0
    return speed


def phase_names(phase: Array) -> Array:
    """Names of phases by their index."""
    names: Array = np.array(PHASES, dtype=object)[phase]
    return names
