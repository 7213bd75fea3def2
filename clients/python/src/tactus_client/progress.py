"""A progress bar on standard error."""

from __future__ import annotations

import sys

from tactus_client import messages

WIDTH = 24


class Progress:
    """Shows the state of a run in one line, which is gone at the end; nothing where nobody sees it."""

    def __init__(self, title: str, is_wanted: bool):
        self._title = title
        self._is_shown = is_wanted and (sys.stderr.isatty() or _is_notebook())
        self._length = 0

    def show(self, state: messages.RunState) -> None:
        """Draws a ``RunState``."""
        # By dwells, of which a press may have many.
        done, planned = (state.dwells, state.dwells_planned) if state.dwells_planned else (state.presses, state.presses_planned)
        filled = WIDTH * min(done, planned) // planned if planned else 0
        left = f", {_minutes(state.remaining_s)} left" if state.remaining_s >= 0 and planned else ""
        simulated = " SIMULATED" if state.simulated else ""
        phase = messages.word_of(state, "phase")
        held = f" {phase}" if phase != "running" else ""
        told = f" - {state.message}" if state.message else ""
        presses = f"{state.presses}/{state.presses_planned} presses"
        self._draw(f"{self._title} [{'#' * filled}{'.' * (WIDTH - filled)}] {presses}{left}{held}{simulated}{told}")

    def say(self, text: str) -> None:
        """A line that stays; also where the bar is not shown."""
        self._clear()
        print(text, file=sys.stderr, flush=True)

    def __enter__(self) -> Progress:
        return self

    def __exit__(self, *_: object) -> None:
        self._clear()

    def _draw(self, line: str) -> None:
        if self._is_shown:
            sys.stderr.write("\r" + line.ljust(self._length))
            sys.stderr.flush()
            self._length = len(line)

    def _clear(self) -> None:
        if self._length:
            self._draw("")
            sys.stderr.write("\r")
            sys.stderr.flush()


def _is_notebook() -> bool:
    """True in a kernel of a notebook, whose standard error is no terminal but shows lines."""
    ipython = sys.modules.get("IPython")
    return ipython is not None and hasattr(ipython.get_ipython(), "kernel")


def _minutes(seconds: float) -> str:
    return f"{int(seconds) // 60}:{int(seconds) % 60:02}"
