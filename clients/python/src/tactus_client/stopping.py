"""STOP without a connection: one datagram to the service."""

from __future__ import annotations

import contextlib
import re
import socket
import time

from tactus_client import messages

#: Time after which the datagram is sent again.
AGAIN_S = 0.05


def stop_by_datagram(endpoint: str, rig: str | None, request: messages.CommandRequest, timeout_s: float) -> messages.CommandReply | None:
    """Sends a stop until it is answered, and returns the ``CommandReply``; None if nobody takes datagrams there.

    A service on ``tcp/HOST:PORT`` on this machine takes them at the same port, one on a Unix socket at ``PATH.stop``.
    """
    datagram = b"tactus stop " + (rig or "").encode() + b"\n" + request.SerializeToString()
    try:
        with _socket(endpoint) as to_service:
            if to_service is None:
                return None
            to_service.settimeout(AGAIN_S)
            until = time.monotonic() + timeout_s
            while time.monotonic() < until:
                to_service.send(datagram)
                try:
                    return messages.CommandReply.FromString(to_service.recv(65_536))
                except TimeoutError:
                    pass
    except (OSError, messages.DecodeError):
        pass
    return None


def _socket(endpoint: str) -> contextlib.AbstractContextManager[socket.socket | None]:
    if endpoint.startswith("unixsock-stream/"):
        made = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        # A name without a file, for the answer.
        made.bind("")
        made.connect(endpoint.removeprefix("unixsock-stream/") + ".stop")
        return made
    match = re.fullmatch(r"tcp/(?:\[(::1)\]|(127\.[0-9.]+|localhost)):(\d+)", endpoint)
    if not match:
        return contextlib.nullcontext()
    host, port = match[1] or match[2], int(match[3])
    family, _, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
    made = socket.socket(family, socket.SOCK_DGRAM)
    made.connect(address)
    return made
