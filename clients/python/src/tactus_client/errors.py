"""What can go wrong between client and service."""

from __future__ import annotations


class TactusError(Exception):
    """Any error of this package."""


class NoService(TactusError, ConnectionError):
    """Nothing listens at the endpoint, or not a Tactus service."""


class NoRig(TactusError):
    """No rig is ready at the endpoint, or several are and none was named."""


class NoAnswer(TactusError, TimeoutError):
    """The service did not answer a command in time, or went away."""


class Refused(TactusError):
    """The service answered a command with no.

    ``str()`` says why and what to do about it; ``reply`` is the whole ``CommandReply``, ``exit_code`` its code.
    """

    def __init__(self, reply):
        super().__init__(reply.error)
        self.reply = reply
        self.exit_code = reply.exit_code
