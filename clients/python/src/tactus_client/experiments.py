"""What the service can run, and what a dry run found."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tactus_client import html, messages


@dataclass(frozen=True)
class Parameter:
    """A parameter of an experiment, as its script declares it with ``param()``."""

    name: str
    #: ``bool``, ``int``, ``float``, ``string``, ``list-of-int`` or ``list-of-float``.
    kind: str
    default: Any
    doc: str
    unit: str | None
    #: The only values allowed; any if there are none.
    choices: tuple[Any, ...]
    min: float | None
    max: float | None

    @classmethod
    def of(cls, message: messages.Parameter) -> Parameter:
        """A ``tactus.v1.Parameter`` as an object."""

        def given(name: str) -> Any:
            return getattr(message, name) if message.HasField(name) else None

        choices = tuple(json.loads(choice) for choice in message.choices_json)
        default = json.loads(message.default_json)
        return cls(message.name, message.kind, default, message.doc, given("unit"), choices, given("min"), given("max"))


@dataclass(frozen=True)
class Experiment:
    """A script that the service knows by name."""

    name: str
    doc: str
    parameters: tuple[Parameter, ...]
    #: Why its parameters are not known; empty if they are.
    error: str

    @classmethod
    def of(cls, message: messages.Experiment) -> Experiment:
        """A ``tactus.v1.Experiment`` as an object."""
        return cls(message.name, message.doc, tuple(map(Parameter.of, message.parameters)), message.error)

    def _repr_html_(self) -> str:
        rows = [(one.name, one.kind, json.dumps(one.default), one.unit, one.doc) for one in self.parameters]
        summary = html.card(self.name, {"": self.doc.partition("\n")[0]} | ({"error": self.error} if self.error else {}), False)
        return summary + html.table(("parameter", "kind", "default", "unit", "meaning"), rows)


class Experiments(dict[str, Experiment]):
    """Experiments by name; a table in a notebook."""

    def _repr_html_(self) -> str:
        rows = [(one.name, " ".join(p.name for p in one.parameters), one.error or one.doc.partition("\n")[0]) for one in self.values()]
        return html.table(("experiment", "parameters", "what it does"), rows)


@dataclass(frozen=True)
class Plan:
    """What a dry run on the simulated twin of the rig found; nothing has moved."""

    experiment: str
    #: How the dry run ended: the rig can do the experiment if it is ``done``.
    exit_status: str
    #: Why it cannot; empty if it can.
    message: str
    presses: int
    dwells: int
    duration_s: float
    #: Greatest depth that is commanded, and that the envelope allows.
    deepest_mm: float
    depth_max_mm: float
    #: Least and greatest x, y and z in the robot's frame; empty if nothing moves.
    travel_mm: tuple[float, ...]
    seed: int
    #: All parameters as the script sees them.
    parameters: dict[str, Any]

    @property
    def is_possible(self) -> bool:
        """True if the rig can do it."""
        return self.exit_status == "done"

    @classmethod
    def of(cls, experiment: str, message: messages.Plan) -> Plan:
        """A ``tactus.v1.Plan`` as an object."""
        return cls(
            experiment=experiment,
            exit_status=messages.word_of(message, "exit_status"),
            message=message.message,
            presses=message.presses,
            dwells=message.dwells,
            duration_s=message.duration_s,
            deepest_mm=message.deepest_mm,
            depth_max_mm=message.depth_max_mm,
            travel_mm=tuple(message.travel_mm),
            seed=message.seed,
            parameters=json.loads(message.parameters_json or "{}"),
        )

    def _repr_html_(self) -> str:
        facts = {
            "verdict": "possible" if self.is_possible else f"{self.exit_status}: {self.message}",
            "presses": f"{self.presses} with {self.dwells} dwells",
            "duration": f"{self.duration_s:.0f} s",
            "deepest": f"{self.deepest_mm:.3f} mm of {self.depth_max_mm:.3f} mm",
            "parameters": json.dumps(self.parameters),
        }
        return html.card(f"Plan of {self.experiment}", facts, False)


def request_of(experiment: str | os.PathLike[str], seed: int | None, parameters: dict[str, Any]) -> dict[str, Any]:
    """The fields of a ``RunRequest``: a name that the service knows, or the path of a script, whose text is sent."""
    name, script = os.fspath(experiment), ""
    if name.endswith(".star") or isinstance(experiment, os.PathLike):
        script = Path(experiment).read_text(encoding="utf-8")
        name = Path(experiment).stem
    return {"experiment": name, "script": script, "parameters_json": json.dumps(parameters, default=_plain), "seed": seed}


def _plain(value: Any) -> Any:
    """Numbers and arrays of numpy, and whatever else knows itself as a list, for JSON."""
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"a parameter is a truth value, number, text or list of numbers, not {type(value).__name__}: {value!r}")
