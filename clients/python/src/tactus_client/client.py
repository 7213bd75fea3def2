"""A connection to one rig's service."""

from __future__ import annotations

import getpass
import json
import os
import re
import socket
import weakref
from pathlib import Path
from typing import TYPE_CHECKING, Any

import zenoh

from tactus_client import messages
from tactus_client.errors import NoAnswer, NoRig, NoService, Refused
from tactus_client.experiments import Experiment, Experiments, Plan, request_of
from tactus_client.frames import FrameStream
from tactus_client.lease import Lease
from tactus_client.run import Run
from tactus_client.services import Services
from tactus_client.status import Status
from tactus_client.stopping import stop_by_datagram
from tactus_client.stream import Stream, past_samples

if TYPE_CHECKING:
    from tactus_client.recording import Runs

#: Where the installed service of this machine listens for the members of its group.
INSTALLED = "/run/tactus/bus.sock"
#: How long to wait for a machine that does not answer at all.
REACH_TIMEOUT_S = 2.0
#: Number of events that may wait to be read: twice what the service keeps.
EVENT_CAPACITY = 131_072


def connect(endpoint: str | None = None, rig: str | None = None) -> Client:
    """Connects to the service at ``endpoint``, ``tcp/HOST:PORT`` or ``unixsock-stream/PATH``.

    Without one it is ``TACTUS_ENDPOINT`` of the environment, else the socket of the installed service of this machine if there is one,
    else ``tcp/127.0.0.1:7447``.

    Without ``rig`` it is ``TACTUS_RIG`` of the environment, else the only rig of the service that listens there or, if that is a router,
    the only rig that is ready.

    Raises ``NoService`` at once if nothing listens there, ``NoRig`` if no rig is ready, or if several are ready and
    none was named, and ``ValueError`` if the endpoint or the rig's name is not valid.
    """
    rig = os.environ.get("TACTUS_RIG") or None if rig is None else rig
    _check_rig_name(rig)
    endpoint = _of_this_machine() if endpoint is None else endpoint
    _reach(endpoint)
    try:
        session = zenoh.open(_config(endpoint))
    except zenoh.ZError as error:
        raise NoService(f"the program at {endpoint} does not answer as a Tactus service: {error}") from error
    try:
        services = Services(session)
        rig = rig or _the_rig(services, endpoint)
        if services.is_ambiguous(rig):
            raise NoRig(
                f"several programs at {endpoint} say that they are the service of rig {rig}: "
                "give each rig a name of its own; until then, connect to its service itself"
            )
        return Client(session, rig, services, endpoint)
    except BaseException:
        session.close()  # type: ignore[no-untyped-call]
        raise


def stop(
    endpoint: str | None = None, rig: str | None = None, *, reason: str = "", abort: bool = False, timeout_s: float = 5.0
) -> messages.CommandReply:
    """Stops every rig that the service at ``endpoint`` reaches, or the one of that name; the fastest way to stop.

    ``TACTUS_RIG`` does not narrow it. It needs no connection where the service is on this machine. Returns the ``CommandReply`` of a
    service. Raises ``NoAnswer`` if none answered: then nothing is known.
    """
    _check_rig_name(rig)
    endpoint = _of_this_machine() if endpoint is None else endpoint
    request = messages.CommandRequest(who=_who(), reason=reason, abort=abort)
    answer = stop_by_datagram(endpoint, rig, request, timeout_s)
    if answer is not None:
        return _done(answer)
    _reach(endpoint)
    session = zenoh.open(_config(endpoint))
    try:
        key = f"tactus/{rig}/cmd/stop" if rig else "tactus/stop"
        replies = _get(session, key, request, timeout_s)
        # The stop is on its way; only now it is asked who speaks for which rig.
        services = Services(session)
        return _done(_answer(replies, services, rig, key, timeout_s))
    finally:
        session.close()  # type: ignore[no-untyped-call]


