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

#: How long to wait for a machine that does not answer at all.
REACH_TIMEOUT_S = 2.0
#: How long to wait for rigs to announce themselves.
ROLL_CALL_TIMEOUT_S = 3.0
#: Number of events that may wait to be read: twice what the service keeps.
EVENT_CAPACITY = 131_072


def connect(endpoint: str = "tcp/127.0.0.1:7447", rig: str | None = None) -> Client:
    """Connects to the service at ``endpoint``, ``tcp/HOST:PORT``.

    Without ``rig`` it takes the rig that is ready there.

    Raises ``NoService`` at once if nothing listens there, ``NoRig`` if no rig is ready, or if several are ready and
    none was named, and ``ValueError`` if the endpoint or the rig's name is not valid.
    """
    if rig is not None and not re.fullmatch(r"[A-Za-z0-9_-]+", rig):
        # With a wildcard, a command would go to every rig on the bus.
        raise ValueError(f"rig name {rig!r}: letters, digits, '-' and '_' only")
    _reach(endpoint)
    try:
        session = zenoh.open(_config(endpoint))
    except zenoh.ZError as error:
        raise NoService(f"the program at {endpoint} does not answer as a Tactus service: {error}") from error
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
        """Past frames, then live ones.

        Starts with the last ``history`` frames, or with all that the service keeps (10 s) if None.
        """
        info = self.sensor_info()
        shape = (info.rows, info.cols) if info else None
        return FrameStream(self._session, self._key("sensor/frame"), history, shape)

    def events(self, history: int | None = None) -> Stream:
        """Events of runs (``RunEvent``), past ones first, as in ``frames``. The service keeps the last 65,536."""
        return Stream(self._session, self._key("run/event"), messages.RunEvent, history, EVENT_CAPACITY)

    def states(self) -> Stream:
        """States of the run (``RunState``): the present one, then each new one."""
        return Stream(self._session, self._key("run/state"), messages.RunState, 1, 1_024)

    def sensor_info(self):
        """The sensor's last description of itself (``SensorInfo``); None if no sensor has connected yet."""
        samples = past_samples(self._session, self._key("sensor/info"), 1)
        return messages.SensorInfo.FromString(samples[-1].payload.to_bytes()) if samples else None

    def status(self, timeout_s: float = 5.0):
        """What the service is doing, as a ``CommandReply``. Raises ``NoAnswer``, ``Refused``."""
        return self._command("status", messages.CommandRequest(who=_who()), timeout_s)

    def run(self, experiment: str, /, *, seed: int | None = None, timeout_s: float = 60.0, **parameters):
        """Starts an experiment that the service knows by name, with these parameters; returns a ``CommandReply``.

        The answer comes after the dry run, before anything moves. Follow the run with ``events`` or ``states``. Raises
        ``Refused`` with the reason, or ``NoAnswer``.
        """
        request = messages.RunRequest(
            experiment=experiment, parameters_json=json.dumps(parameters), seed=seed, who=_who()
        )
        return self._command("run", request, timeout_s)

    def pause(self, reason: str = "", timeout_s: float = 5.0):
        """Holds the run after its present step. Raises ``Refused``, ``NoAnswer``."""
        return self._command("pause", messages.CommandRequest(who=_who(), reason=reason), timeout_s)

    def resume(self, reason: str = "", covering_mm: float | None = None, timeout_s: float = 5.0):
        """Continues a run that is held. ``covering_mm`` confirms the covering that the run waits for, once it is in place.

        Raises ``Refused``, ``NoAnswer``.
        """
        request = messages.CommandRequest(who=_who(), reason=reason, covering_mm=covering_mm)
        return self._command("resume", request, timeout_s)

    def stop(self, reason: str = "", abort: bool = False, timeout_s: float = 5.0):
        """Stops motion now, retracts, ends the run; has priority over all else. Raises ``NoAnswer``, ``Refused``."""
        return self._command("stop", messages.CommandRequest(who=_who(), reason=reason, abort=abort), timeout_s)

    def reset(self, timeout_s: float = 120.0):
        """Clears the stage's alarm, homes it, lets runs start. Refused in a run. Raises ``Refused``, ``NoAnswer``."""
        return self._command("reset", messages.CommandRequest(who=_who()), timeout_s)

    def close(self) -> None:
        """Closes the connection; streams end."""
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
        raise NoAnswer(f"no answer to {key} (waited at most {timeout_s} s): the rig's service is gone or busy")


def _reach(endpoint: str) -> None:
    """Tests with a plain connection whether anything listens. zenoh would need seconds for this."""
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
        # Do not search for other peers, and do not announce this one.
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
        # The user has no name, or the system has no users.
        return "python"
