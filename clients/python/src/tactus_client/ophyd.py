"""Devices for Bluesky: ``pip install 'tactus-client[ophyd]'``, Python 3.11 or later.

    client = tactus_client.connect()
    with init_devices():
        array, presser = TactileArray(client), Presser(client)
    RE(bps.mv(presser, Press(5.1, 4.9, depth_mm=0.3)))

Whatever moves is a run of the service: it is dry-run on the twin first, needs the lease, is watched by the safety supervisor, leaves a
recording, and ends with the tip up. A device only asks for it; what the service refuses is the error of the status.
"""

from __future__ import annotations

import asyncio
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from bluesky.protocols import Location, Stoppable, Triggerable
from ophyd_async.core import (
    Array1D,
    AsyncLocatable,
    AsyncStatus,
    SignalR,
    StandardReadable,
    soft_signal_r_and_setter,
)
from ophyd_async.core import StandardReadableFormat as Format

from tactus_client.client import Client
from tactus_client.errors import NoAnswer
from tactus_client.frames import Frame
from tactus_client.run import Result, Run

#: Least patience for a frame.
FRAME_TIMEOUT_S = 5.0
#: Reason of a stop.
STOPPED = "stopped by Bluesky"


class Place(NamedTuple):
    """A place above the array, in the sensor's frame."""

    x_mm: float
    y_mm: float


class Press(NamedTuple):
    """A press at a place in the sensor's frame, to a depth below the covering's nominal surface."""

    x_mm: float
    y_mm: float
    depth_mm: float


class TactileArray(StandardReadable, Triggerable):
    """The sensor. A trigger takes the mean of the next ``frames`` frames."""

    def __init__(self, client: Client, frames: int = 8, name: str = "array"):
        self._client = client
        self._frames = frames
        info = client.sensor_info()
        if info is None:
            raise NoAnswer("no sensor has connected to the service yet")
        with self.add_children_as_readables(Format.HINTED_SIGNAL):
            self.counts, self._set_counts = soft_signal_r_and_setter(Array1D[np.float32], units="counts")
        with self.add_children_as_readables(Format.UNCACHED_SIGNAL):
            self.seq, self._set_seq = soft_signal_r_and_setter(int)
            self.frames_lost, self._set_frames_lost = soft_signal_r_and_setter(int)
        with self.add_children_as_readables(Format.CONFIG_SIGNAL):
            self.rig: SignalR[str] = soft_signal_r_and_setter(str, client.rig)[0]
            self.rows: SignalR[int] = soft_signal_r_and_setter(int, info.rows)[0]
            self.cols: SignalR[int] = soft_signal_r_and_setter(int, info.cols)[0]
            self.frames_averaged: SignalR[int] = soft_signal_r_and_setter(int, frames)[0]
            self.simulated: SignalR[bool] = soft_signal_r_and_setter(bool, info.simulated)[0]
        super().__init__(name=name)

    @AsyncStatus.wrap
    async def trigger(self) -> None:
        """Takes a new reading."""
        counts, seq, lost = await asyncio.to_thread(self._mean)
        self._set_counts(counts)
        self._set_seq(seq)
        self._set_frames_lost(lost)

    def _mean(self) -> tuple[Array1D[np.float32], int, int]:
        """Mean counts of the next frames, number of the last, and how many are missing between them."""
        taken: list[Frame] = []
        # The one frame of the past is not a new one.
        with self._client.frames(history=1) as frames:
            while len(taken) <= self._frames:
                frame = frames.receive(FRAME_TIMEOUT_S)
                if frame is None:
                    raise NoAnswer(f"no frame for {FRAME_TIMEOUT_S} s")
                taken.append(frame)
            missing = frames.missing
        counts = np.array([frame.counts for frame in taken[1:]]).mean(axis=0)
        return counts.astype(np.float32), taken[-1].seq, missing.device + missing.bus


class _Moved(StandardReadable, Stoppable):
    """What runs of the service move."""

    def __init__(self, client: Client, name: str):
        self._client = client
        self._run: Run | None = None
        self._is_wanted = True
        with self.add_children_as_readables(Format.UNCACHED_SIGNAL):
            self.run_id, self._set_run_id = soft_signal_r_and_setter(str)
        with self.add_children_as_readables(Format.CONFIG_SIGNAL):
            self.simulated: SignalR[bool] = soft_signal_r_and_setter(bool, client.status().simulated)[0]
        super().__init__(name=name)

    async def stop(self, success: bool = False) -> None:
        """Stops the run that this device has started or is about to start; the service retracts the tip.

        Its status fails then, whatever ``success`` says: what was not done is not reported as done. A plan that shall go on after a
        pause asks for one with ``defer=True``.
        """
        self._is_wanted = False
        if self._run is not None and not self._run.is_over:
            await asyncio.to_thread(self._run.stop, STOPPED)

    async def _do(self, experiment: str | Path, **parameters: float) -> Result:
        """Runs an experiment to its end. If Bluesky gives up waiting, the run is stopped."""
        waiting = asyncio.ensure_future(asyncio.to_thread(self._start_and_wait, experiment, parameters))
        try:
            result = await asyncio.shield(waiting)
        except asyncio.CancelledError:
            await self.stop()
            raise
        self._set_run_id(result.run_id)
        return result

    def _start_and_wait(self, experiment: str | Path, parameters: dict[str, Any]) -> Result:
        self._run, self._is_wanted = None, True
        run = self._run = self._client.run(experiment, **parameters)
        # A stop may have come during the dry run.
        if not self._is_wanted:
            run.stop(STOPPED)
        return run.wait(progress=False)