class Client:
    """A connection to one rig's service; made by ``connect``. Close it, or use it in a ``with`` statement."""

    def __init__(self, session: zenoh.Session, rig: str, services: Services, endpoint: str):
        self._session = session
        self._services = services
        self._endpoint = endpoint
        self._lease: Lease | None = None
        # Called when nobody has the client any more, and at the end of the program: zenoh's threads must not outlive Python.
        self._closing = weakref.finalize(self, session.close)
        self.rig = rig

    def frames(self, history: int | None = None) -> FrameStream:
        """Past frames, then live ones.

        Starts with the last ``history`` frames, or with all that the service keeps (a minute at 30 Hz) if None.
        """
        info = self.sensor_info()
        shape = (info.rows, info.cols) if info else None
        return FrameStream(self._session, self._key("sensor/frame"), history, shape, self._believes)

    def events(self, history: int | None = None) -> Stream[messages.RunEvent]:
        """Events of runs (``RunEvent``), past ones first, as in ``frames``. The service keeps the last 16,384."""
        return Stream(self._session, self._key("run/event"), messages.RunEvent, history, EVENT_CAPACITY, self._believes)

    def states(self) -> Stream[messages.RunState]:
        """States of the run (``RunState``): the present one, then each new one."""
        return Stream(self._session, self._key("run/state"), messages.RunState, 1, 1_024, self._believes)

    def stage_states(self, history: int | None = 1) -> Stream[messages.StageState]:
        """What the stage reports (``StageState``): the last report, then each new one."""
        return Stream(self._session, self._key("stage/state"), messages.StageState, history, 9_000, self._believes)

    def sensor_info(self) -> messages.SensorInfo | None:
        """The sensor's last description of itself (``SensorInfo``); None if no sensor has connected yet."""
        samples = past_samples(self._session, self._key("sensor/info"), 1)
        samples = [sample for sample in samples if sample.source_info and self._believes(str(sample.source_info.source_id.zid))]
        return messages.SensorInfo.FromString(samples[-1].payload.to_bytes()) if samples else None

    def lease(self, take_over: str | None = None) -> Lease:
        """Takes the lease for several commands, in a ``with`` statement, and keeps it.

        Run, pause, resume and reset want it, and take it for themselves if the client does not have it. With a reason
        it is taken from whoever has it. Raises ``Refused`` if another client has it, ``NoAnswer``.
        """
        self._lease = Lease(self._command, _who(), take_over)
        return self._lease

    def status(self, timeout_s: float = 5.0) -> Status:
        """What the service is doing. Raises ``NoAnswer``, ``Refused``."""
        return Status(self._command("status", messages.CommandRequest(who=_who()), timeout_s))

    def experiments(self, timeout_s: float = 10.0) -> Experiments:
        """The experiments that the service knows, by name, with their parameters. Raises ``NoAnswer``, ``Refused``."""
        reply = self._command("experiments", messages.CommandRequest(who=_who()), timeout_s)
        return Experiments({one.name: Experiment.of(one) for one in reply.experiments})

    def plan(self, experiment: str | os.PathLike[str], /, *, seed: int | None = None, timeout_s: float = 300.0, **parameters: Any) -> Plan:
        """Does an experiment on the simulated twin of the rig, as ``run`` would; nothing moves, and no lease is wanted.

        Raises ``Refused`` if there is no such experiment or parameter, ``NoAnswer``.
        """
        fields = request_of(experiment, seed, parameters)
        reply = self._command("plan", messages.RunRequest(who=_who(), **fields), timeout_s)
        return Plan.of(fields["experiment"], reply.plan)

    def run(self, experiment: str | os.PathLike[str], /, *, seed: int | None = None, timeout_s: float = 300.0, **parameters: Any) -> Run:
        """Starts an experiment that the service knows by name, or a script of this machine: ``"mine.star"``, or any ``Path``.

        Parameters are those that the script declares: truth values, numbers, texts, lists of numbers, or numpy's. This returns after
        the dry run, before anything moves; ``Run.wait`` waits for the end. Raises ``Refused`` with the reason, such as the dry run's
        verdict or who has the lease, or ``NoAnswer``.
        """
        states = self.states()
        try:
            reply = self._holding("run", messages.RunRequest, request_of(experiment, seed, parameters), timeout_s)
        except BaseException:
            states.close()
            raise
        return Run(self, reply, states)

    def runs(self, folder: str | os.PathLike[str] | None = None) -> Runs:
        """The recordings of a service on this machine, in the order of their start; or those of another folder.

        Raises ``FileNotFoundError`` if the service's folder is not on this machine. Tags and notes are written only where the folder
        was named here, or is a usual one: a service cannot choose where this program writes.
        """
        from tactus_client import recording

        if folder is not None:
            return recording.runs(folder)
        told = self.status().recordings
        if not told:
            raise FileNotFoundError("the service is too old to say where it records: name the folder")
        return recording.runs_told(Path(told))

    @property
    def service(self) -> str | None:
        """Id of the rig's service, another one after each of its starts; None while it is not there."""
        return self._services.speaker(self.rig)

    def pause(self, reason: str = "", timeout_s: float = 5.0) -> messages.CommandReply:
        """Holds the run after its present step. Raises ``Refused``, ``NoAnswer``."""
        return self._holding("pause", messages.CommandRequest, {"reason": reason}, timeout_s)

    def resume(self, reason: str = "", covering_mm: float | None = None, timeout_s: float = 5.0) -> messages.CommandReply:
        """Continues a run that is held. ``covering_mm`` confirms the covering that the run waits for, once it is in place.

        Raises ``Refused``, ``NoAnswer``.
        """
        fields = {"reason": reason, "covering_mm": covering_mm}
        return self._holding("resume", messages.CommandRequest, fields, timeout_s)

    def stop(self, reason: str = "", abort: bool = False, timeout_s: float = 5.0) -> messages.CommandReply:
        """Stops motion now, retracts, ends the run; wants no lease. Raises ``NoAnswer``, ``Refused``."""
        request = messages.CommandRequest(who=_who(), reason=reason, abort=abort)
        answer = stop_by_datagram(self._endpoint, self.rig, request, timeout_s)
        return _done(answer) if answer is not None else self._command("stop", request, timeout_s)

    def reset(self, timeout_s: float = 120.0) -> messages.CommandReply:
        """Clears the stage's alarm, homes it, lets runs start. Refused in a run. Raises ``Refused``, ``NoAnswer``."""
        return self._holding("reset", messages.CommandRequest, {}, timeout_s)

    def close(self) -> None:
        """Gives the lease back and closes the connection; streams end. The end of the program does the same."""
        if self._lease is not None:
            self._lease.release()
        self._closing()

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _key(self, suffix: str) -> str:
        return f"tactus/{self.rig}/{suffix}"

    def _believes(self, instance: str) -> bool | None:
        return self._services.believes(self.rig, instance)

    def _holding(self, command: str, message_class: Any, fields: dict[str, Any], timeout_s: float) -> messages.CommandReply:
        """Sends a command with the lease, which is taken for it if the client does not have it."""
        held = self._lease
        if held is not None and held.is_held:
            return self._command(command, message_class(who=_who(), lease=held.secret, **fields), timeout_s)
        with Lease(self._command, _who(), None) as taken:
            return self._command(command, message_class(who=_who(), lease=taken.secret, **fields), timeout_s)

    def _command(self, command: str, request: Any, timeout_s: float) -> messages.CommandReply:
        key = self._key(f"cmd/{command}")
        replies = _get(self._session, key, request, timeout_s)
        return _done(_answer(replies, self._services, self.rig, key, timeout_s))


