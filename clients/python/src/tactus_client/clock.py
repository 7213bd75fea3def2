"""When frames were sampled: the device's clock against the host's.

The same estimate as that of ``tactus export``, which explains it: ``crates/tactus-record/src/clock.rs``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

#: A residual beyond this is a jump of the device's clock, not a delay.
JUMP_NS = 1e9
#: No quartz drifts more; a larger slope is a jump.
DRIFT_MAX = 500e-6
#: Over a shorter time a drift cannot be distinguished from the delays.
DRIFT_SPAN_NS = 60e9
#: With ticks this short, an even rate is not looked for.
FINE_TICK_NS = 10_000
#: Least number of frames to estimate an even rate from.
EVEN_FRAMES = 30
#: Ticks of an even rate are off its line by no more than this.
EVEN_TICKS = 0.75

Array = np.ndarray[Any, Any]


@dataclass(frozen=True)
class EpochClock:
    """The device's clock in one connection of the sensor."""

    tick_ns: int
    #: Ticks from frame to frame, if the device keeps an even rate.
    even_ticks: float | None
    #: Host monotonic time at device time zero.
    offset_ns: int
    reference_tick: int
    drift_ppm: float

    @classmethod
    def estimate(cls, tick_ns: int, ticks: Array, received_ns: Array) -> EpochClock | None:
        """From the frames of one connection, in the order of their arrival; None if it jumped or there is none."""
        if tick_ns == 0 or len(ticks) == 0 or (ticks[1:] < ticks[:-1]).any():
            return None
        reference = int(ticks[0])
        even = _even_ticks(ticks) if tick_ns > FINE_TICK_NS else None
        device_ns = _since_ns(reference, ticks, tick_ns, even)
        late_ns = (received_ns - received_ns[0]).astype(float) - device_ns
        slope, at_zero = _lower_line(device_ns, late_ns)
        tilted = np.sort(late_ns - at_zero - slope * device_ns)
        doubt_ns = tick_ns / (1.0 if even is None else np.sqrt(float(len(ticks))))
        uncertainty = doubt_ns + _share_below(tilted, 0.05)
        span_ns = device_ns[-1]
        drifts = span_ns >= DRIFT_SPAN_NS and abs(slope) <= DRIFT_MAX and abs(slope * span_ns) > uncertainty
        if not drifts:
            slope, at_zero = 0.0, float(late_ns.min())
        if (late_ns - at_zero - slope * device_ns).max() > JUMP_NS:
            return None
        base_ns = int(received_ns[0]) - reference * tick_ns
        return cls(tick_ns, even, base_ns + int(_whole(at_zero)), reference, slope * 1e6)

    def sampled_ns(self, ticks: Array, received_ns: Array) -> Array:
        """When frames were sampled, on the host's monotonic clock."""
        since_ns = _since_ns(self.reference_tick, ticks, self.tick_ns, self.even_ticks)
        host_ns = _whole(since_ns * (1.0 + self.drift_ppm * 1e-6)).astype(np.int64)
        sampled_ns = host_ns + (self.reference_tick * self.tick_ns + self.offset_ns)
        middle_ns = 0 if self.even_ticks is not None else self.tick_ns // 2
        earliest: Array = np.minimum(sampled_ns + middle_ns, np.maximum(received_ns, sampled_ns))
        return earliest


def _even_ticks(ticks: Array) -> float | None:
    """Ticks from frame to frame of a device that keeps an even rate."""
    if len(ticks) < EVEN_FRAMES:
        return None
    between = np.diff(ticks).astype(float)
    steps = np.sort(between)
    # Only pairs without a lost frame between them.
    steps = steps[np.abs(steps - _share_below(steps, 0.5)) < 1.5]
    nearly = _sum(steps) / len(steps)
    if nearly < 1.0:
        return None
    numbers = np.concatenate([[0.0], np.cumsum(_whole(between / nearly))])
    since = (ticks - ticks[0]).astype(float)
    number, tick = numbers - _sum(numbers) / len(numbers), since - _sum(since) / len(since)
    even = _sum(number * tick) / _sum(number**2)
    return even if (np.abs(tick - even * number) < EVEN_TICKS).all() else None


def _since_ns(reference: int, ticks: Array, tick_ns: int, even: float | None) -> Array:
    """Device time since the first frame; on the grid of an even rate."""
    since = (ticks - np.uint64(reference)).astype(np.int64).astype(float)
    return (since if even is None else _whole(since / even) * even) * float(tick_ns)


def _lower_line(x: Array, y: Array) -> tuple[float, float]:
    """Slope and height at zero of the line under all points with the least mean distance to them; points in order of x."""
    hull: list[tuple[float, float]] = []
    for point in zip(x.tolist(), y.tolist()):
        while len(hull) >= 2:
            a, b = hull[-2:]
            if (b[0] - a[0]) * (point[1] - a[1]) - (b[1] - a[1]) * (point[0] - a[0]) > 0.0:
                break
            hull.pop()
        # Of points at one device time, the lowest counts.
        if hull and hull[-1][0] >= point[0]:
            hull[-1] = (hull[-1][0], min(hull[-1][1], point[1]))
        else:
            hull.append(point)
    mean = _sum(x) / len(x)
    for a, b in zip(hull, hull[1:]):
        if b[0] >= mean:
            slope = (b[1] - a[1]) / (b[0] - a[0])
            return slope, a[1] - slope * a[0]
    return 0.0, hull[0][1]


def _share_below(ascending: Array, share: float) -> float:
    return float(ascending[int(_whole((len(ascending) - 1) * share))])


def _sum(values: Array) -> float:
    """One after the other: numpy's own sum takes another order, and may differ in the last digit."""
    return float(np.cumsum(values)[-1])


def _whole(values: Any) -> Any:
    """Rounded, halves away from zero."""
    return np.trunc(values + np.copysign(0.5, values))
