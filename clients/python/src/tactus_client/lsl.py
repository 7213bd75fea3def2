"""Live frames as a stream of the Lab Streaming Layer: ``pip install 'tactus-client[lsl]'``.

    with tactus_client.connect() as client, FrameOutlet(client, is_reachable=True) as outlet:
        outlet.run()

Others then find a stream of the type ``Tactile`` with a channel per element, in counts. Its times are when a frame reached the service,
on LSL's clock; they are right if this machine's wall clock is the service's, as on one machine or with NTP.
"""

from __future__ import annotations

import time
from typing import Any

import pylsl

from tactus_client.client import Client
from tactus_client.frames import Frame

TYPE = "Tactile"
#: Streams are announced and looked for on this machine only.
OF_THIS_MACHINE = """
[ports]
IPv6 = disable
[multicast]
ResolveScope = machine
ListenAddress = 127.0.0.1
[log]
level = -2
"""


def stay_on_this_machine() -> None:
    """Announces and looks for streams on this machine only. To be called before anything else of LSL in a program."""
    pylsl.set_config_content(OF_THIS_MACHINE)


class FrameOutlet:
    """Passes frames on to LSL. A frame that is lost leaves a gap between two times.

    LSL takes connections on all interfaces of a machine, and no configuration changes this: whoever reaches the machine can read the
    stream, but command nothing. ``is_reachable=True`` says that this is known; without it there is no outlet. The stream is announced on
    this machine only, unless ``config`` is another text for LSL's configuration, or "" for LSL's own.
    """

    def __init__(self, client: Client, *, is_reachable: bool = False, config: str = OF_THIS_MACHINE):
        if not is_reachable:
            raise ValueError(
                "LSL takes connections on all interfaces of this machine, without a password: say is_reachable=True if that may be, "
                "behind a firewall or on a network of its own"
            )
        info = client.sensor_info()
        if info is None:
            raise ValueError("no sensor has connected to the service yet: an LSL stream needs to know its elements")
        if config:
            pylsl.set_config_content(config)
        mark = " (SIMULATED)" if info.simulated else ""
        stream = pylsl.StreamInfo(
            f"Tactus {client.rig}{mark}", TYPE, info.rows * info.cols, info.rate_hz, pylsl.cf_float32, f"tactus-{client.rig}"
        )
        stream.set_channel_labels([f"row {row} column {col}" for row in range(info.rows) for col in range(info.cols)])
        stream.set_channel_units("counts")
        about = stream.desc().append_child("tactus")
        for name, value in {"rig": client.rig, "array": info.array, "rows": info.rows, "cols": info.cols}.items():
            about.append_child_value(name, str(value))
        about.append_child_value("simulated", str(info.simulated).lower())
        self.info = stream
        self._frames = client.frames(history=1)
        self._outlet: Any = pylsl.StreamOutlet(stream)

    def run(self, timeout_s: float | None = None) -> None:
        """Passes frames on until the connection ends, ``close`` is called, or none has come for ``timeout_s``."""
        while (frame := self._frames.receive(timeout_s)) is not None:
            self.push(frame)

    def push(self, frame: Frame) -> None:
        """Passes one frame on; not once the outlet is closed."""
        outlet = self._outlet
        if outlet is not None:
            age_s = time.time() - frame.t_wall_ns * 1e-9
            outlet.push_sample(list(frame.counts), pylsl.local_clock() - age_s)

    def close(self) -> None:
        """Ends the stream."""
        self._frames.close()
        self._outlet = None

    def __enter__(self) -> FrameOutlet:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