def _get(session: zenoh.Session, key: str, request: Any, timeout_s: float) -> Any:
    return session.get(
        key,
        payload=request.SerializeToString(),
        encoding=messages.encoding(type(request)),
        target=zenoh.QueryTarget.ALL,
        consolidation=zenoh.ConsolidationMode.NONE,
        congestion_control=zenoh.CongestionControl.BLOCK,
        priority=zenoh.Priority.REAL_TIME if key.endswith("/stop") else zenoh.Priority.INTERACTIVE_HIGH,
        express=True,
        timeout=timeout_s,
    )


def _answer(replies: Any, services: Services, rig: str | None, key: str, timeout_s: float) -> messages.CommandReply:
    """The first answer of a session that speaks for its rig."""
    for reply in replies:
        # Errors come from zenoh itself: a timeout, or a service that went away.
        if reply.ok is not None and reply.replier_id is not None:
            answer = messages.CommandReply.FromString(reply.ok.payload.to_bytes())
            if services.believes(rig or answer.rig, str(reply.replier_id.zid)):
                return answer
    raise NoAnswer(f"no answer to {key} (waited at most {timeout_s} s): the rig's service is gone or busy")


def _done(answer: messages.CommandReply) -> messages.CommandReply:
    if not answer.ok:
        raise Refused(answer)
    return answer


def _check_rig_name(rig: str | None) -> None:
    if rig is not None and not re.fullmatch(r"[A-Za-z0-9_-]+", rig):
        # With a wildcard, a command would go to every rig on the bus.
        raise ValueError(f"rig name {rig!r}: letters, digits, '-' and '_' only")


def _of_this_machine() -> str:
    if named := os.environ.get("TACTUS_ENDPOINT"):
        return named
    return f"unixsock-stream/{INSTALLED}" if os.path.exists(INSTALLED) else "tcp/127.0.0.1:7447"


def _reach(endpoint: str) -> None:
    """Tests with a plain connection whether anything listens. zenoh would need seconds for this."""
    unix = re.fullmatch(r"unixsock-stream/(/[A-Za-z0-9._/-]+)", endpoint)
    match = re.fullmatch(r"tcp/(?:\[([0-9A-Fa-f:.%]+)\]|([^:\[\]/?#;]+)):(\d+)", endpoint)
    if unix is None and match is None:
        raise ValueError(f"endpoint {endpoint!r} should read tcp/HOST:PORT, such as tcp/127.0.0.1:7447")
    try:
        if unix is not None:
            with socket.socket(socket.AF_UNIX) as probe:
                probe.settimeout(REACH_TIMEOUT_S)
                probe.connect(unix[1])
        elif match is not None:
            socket.create_connection((match[1] or match[2], int(match[3])), REACH_TIMEOUT_S).close()
    except (OSError, OverflowError) as error:
        raise NoService(f"no service at {endpoint}: start tactusd, or name another endpoint ({error})") from error


def _config(endpoint: str) -> zenoh.Config:
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


def _the_rig(services: Services, endpoint: str) -> str:
    ready = services.rigs()
    own = services.own_rigs()
    # Of a service of several rigs, none may take the place of one that is missing.
    rigs = own if len(own) > 1 or (own and own[0] in ready) else ready
    if not rigs:
        raise NoRig(f"a bus listens at {endpoint}, but no rig is ready on it; its service may still be starting")
    if len(rigs) > 1:
        raise NoRig(f"several rigs are served at {endpoint}: {', '.join(rigs)}; name one: connect(rig={rigs[0]!r})")
    return rigs[0]


def _who() -> str:
    try:
        return f"python:{getpass.getuser()}"
    except (OSError, KeyError, ImportError):
        # The user has no name, or the system has no users.
        return "python"