class Stage(_Moved, AsyncLocatable[Place]):
    """The stage. It moves to a place at the safe height; positions that it reads are the tip's in the robot's frame."""

    def __init__(self, client: Client, name: str = "stage"):
        self._goal = Place(float("nan"), float("nan"))
        with self.add_children_as_readables(Format.HINTED_UNCACHED_SIGNAL):
            self.x_mm: SignalR[float] = self._axis("x_mm")
            self.y_mm: SignalR[float] = self._axis("y_mm")
            self.z_mm: SignalR[float] = self._axis("z_mm")
        super().__init__(client, name)

    @AsyncStatus.wrap
    async def set(self, value: Place) -> None:
        """Moves to a place in the sensor's frame, at the safe height."""
        self._goal = Place(*value)
        await self._do("move-to", x_mm=self._goal.x_mm, y_mm=self._goal.y_mm)

    async def locate(self) -> Location[Place]:
        """Where it was told to be, and where it is: both in the sensor's frame."""
        status = await asyncio.to_thread(self._client.status)
        rig, turn = status.description, np.deg2rad(status.description.rotation_deg)
        dx_mm, dy_mm = status.stage.x_mm - rig.origin_mm[0], status.stage.y_mm - rig.origin_mm[1]
        x_mm, y_mm = np.cos(turn) * dx_mm + np.sin(turn) * dy_mm, np.cos(turn) * dy_mm - np.sin(turn) * dx_mm
        return Location(setpoint=self._goal, readback=Place(float(x_mm), float(y_mm)))

    def _axis(self, axis: str) -> SignalR[float]:
        async def position() -> float:
            status = await asyncio.to_thread(self._client.status)
            return float(getattr(status.stage, axis))

        return soft_signal_r_and_setter(float, units="mm", getter=position)[0]


class Presser(_Moved, AsyncLocatable[Press]):
    """Presses: a set is one press with its recording, and what it reads is the mean rise of each element at the depth."""

    def __init__(self, client: Client, dwell_s: float = 0.25, name: str = "presser"):
        self._last = Press(float("nan"), float("nan"), float("nan"))
        self._dwell_s = dwell_s
        with self.add_children_as_readables(Format.HINTED_SIGNAL):
            self.rise_counts, self._set_rise = soft_signal_r_and_setter(Array1D[np.float32], units="counts")
            self.x_mm, self._set_x = soft_signal_r_and_setter(float, units="mm")
            self.y_mm, self._set_y = soft_signal_r_and_setter(float, units="mm")
            self.depth_mm, self._set_depth = soft_signal_r_and_setter(float, units="mm")
        with self.add_children_as_readables(Format.CONFIG_SIGNAL):
            self.dwell_s: SignalR[float] = soft_signal_r_and_setter(float, dwell_s, units="s")[0]
        super().__init__(client, name)

    @AsyncStatus.wrap
    async def set(self, value: Press) -> None:
        """Presses once: approach, load, hold, unload, retract."""
        press = Press(*value)
        with resources.as_file(resources.files("tactus_client") / "press.star") as script, self._client.events(history=1) as events:
            result = await self._do(script, **press._asdict(), dwell_s=self._dwell_s)
            zero = mean = None
            while (event := events.receive(FRAME_TIMEOUT_S)) is not None:
                kind = event.WhichOneof("event")
                if event.run_id != result.run_id:
                    continue
                if kind == "tare_done":
                    zero = np.array(event.tare_done.baseline_counts, dtype=np.float32)
                elif kind == "dwell_done":
                    mean = np.array(event.dwell_done.mean_counts, dtype=np.float32)
                elif kind == "finished":
                    break
        if zero is None or mean is None:
            raise NoAnswer(f"run {result.run_id} is done, but its readings did not arrive; they are in its recording, {result.recording}")
        self._set_rise(mean - zero)
        self._set_x(press.x_mm)
        self._set_y(press.y_mm)
        self._set_depth(press.depth_mm)
        self._last = press

    async def locate(self) -> Location[Press]:
        """The last press that was done."""
        return Location(setpoint=self._last, readback=self._last)
