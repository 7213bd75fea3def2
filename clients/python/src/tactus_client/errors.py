"""Errors between client and service."""

from __future__ import annotations


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

    def __init__(self, reply):
        super().__init__(reply.error)
        self.reply = reply
        self.exit_code = reply.exit_code
