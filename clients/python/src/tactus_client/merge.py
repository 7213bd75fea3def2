"""Joins the past and live messages of a topic: each message once and in order."""

from __future__ import annotations

from collections.abc import Hashable, Iterable
from typing import Any, Callable, NamedTuple


class Numbered(NamedTuple):
    """One message as it arrived."""

    #: Who published it.
    publisher: Hashable
    #: The publisher's own count of its messages, 32 bits; None if it does not count.
    number: int | None
    item: Any


class Merge:
    """Joins past and live messages and passes each message on.

    The two arrive on different paths and overlap. The merge of zenoh's advanced subscriber is not used: if asked
    for both history and recovery, it may pass a live message on first and then discard the past as outdated.
    """

    def __init__(self, pass_on: Callable[[Any], None]):
        self._pass_on = pass_on
        self._last: dict[Hashable, int] = {}
        self._held: list[Numbered] | None = []

    def present(self, message: Numbered) -> None:
        """Takes a live message; holds it back until the past has arrived."""
        if self._held is None:
            self._pass(message)
        else:
            self._held.append(message)

    def join(self, past: Iterable[Numbered]) -> None:
        """Takes the whole past, in order."""
        held, self._held = self._held or [], None
        for message in [*past, *held]:
            self._pass(message)

    def _pass(self, message: Numbered) -> None:
        if message.number is not None:
            last = self._last.get(message.publisher)
            # Numbers wrap around; a number in the half before the last one is old.
            if last is not None and not 0 < (message.number - last) % 2**32 < 2**31:
                return
            self._last[message.publisher] = message.number
        self._pass_on(message.item)
