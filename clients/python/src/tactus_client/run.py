"""A run in progress."""

from __future__ import annotations

import time
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from tactus_client import html, messages
from tactus_client.errors import NoAnswer, RunAborted, RunFailed, RunRefused, RunStopped
from tactus_client.progress import Progress

if TYPE_CHECKING:
    from tactus_client.client import Client
    from tactus_client.recording import Recording
    from tactus_client.stream import Stream

#: Time between two looks at whether the service is still there.
LOOK_S = 0.5

FAILURES: dict[str, type[RunFailed]] = {
    "failed": RunFailed,
    "crashed": RunFailed,
    "stopped": RunStopped,
    "aborted": RunAborted,
    "refused": RunRefused,
}


@dataclass(frozen=True)
class Result:
    """How a run ended."""

    run_id: str
    experiment: str
    #: ``done``, ``degraded`` (done, but something was lost), ``failed``, ``stopped``, ``aborted``, ``refused`` or ``crashed``.
    exit_status: str
    message: str
    presses: int
    dwells: int
    frames: int
    frames_lost: int
    duration_s: float
    #: On the service's machine.
    recording: Path
    simulated: bool

    @classmethod
    def of(cls, state: messages.RunState) -> Result:
        """From the last ``RunState`` of a run."""
        return cls(
            run_id=state.run_id,
            experiment=state.experiment,
            exit_status=messages.word_of(state, "exit_status"),
            message=state.message,
            presses=state.presses,
            dwells=state.dwells,
            frames=state.frames,
            frames_lost=state.frames_lost,
            duration_s=state.elapsed_s,
            recording=Path(state.recording),
            simulated=state.simulated,
        )

    def _repr_html_(self) -> str:
        facts = {
            "experiment": self.experiment,
            "exit status": f"{self.exit_status}: {self.message}" if self.message else self.exit_status,
            "presses": f"{self.presses} with {self.dwells} dwells",
            "frames": f"{self.frames}, {self.frames_lost} lost",
            "duration": f"{self.duration_s:.1f} s",
            "recording": self.recording,
        }
        return html.card(f"Run {self.run_id}", facts, self.simulated)


class Run:
    """A run that was started. Made by ``Client.run``."""

    def __init__(self, client: Client, reply: messages.CommandReply, states: Stream[messages.RunState]):
        self._client = client
        self._states = states
        self._service = client.service
        #: The last known ``RunState``.
        self.state: messages.RunState = reply.state
        self.run_id = reply.state.run_id
        self.experiment = reply.state.experiment
        #: What the service says besides; empty if there is nothing.
        self.note = reply.note

    @property
    def is_over(self) -> bool:
        """True if the run has ended, as far as is known now."""
        self._look(0.0)
        return self._has_ended

    @property
    def result(self) -> Result | None:
        """How it ended; None while it has not."""
        return Result.of(self.state) if self.is_over else None

    @property
    def recording(self) -> Path:
        """Path of the recording, on the service's machine."""
        return Path(self.state.recording)

    def wait(self, progress: bool = True, timeout_s: float | None = None) -> Result:
        """Waits for the end of the run, with a progress bar where somebody sees standard error.

        Ctrl-C stops the run, waits until the tip is up, and is then raised; a second one is raised at once, while the service goes on
        retracting. Raises ``RunFailed``, or one of its kinds ``RunStopped``, ``RunAborted`` and ``RunRefused``; ``NoAnswer`` if the service
        goes away; ``TimeoutError`` after ``timeout_s``: the run goes on then. Warns if something was lost.
        """
        with Progress(self.experiment, progress) as bar:
            try:
                self._wait(bar, timeout_s)
            except KeyboardInterrupt:
                bar.say("Ctrl-C: stopping and retracting")
                self.stop("Ctrl-C")
                self._wait(bar, None)
                raise
        result = Result.of(self.state)
        failure = FAILURES.get(result.exit_status)
        if failure is not None:
            raise failure(result)
        if result.exit_status == "degraded":
            warnings.warn(f"run {result.run_id}: {result.message}", stacklevel=2)
        return result

    def pause(self, reason: str = "") -> messages.CommandReply:
        """Holds the run after its present step. Raises ``Refused``, ``NoAnswer``."""
        return self._client.pause(reason)

    def resume(self, reason: str = "", covering_mm: float | None = None) -> messages.CommandReply:
        """Continues it: see ``Client.resume``."""
        return self._client.resume(reason, covering_mm)

    def stop(self, reason: str = "", abort: bool = False) -> messages.CommandReply:
        """Stops motion now, retracts, ends the run; wants no lease. Raises ``NoAnswer``, ``Refused``."""
        return self._client.stop(reason, abort)

    def open(self) -> Recording:
        """Opens the recording, if the service is on this machine."""
        from tactus_client import recording

        return recording.open(self)

    def __repr__(self) -> str:
        self._look(0.0)
        status = messages.word_of(self.state, "exit_status" if self._has_ended else "phase")
        simulated = ", SIMULATED" if self.state.simulated else ""
        return f"<Run {self.run_id}{simulated}: {status}, {self.state.presses} of {self.state.presses_planned} presses>"

    def _repr_html_(self) -> str:
        self._look(0.0)
        state = self.state
        if self._has_ended:
            return Result.of(state)._repr_html_()
        facts = {
            "experiment": state.experiment,
            "phase": messages.word_of(state, "phase"),
            "presses": f"{state.presses} of {state.presses_planned}",
            "frames": f"{state.frames}, {state.frames_lost} lost",
        }
        return html.card(f"Run {state.run_id}", facts, state.simulated, filter(None, [state.message, state.fault]))

    @property
    def _has_ended(self) -> bool:
        return messages.word_of(self.state, "phase") == "finished"

    def _wait(self, bar: Progress, timeout_s: float | None) -> None:
        until = None if timeout_s is None else time.monotonic() + timeout_s
        while not self._has_ended:
            bar.show(self.state)
            left_s = LOOK_S if until is None else min(LOOK_S, until - time.monotonic())
            if left_s <= 0:
                raise TimeoutError(f"run {self.run_id} is not over after {timeout_s} s; it goes on")
            # A service that comes back does not have its run.
            if not self._look(left_s) and self._client.service != self._service:
                raise NoAnswer(f"the service disappeared during run {self.run_id}; `tactus status` shows whether it is back")

    def _look(self, timeout_s: float) -> bool:
        """Takes the states that have come; True if there were any."""
        has_news = False
        while not self._has_ended and (state := self._states.receive(0.0 if has_news else timeout_s)) is not None:
            has_news = True
            if state.run_id == self.run_id:
                self.state = state
        if self._has_ended:
            self._states.close()
        return has_news
