"""Which sessions on the bus speak for a rig."""

from __future__ import annotations

import re
import threading

import zenoh

#: The keys of both tokens. `tactus/**`, which matches all keys of all rigs, would cost a service of many rigs much.
ANNOUNCEMENTS = ("tactus/*/alive", "tactus/*/service/*")
#: Nobody has such a key.
NOBODY = "tactus/nobody$*"
#: How long to wait for services to announce themselves.
ROLL_CALL_TIMEOUT_S = 3.0


class Services:
    """The services that are announced on the bus, kept up to date.

    A service announces the id of its session from its start. The first announced session speaks for its rig, until it
    ends; a session at the other end of our own connection goes before. Answers and messages of others are not the rig's.
    """

    def __init__(self, session: zenoh.Session):
        self._lock = threading.Lock()
        self._ready: set[str] = set()
        self._running: list[tuple[str, str]] = []
        self._believed: list[tuple[str, str]] = []
        # Direct: an indirect callback could still be on its way when the query below has ended.
        hear = zenoh.handlers.Callback(self._on_token, indirect=False)
        listen = session.liveliness().declare_subscriber
        self._subscribers = [listen(key, hear, history=True) for key in ANNOUNCEMENTS]
        # The end of a query that was sent after the subscriptions shows that all present tokens were reported.
        for _ in session.liveliness().get(NOBODY, timeout=ROLL_CALL_TIMEOUT_S):
            pass
        self.neighbours = {str(peer) for peer in session.info.peers_zid()}
        with self._lock:
            own = [one for one in self._running if one[1] in self.neighbours]
            for rig, instance in own:
                self._believed = [one for one in self._believed if one[0] != rig]
                self._believed.append((rig, instance))

    def rigs(self) -> list[str]:
        """Names of the rigs that are ready, sorted."""
        with self._lock:
            return sorted(self._ready)

    def own_rigs(self) -> list[str]:
        """Names of the rigs, ready or not, whose service is at the other end of our connection, sorted."""
        with self._lock:
            return sorted({rig for rig, _ in self._running if self._speaker(rig) in self.neighbours})

    def is_ambiguous(self, rig: str) -> bool:
        """True if several sessions say that they are the rig's, and none of them is at the other end of our connection."""
        with self._lock:
            running = [instance for of, instance in self._running if of == rig]
            return len(running) > 1 and not self.neighbours.intersection(running)

    def believes(self, rig: str, instance: str) -> bool | None:
        """True if the session speaks for the rig; None while none does."""
        with self._lock:
            return self._believes(rig, instance)

    def speaker(self, rig: str) -> str | None:
        """The session that speaks for the rig; None while none does."""
        with self._lock:
            return self._speaker(rig)

    def _believes(self, rig: str, instance: str) -> bool | None:
        if (rig, instance) in self._believed:
            return True
        return None if self._speaker(rig) is None else False

    def _speaker(self, rig: str) -> str | None:
        running = [one for one in self._believed if one[0] == rig and one in self._running]
        return running[-1][1] if running else None

    def _on_token(self, sample: zenoh.Sample) -> None:
        is_there = sample.kind == zenoh.SampleKind.PUT
        key = str(sample.key_expr)
        with self._lock:
            if match := re.fullmatch(r"tactus/([^/]+)/alive", key):
                (self._ready.add if is_there else self._ready.discard)(match[1])
            elif match := re.fullmatch(r"tactus/([^/]+)/service/([0-9a-f]+)", key):
                one = (match[1], match[2])
                if is_there and one not in self._running:
                    self._running.append(one)
                elif not is_there and one in self._running:
                    self._running.remove(one)
                if self._speaker(match[1]) is None:
                    first = next((other for other in self._running if other[0] == match[1]), None)
                    if first:
                        self._believed.append(first)
