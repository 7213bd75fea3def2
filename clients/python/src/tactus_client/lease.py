"""The lease: who holds it commands the rig; all others can read and stop."""

from __future__ import annotations

import atexit
import threading
from collections.abc import Callable
from typing import Any

from tactus_client import messages
from tactus_client.errors import NoAnswer, Refused

#: Time between two renewals: a lease without one ends after 5 s.
RENEWAL_S = 1.5
#: How long to wait for the service when the lease is given back: it ends by itself.
RELEASE_TIMEOUT_S = 1.0
#: Exit code of a client that does not hold the lease.
NOT_HOLDER = 5


class Lease:
    """The lease, renewed until it is released. Made by ``Client.lease``; use it in a ``with`` statement."""

    def __init__(self, command: Callable[[str, Any, float], messages.CommandReply], who: str, take_over: str | None):
        self._command = command
        self._who = who
        action = "LEASE_ACTION_ACQUIRE" if take_over is None else "LEASE_ACTION_TAKE_OVER"
        self.secret: bytes = self._ask(action, reason=take_over or "").lease.lease
        #: Why the service no longer accepts the lease; None while it does.
        self.lost: str | None = None
        self._released = threading.Event()
        self._keeping = threading.Thread(target=self._keep, name="tactus-lease", daemon=True)
        self._keeping.start()
        atexit.register(self.release)

    @property
    def is_held(self) -> bool:
        """True until it is released or lost."""
        return self.lost is None and not self._released.is_set()

    def release(self) -> None:
        """Gives the lease back, so that others need not wait until it ends."""
        if self._released.is_set():
            return
        self._released.set()
        atexit.unregister(self.release)
        self._keeping.join(RELEASE_TIMEOUT_S)
        if self.lost is None:
            try:
                self._ask("LEASE_ACTION_RELEASE", RELEASE_TIMEOUT_S, lease=self.secret)
            except (NoAnswer, Refused):
                # It ends by itself.
                pass

    def __enter__(self) -> Lease:
        return self

    def __exit__(self, *_: object) -> None:
        self.release()

    def _ask(self, action: str, timeout_s: float = 3.0, **fields: Any) -> messages.CommandReply:
        return self._command("lease", messages.LeaseRequest(action=action, who=self._who, **fields), timeout_s)

    def _keep(self) -> None:
        while not self._released.wait(RENEWAL_S):
            try:
                self._ask("LEASE_ACTION_RENEW", lease=self.secret)
            except Refused as refused:
                if refused.exit_code == NOT_HOLDER:
                    self.lost = str(refused)
                    return
            except NoAnswer:
                # The service may be restarting.
                pass
