"""Errors between client and service."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tactus_client import messages
    from tactus_client.run import Result


class TactusError(Exception):
    """Any error of this package."""


class NoService(TactusError, ConnectionError):
    """Nothing listens at the endpoint, or the listener is not a Tactus service."""


class NoRig(TactusError):
    """No rig is ready at the endpoint, or several are ready and none was named."""


class NoAnswer(TactusError, TimeoutError):
    """The service did not answer a command in time, or went away."""


class Refused(TactusError):
    """The service refused a command.

    ``str()`` gives the reason and what to do; ``reply`` is the whole ``CommandReply``, ``exit_code`` its code.
    """

    def __init__(self, reply: messages.CommandReply):
        super().__init__(reply.error)
        self.reply = reply
        self.exit_code = reply.exit_code


class RunFailed(TactusError):
    """A run ended without doing what it should. ``str()`` says why; ``result`` is how it ended, with the path of its recording."""

    def __init__(self, result: Result):
        super().__init__(
            f"run {result.run_id} was {result.exit_status}: {result.message}"
            if result.message
            else f"run {result.run_id}: {result.exit_status}"
        )
        self.result = result


class RunStopped(RunFailed):
    """Somebody stopped the run."""


class RunAborted(RunFailed):
    """Somebody ended the run at once."""


class RunRefused(RunFailed):
    """The safety supervisor ended the run, or a step was outside the rig's envelope."""


class UnknownRun(TactusError, LookupError):
    """No run has that id or part of an id, or several have it."""


class UnreadableNotes(TactusError, ValueError):
    """The file with the tags and the note of a run is not one."""


class UnreadableRecording(TactusError, ValueError):
    """The file is not the recording of a run, or is damaged at its start."""
