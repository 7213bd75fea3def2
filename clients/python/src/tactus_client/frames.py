"""Frames as objects, and counts of missing frames."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import zenoh

from tactus_client import html, messages
from tactus_client.stream import Believes, Stream

try:
    import numpy
except ImportError:
    numpy = None  # type: ignore[assignment]


@dataclass(frozen=True)
class Frame:
    """One reading of all elements; the fields of ``tactus.v1.Frame`` under the same names."""

    #: Counts every frame that the sensor took, including lost ones.
    seq: int
    #: Rises by one with every (re)connection of the device.
    epoch: int
    #: The device's clock in its own ticks; None if it has no clock.
    device_tick: int | None
    #: When the frame reached the service, in ns: by the service's monotonic clock, and as UTC since 1970.
    t_mono_ns: int
    t_wall_ns: int
    #: Raw counts, row-major, row 0 column 0 at the origin corner.
    counts: tuple[float, ...]
    #: Bits of ``FrameFlag``.
    flags: int
    #: Frames lost at the device or on its link just before this one.
    lost_before: int
    #: True if no physical sensor was read.
    simulated: bool
    #: Rows and columns of the array; None if the service has not told them.
    shape: tuple[int, int] | None
    #: Indices of elements that were not read; ``counts`` holds their last reading, or 0.
    bad_elements: tuple[int, ...] = ()
    #: Of the sensor in degrees Celsius; None if it tells none.
    temperature_c: float | None = None

    @property
    def image(self) -> Any:
        """The counts as rows x columns: a numpy array of float32 if numpy is installed, else a list of lists."""
        if self.shape is None:
            raise ValueError("the service has not told the array's rows and columns; use .counts, which are row-major")
        rows, cols = self.shape
        if rows * cols != len(self.counts):
            raise ValueError(f"{len(self.counts)} counts do not make {rows} x {cols} elements")
        if numpy is not None:
            return numpy.array(self.counts, dtype=numpy.float32).reshape(rows, cols)
        return [list(self.counts[row * cols : (row + 1) * cols]) for row in range(rows)]

    def _repr_html_(self) -> str:
        if self.shape is None or self.shape[0] * self.shape[1] != len(self.counts):
            return f"<code>{html.escape(repr(self))}</code>"
        bad = f", not read: {', '.join(map(str, self.bad_elements))}" if self.bad_elements else ""
        simulated = ", SIMULATED" if self.simulated else ""
        return html.image(self.image, f"frame {self.seq}, counts{simulated}{bad}")

    @classmethod
    def of(cls, message: Any, shape: tuple[int, int] | None) -> Frame:
        """A ``tactus.v1.Frame`` as an object."""
        return cls(
            seq=message.seq,
            epoch=message.epoch,
            device_tick=message.device_tick if message.HasField("device_tick") else None,
            t_mono_ns=message.t_mono_ns,
            t_wall_ns=message.t_wall_ns,
            counts=tuple(message.counts),
            flags=message.flags,
            lost_before=message.lost_before,
            simulated=message.simulated,
            shape=shape,
            bad_elements=tuple(message.bad_elements),
            temperature_c=message.temperature_c if message.HasField("temperature_c") else None,
        )


class Missing(NamedTuple):
    """Frames that did not arrive between the first and the last that did."""

    #: Lost at the device or on its link; the service never received them.
    device: int
    #: Lost between the service and this program, by a slow network or a slow reader.
    bus: int


class Tally:
    """Counts frames, and the frames that are missing between them."""

    def __init__(self) -> None:
        self.received = 0
        self.device_lost = 0
        self.bus_missing = 0
        #: How often ``seq`` started again, because the service was restarted.
        self.restarts = 0
        self.first_seq: int | None = None
        self.last_seq: int | None = None

    def count(self, seq: int, lost_before: int) -> None:
        """Counts one frame."""
        if self.last_seq is None:
            self.first_seq = seq
        elif seq <= self.last_seq:
            self.restarts += 1
        else:
            absent = seq - self.last_seq - 1
            at_device = min(lost_before, absent)
            self.device_lost += at_device
            # The `lost_before` of a frame that the bus lost is lost too, so those device losses also count here.
            self.bus_missing += absent - at_device
        self.received += 1
        self.last_seq = seq


class FrameStream(Stream[Any]):
    """Iterates over frames as objects and counts them in ``tally`` and ``missing``."""

    #: Frames that may wait to be read: 5 minutes at 30 Hz.
    CAPACITY = 9_000

    def __init__(self, session: zenoh.Session, key: str, history: int | None, shape: tuple[int, int] | None, believes: Believes):
        self._shape = shape
        self.tally = Tally()
        super().__init__(session, key, messages.Frame, history, self.CAPACITY, believes)

    def receive(self, timeout_s: float | None = None) -> Frame | None:
        """The next frame; None once the stream is closed, or after ``timeout_s`` seconds without one."""
        message = super().receive(timeout_s)
        if message is None:
            return None
        self.tally.count(message.seq, message.lost_before)
        return Frame.of(message, self._shape)

    @property
    def missing(self) -> Missing:
        """Frames that are missing so far."""
        return Missing(device=self.tally.device_lost, bus=self.tally.bus_missing)
