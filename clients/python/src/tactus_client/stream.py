"""Messages of one topic, in order."""

from __future__ import annotations

import threading
import time
import weakref
from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Generic, Optional, TypeVar

import zenoh
import zenoh.ext

from tactus_client import messages
from tactus_client.merge import Merge, Numbered

if TYPE_CHECKING:
    from typing_extensions import Self

#: How long to wait for past messages. Those that arrive later are not used.
PAST_TIMEOUT_S = 10.0
#: Time between two looks at whether a service has announced itself.
ANNOUNCED_S = 0.05


M = TypeVar("M")
#: Tells whether a session on the bus speaks for the rig; None while none does.
Believes = Callable[[str], Optional[bool]]


class Stream(Generic[M]):
    """Iterates over the messages of one topic, and waits for each.

    A lost message is fetched again if the service still keeps it. At most ``capacity`` messages wait to be read.
    If there are more, the oldest is dropped and counted in ``overrun``.
    """

    def __init__(self, session: zenoh.Session, key: str, message_class: Any, history: int | None, capacity: int, believes: Believes):
        """``history``: the number of past messages to start with; None for all that the service keeps."""
        self._believes = believes
        self._message_class = message_class
        self._encoding = messages.encoding(message_class)
        self._capacity = capacity
        self._arrived: deque[Any] = deque()
        self._changed = threading.Condition()
        self._closed = False
        self._merge = Merge(self._keep)
        #: Messages dropped because they were read too slowly.
        self.overrun = 0
        #: Messages that did not have the topic's type.
        self.unreadable = 0
        #: Messages that were not from the rig's service.
        self.foreign = 0
        # ``$*`` matches no other key. Zenoh gives a key without a wild card a number, and a service with access control may
        # crash when a client that has given one connects or leaves (zenoh 1.10.2).
        # Direct: an indirect callback has a thread, for whose end Python waits before it lets anybody close the session. Weak: a
        # stream that nobody has any more ends.
        hear, end = weakref.WeakMethod(self._hear), weakref.WeakMethod(self._end)
        callback: Any = zenoh.handlers.Callback(lambda sample: _call(hear, sample), lambda: _call(end), indirect=False)
        self._subscriber: Any = zenoh.ext.declare_advanced_subscriber(
            session,
            f"{key}$*",
            callback,
            recovery=zenoh.ext.RecoveryConfig(heartbeat=True, periodic_queries=None),
        )
        # Request the past only after subscribing, so that no message is lost in between.
        past = [_numbered(sample) for sample in past_samples(session, key, history)]
        with self._changed:
            self._merge.join(past)

    def receive(self, timeout_s: float | None = None) -> M | None:
        """The next message; None once the stream is closed, or after ``timeout_s`` seconds without one."""
        deadline = None if timeout_s is None else time.monotonic() + timeout_s
        while True:
            with self._changed:
                while not self._arrived or (is_own := self._is_own(self._arrived[0])) is None:
                    left_s = None if deadline is None else deadline - time.monotonic()
                    if self._closed or (left_s is not None and left_s <= 0):
                        return None
                    # A service that has just come back may be heard before it has announced itself.
                    self._changed.wait(left_s if not self._arrived else ANNOUNCED_S)
                sample = self._arrived.popleft()
            if not is_own:
                self.foreign += 1
                continue
            message: M | None = self._decode(sample)
            if message is not None:
                return message

    def close(self) -> None:
        """Stops listening; messages that have arrived can still be read."""
        self._end()
        with self._changed:
            subscriber, self._subscriber = self._subscriber, None
        if subscriber is not None:
            subscriber.undeclare()

    def __iter__(self) -> Self:
        return self

    def __next__(self) -> M:
        message = self.receive()
        if message is None:
            raise StopIteration
        return message

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _is_own(self, sample: Any) -> bool | None:
        source = sample.source_info
        return False if source is None else self._believes(str(source.source_id.zid))

    def _decode(self, sample: Any) -> M | None:
        try:
            if str(sample.encoding) == self._encoding:
                message: M = self._message_class.FromString(sample.payload.to_bytes())
                return message
        except messages.DecodeError:
            pass
        self.unreadable += 1
        return None

    def _hear(self, sample: Any) -> None:
        with self._changed:
            self._merge.present(_numbered(sample))

    def _keep(self, sample: Any) -> None:
        if len(self._arrived) == self._capacity:
            self._arrived.popleft()
            self.overrun += 1
        self._arrived.append(sample)
        self._changed.notify()

    def _end(self) -> None:
        with self._changed:
            self._closed = True
            self._changed.notify_all()


def _call(method: weakref.WeakMethod[Any], *arguments: Any) -> None:
    alive = method()
    if alive is not None:
        alive(*arguments)


def past_samples(session: zenoh.Session, key: str, history: int | None) -> list[Any]:
    """The messages that the topic's publishers still keep. Each answers on one of zenoh's keys below the topic."""
    limit = "" if history is None else f"?_max={history}"
    replies = session.get(
        f"{key}/@adv/pub/**{limit}",
        target=zenoh.QueryTarget.ALL,
        consolidation=zenoh.ConsolidationMode.NONE,
        accept_replies=zenoh.ReplyKeyExpr.ANY,
        timeout=PAST_TIMEOUT_S,
    )
    return [reply.ok for reply in replies if reply.ok is not None]


def _numbered(sample: Any) -> Numbered:
    source = sample.source_info
    if source is None:
        return Numbered(None, None, sample)
    return Numbered((str(source.source_id.zid), source.source_id.eid), source.source_sn, sample)
