"""Client of Tactus, the lab service for a tactile array and the robot that presses it.

    import tactus_client

    with tactus_client.connect() as client:
        for frame in client.frames():
            print(frame.seq, frame.image)

The messages are those of ``tactus.v1``, under the same names: see ``tactus_client.messages``.
"""

from tactus_client import messages
from tactus_client.client import Client, connect, stop
from tactus_client.errors import NoAnswer, NoRig, NoService, Refused, TactusError
from tactus_client.frames import Frame, FrameStream, Missing
from tactus_client.lease import Lease
from tactus_client.stream import Stream

__all__ = [
    "Client",
    "Frame",
    "FrameStream",
    "Lease",
    "Missing",
    "NoAnswer",
    "NoRig",
    "NoService",
    "Refused",
    "Stream",
    "TactusError",
    "connect",
    "messages",
    "stop",
]
