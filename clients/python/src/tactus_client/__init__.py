"""Client of Tactus, the lab service for a tactile array and the robot that presses it.

    import tactus_client

    with tactus_client.connect() as client:
        result = client.run("element-centres").wait()
    run = tactus_client.open(result.recording)
    run.rise[20].plot()

The messages are those of ``tactus.v1``, under the same names: see ``tactus_client.messages``.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from tactus_client import messages
from tactus_client.client import Client, connect, stop
from tactus_client.errors import (
    NoAnswer,
    NoRig,
    NoService,
    Refused,
    RunAborted,
    RunFailed,
    RunRefused,
    RunStopped,
    TactusError,
    UnknownRun,
    UnreadableNotes,
    UnreadableRecording,
)
from tactus_client.experiments import Experiment, Parameter, Plan
from tactus_client.frames import Frame, FrameStream, Missing
from tactus_client.lease import Lease
from tactus_client.run import Result, Run
from tactus_client.status import Status
from tactus_client.stream import Stream

if TYPE_CHECKING:
    from tactus_client.recording import Recording, Runs


def open(run: str | os.PathLike[str] | Run | Result, folder: str | os.PathLike[str] | None = None) -> Recording:
    """Opens the recording of a run: its file, its folder, its id, a part that only one id has, or what ``Client.run`` gave.

    Ids are looked up in ``folder``: by default ``runs``, or the installed service's. A recording that is cut off or damaged opens as
    far as it goes, and says so. Raises ``FileNotFoundError``, ``UnknownRun``, ``UnreadableRecording``.
    """
    from tactus_client import recording

    return recording.open(run, folder)


def runs(folder: str | os.PathLike[str] | None = None) -> Runs:
    """The recordings in a folder and those below it, in the order of their start; by default as ``open``."""
    from tactus_client import recording

    return recording.runs(folder)


__all__ = [
    "Client",
    "Experiment",
    "Frame",
    "FrameStream",
    "Lease",
    "Missing",
    "NoAnswer",
    "NoRig",
    "NoService",
    "Parameter",
    "Plan",
    "Refused",
    "Result",
    "Run",
    "RunAborted",
    "RunFailed",
    "RunRefused",
    "RunStopped",
    "Status",
    "Stream",
    "TactusError",
    "UnknownRun",
    "UnreadableNotes",
    "UnreadableRecording",
    "connect",
    "messages",
    "open",
    "runs",
    "stop",
]
