"""A connection to one rig's service."""

from __future__ import annotations

import getpass
import json
import re
import socket

import zenoh

from tactus_client import messages
from tactus_client.errors import NoAnswer, NoRig, NoService, Refused
from tactus_client.frames import FrameStream
from tactus_client.stream import Stream, past_samples

#: How long a machine that does not answer at all is waited for.
REACH_TIMEOUT_S = 2.0
#: How long rigs are waited for that do not say that they are there.
ROLL_CALL_TIMEOUT_S = 3.0
#: Events that may wait to be read: twice what the service keeps.
EVENT_CAPACITY = 131_072


def connect(endpoint: str = "tcp/127.0.0.1:7447", rig: str | None = None) -> Client:
    """Connects to the service at ``endpoint``, ``tcp/HOST:PORT``.

    Without ``rig`` it takes the one that is ready there.

    Raises ``NoService`` at once if nothing listens there, ``NoRig`` if no rig is ready or several are and none was
    named, and ``ValueError`` if the endpoint or the name is none.
    """
    if rig is not None and not re.fullmatch(r"[A-Za-z0-9_-]+", rig):
        # A wildcard would command every rig on the bus.
        raise ValueError(f"rig name {rig!r}: letters, digits, '-' and '_' only")
    _reach(endpoint)
    try:
        session = zenoh.open(_config(endpoint))
    except zenoh.ZError as error:
        raise NoService(f"what listens at {endpoint} does not answer as a Tactus service: {error}") from error
    try:
        return Client(session, rig or _the_only_rig(session, endpoint))
    except BaseException:
        session.close()
        raise


class Client:
    """A connection to one rig's service; made by ``connect``. Close it, or use it in a ``with`` statement."""

    def __init__(self, session, rig: str):
        self._session = session
        self.rig = rig

    def frames(self, history: int | None = None) -> FrameStream:
        """Frames from the past on: the last ``history`` ones that the service keeps, or all (10 s) if None."""
        info = self.sensor_info()
        shape = (info.rows, info.cols) if info else None
        return FrameStream(self._session, self._key("sensor/frame"), history, shape)

    def events(self, history: int | None = None) -> Stream:
        """Events of runs (``RunEvent``) from the past on: as ``frames``; all are the last 65,536."""
        return Stream(self._session, self._key("run/event"), messages.RunEvent, history, EVENT_CAPACITY)

    def states(self) -> Stream:
        """States of the run (``RunState``), from the present one on."""
        return Stream(self._session, self._key("run/state"), messages.RunState, 1, 1_024)

    def sensor_info(self):
        """What the sensor last said of itself (``SensorInfo``); None if it was not there yet."""
        samples = past_samples(self._session, self._key("sensor/info"), 1)
        return messages.SensorInfo.FromString(samples[-1].payload.to_bytes()) if samples else None

    def status(self, timeout_s: float = 5.0):
        """What the service is doing, as a ``CommandReply``. Raises ``NoAnswer``, ``Refused``."""
        return self._command("status", messages.CommandRequest(who=_who()), timeout_s)

    def run(self, experiment: str, /, *, seed: int | None = None, timeout_s: float = 60.0, **parameters):
        """Starts an experiment of the service's own with these parameters; returns a ``CommandReply``.

        The answer comes after the dry run, before anything moves; follow the run by ``events`` or ``states``. Raises
        ``Refused`` with the reason, ``NoAnswer``.
        """
        request = messages.RunRequest(
            experiment=experiment, parameters_json=json.dumps(parameters), seed=seed, who=_who()
        )
        return self._command("run", request, timeout_s)

    def pause(self, reason: str = "", timeout_s: float = 5.0):
        """Holds the run after the step in hand. Raises ``Refused``, ``NoAnswer``."""
        return self._command("pause", messages.CommandRequest(who=_who(), reason=reason), timeout_s)

    def resume(self, reason: str = "", timeout_s: float = 5.0):
        """Goes on after a pause. Raises ``Refused``, ``NoAnswer``."""
        return self._command("resume", messages.CommandRequest(who=_who(), reason=reason), timeout_s)

    def stop(self, reason: str = "", abort: bool = False, timeout_s: float = 5.0):
        """Stops motion now, retracts and ends the run; goes before all else. Raises ``NoAnswer``, ``Refused``."""
        return self._command("stop", messages.CommandRequest(who=_who(), reason=reason, abort=abort), timeout_s)

    def reset(self, timeout_s: float = 120.0):
        """Clears the stage's alarm, homes it and lets runs start; not during a run. Raises ``Refused``, ``NoAnswer``."""
        return self._command("reset", messages.CommandRequest(who=_who()), timeout_s)

    def close(self) -> None:
        """Takes leave of the service; streams end."""
        self._session.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def _key(self, suffix: str) -> str:
        return f"tactus/{self.rig}/{suffix}"

    def _command(self, command: str, request, timeout_s: float):
        key = self._key(f"cmd/{command}")
        replies = self._session.get(
            key,
            payload=request.SerializeToString(),
            encoding=messages.encoding(type(request)),
            consolidation=zenoh.ConsolidationMode.NONE,
            congestion_control=zenoh.CongestionControl.BLOCK,
            priority=zenoh.Priority.REAL_TIME if command == "stop" else zenoh.Priority.INTERACTIVE_HIGH,
            express=True,
            timeout=timeout_s,
        )
        for reply in replies:
            # Errors come from zenoh itself: a timeout, or a service that went away.
            if reply.ok is not None:
                answer = messages.CommandReply.FromString(reply.ok.payload.to_bytes())
                if not answer.ok:
                    raise Refused(answer)
                return answer
        raise NoAnswer(f"nobody answered {key} (waited at most {timeout_s} s): the rig's service is gone or busy")


def _reach(endpoint: str) -> None:
    """Finds out by a plain connection whether anything listens, which zenoh takes seconds to tell."""
    match = re.fullmatch(r"tcp/(?:\[([0-9A-Fa-f:.%]+)\]|([^:\[\]/?#;]+)):(\d+)", endpoint)
    if not match:
        raise ValueError(f"endpoint {endpoint!r} should read tcp/HOST:PORT, such as tcp/127.0.0.1:7447")
    host, port = match[1] or match[2], int(match[3])
    try:
        socket.create_connection((host, port), REACH_TIMEOUT_S).close()
    except (OSError, OverflowError) as error:
        raise NoService(f"no service at {endpoint}: start tactusd, or name another endpoint ({error})") from error


def _config(endpoint: str):
    config = zenoh.Config()
    for name, value in {
        "mode": "client",
        "connect/endpoints": [endpoint],
        "connect/timeout_ms": 0,
        "transport/unicast/open_timeout": 3_000,
        # Nobody is looked for and nobody is told where we are.
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
    }.items():
        config.insert_json5(name, json.dumps(value))
    return config


def _the_only_rig(session, endpoint: str) -> str:
    replies = session.liveliness().get("tactus/*/alive", timeout=ROLL_CALL_TIMEOUT_S)
    rigs = sorted({str(reply.ok.key_expr).split("/")[1] for reply in replies if reply.ok is not None})
    if not rigs:
        raise NoRig(f"a bus listens at {endpoint}, but no rig is ready on it; its service may still be starting")
    if len(rigs) > 1:
        raise NoRig(f"several rigs are ready at {endpoint}: {', '.join(rigs)}; name one")
    return rigs[0]


def _who() -> str:
    try:
        return f"python:{getpass.getuser()}"
    except (OSError, KeyError, ImportError):
        # No such user, or a system without users.
        return "python"
