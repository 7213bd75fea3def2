"""Recorded runs as tables: pandas, polars or xarray."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from datetime import datetime, timedelta, timezone
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

try:
    import mcap as _mcap  # noqa: F401
    import numpy as np
except ImportError as error:
    raise ImportError(f"recordings are read with numpy and mcap: pip install 'tactus-client[pandas]' ({error})") from error

from tactus_client import html, messages, notes
from tactus_client.clock import Array
from tactus_client.errors import UnknownRun
from tactus_client.scan import Contents, Head, read_contents, read_head
from tactus_client.timeline import Timeline, Zeros, phase_names

if TYPE_CHECKING:
    import pandas
    import polars
    import xarray

    from tactus_client.run import Result, Run

#: Where `tactus run` records, and where the installed service does.
FOLDERS = (Path("runs"), Path("/var/lib/tactus/runs"))
#: Folders below the folder of recordings that are searched: ``runs/<set>/<run id>``.
DEPTH_MAX = 3
#: A press within this distance of an element's centre, in pitches, is a press on that element.
CENTRE_PITCHES = 0.3
EPOCH = datetime(1970, 1, 1, tzinfo=timezone.utc)


def open(run: str | os.PathLike[str] | Run | Result, folder: str | os.PathLike[str] | None = None) -> Recording:
    """As ``tactus_client.open``."""
    if not isinstance(run, (str, os.PathLike)):
        run = run.recording
    path = Path(run)
    if path.is_dir():
        path /= "recording.mcap"
    if path.is_file():
        return Recording(path)
    if path.name != str(path) or path.suffix == ".mcap":
        raise FileNotFoundError(f"there is no recording {path}; a service on another machine keeps its recordings there")
    return _find(str(path), _folder(folder))


def runs(folder: str | os.PathLike[str] | None = None) -> Runs:
    """As ``tactus_client.runs``."""
    return Runs(_folder(folder))


def runs_told(folder: Path) -> Runs:
    """The recordings of a folder that a service named: marks are written only where the user would look anyway."""
    is_usual = any(one.is_dir() and one.resolve() == folder.resolve() for one in FOLDERS)
    if not folder.is_dir():
        raise FileNotFoundError(f"the service records in {folder}, which is not on this machine")
    return Runs(folder, is_told=not is_usual)


class Recording:
    """A recorded run. Made by ``tactus_client.open``; what it holds is read when it is first asked for.

    In tables a row is a frame and a column is an element. Times are when a frame was sampled: ``t_s`` since the run began, ``t_ns`` on
    the service's monotonic clock. Positions are the tip's in the robot's frame. The numbers are those of ``tactus export``.
    """

    def __init__(self, path: Path, is_told: bool = False):
        self.path = path
        # Its folder was named by a service, not by who uses this.
        self._is_told = is_told
        self._head: Head = read_head(path)
        run = self._head.run
        self.run_id: str = run["run_id"]
        self.experiment: str = run.get("experiment", "")
        self.who: str = run.get("who", "")
        #: True if no physical sensor was read.
        self.simulated: bool = run.get("simulated") == "true"
        #: Id of the earlier run that it goes on with, if it does.
        self.continues: str | None = run.get("continues")
        #: When it began, UTC.
        self.started: datetime = EPOCH + timedelta(microseconds=int(run.get("started_wall_ns", 0)) // 1000)
        #: The rig as `tactus.rig/1`.
        self.rig: dict[str, Any] = json.loads(self._head.attachments["rig.json"])

    @property
    def tags(self) -> list[str]:
        """Words by which runs are found again. To change them: ``run.tags += ["good"]``, or another list.

        They stand beside the recording, with the note, as ``tactus runs tag`` and the dashboard write them. Raises
        ``UnreadableNotes``; ``ValueError`` for what is no word, and ``PermissionError`` for a run of a folder that only the service named.
        """
        return list(notes.read(self.path).tags)

    @tags.setter
    def tags(self, tags: Iterable[str]) -> None:
        self._mark(tags, notes.read(self.path).note)

    @property
    def note(self) -> str:
        """What somebody wrote about the run; as ``tags``."""
        return notes.read(self.path).note

    @note.setter
    def note(self, note: str) -> None:
        self._mark(notes.read(self.path).tags, note)

    def _mark(self, tags: Iterable[str], note: str) -> None:
        if self._is_told:
            folder = self.path.parent.parent
            raise PermissionError(
                f"the service named this folder: to write beside the recording, name it, tactus_client.runs({str(folder)!r})"
            )
        notes.write(self.path, tags, note)

    @property
    def attachments(self) -> dict[str, bytes]:
        """The files that were the run's inputs, by name."""
        return self._head.attachments

    @property
    def script(self) -> str:
        """The text of the experiment's script."""
        return self._head.attachments.get(self._head.run.get("script", ""), b"").decode()

    @property
    def parameters(self) -> dict[str, Any]:
        """The parameters as the script saw them."""
        parameters: dict[str, Any] = json.loads(self._head.attachments.get("parameters.json", b"{}"))
        return parameters

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the array."""
        return self.rig["array"]["rows"], self.rig["array"]["cols"]

    @property
    def exit_status(self) -> str | None:
        """How the run ended, such as ``done`` or ``stopped``; None if the recording was never closed."""
        finished = self._finished
        return None if finished is None else messages.word_of(finished, "exit_status")

    @property
    def completeness(self) -> str:
        """``complete``, or how far the file could be read."""
        contents = self._contents
        damage = f"{contents.lost_chunks} damaged places are left out" if contents.lost_chunks else ""
        return "; ".join(filter(None, [damage, contents.cut])) or "complete"

    @property
    def warnings(self) -> list[str]:
        """What readers of the numbers should know, a sentence each; empty if there is nothing."""
        found = [] if self.completeness == "complete" else [f"the recording is {self.completeness}"]
        lacks = {self._head.run.get("script", ""), "parameters.json", "versions.json"} - set(self.attachments)
        if lacks:
            found.append(f"the recording lacks {', '.join(sorted(lacks))}: it is damaged there")
        if self.exit_status is None:
            found.append("the run has no end: its service died, or it is still in progress")
        if self.metadata["frames_missing"]:
            found.append(f"{self.metadata['frames_missing']} frames were received and are not in the recording")
        if self._contents.malformed:
            found.append(f"{self._contents.malformed} messages are malformed and left out")
        if self._contents.bad_elements:
            elements = sorted({element for bad in self._contents.bad_elements.values() for element in bad})
            found.append(
                f"in {len(self._contents.bad_elements)} frames elements were not read and stand with an earlier reading: {elements}"
            )
        return found + self._timeline.warnings

    @cached_property
    def metadata(self) -> dict[str, Any]:
        """What is known of the run as a whole, as `tactus record info` tells it."""
        frames, finished = self._contents.frames, self._finished
        # A sequence number that goes back has lost nothing.
        steps = np.diff(frames["seq"].astype(np.int64)).clip(min=1) - 1
        told = frames["lost_before"][1:].astype(np.int64)
        lost = np.maximum(steps, told)
        received = finished.frames if finished is not None else 0
        dwells = [event.dwell_done for event in self._contents.events if event.WhichOneof("event") == "dwell_done"]
        of_presses = {(dwell.press, dwell.dwell) for dwell in dwells if dwell.press >= 0}
        times = [event.t_mono_ns for event in (*self._contents.events, *self._contents.safety)]
        for column in (frames["t_mono_ns"], self._contents.stage["t_mono_ns"]):
            times += [column.min(), column.max()] if len(column) else []
        return {
            "run_id": self.run_id,
            "experiment": self.experiment,
            "rig": self._head.run.get("rig", ""),
            "who": self.who,
            "simulated": self.simulated,
            "continues": self.continues,
            "started": self.started,
            "duration_s": float(max(times) - min(times)) * 1e-9 if times else 0.0,
            "exit_status": self.exit_status,
            "message": finished.message if finished is not None else "",
            "frames": len(frames),
            "frames_lost": int(lost.sum()),
            "frames_missing": max(int((lost - told).sum()), received - len(frames), 0),
            "presses": len({press for press, _ in of_presses}),
            "dwells": len(of_presses) + sum(dwell.press < 0 for dwell in dwells),
            "parameters": self.parameters,
            "seed": next((event.started.seed for event in self._contents.events if event.WhichOneof("event") == "started"), None),
            "versions": json.loads(self._head.attachments.get("versions.json", b"{}")),
            "completeness": self.completeness,
        }

    @property
    def t_ns(self) -> Array:
        """When each frame was sampled, on the service's monotonic clock."""
        return self._timeline.t_ns

    @property
    def counts(self) -> Array:
        """Raw counts, frames x elements, as float32."""
        return self._contents.counts[self._timeline.kept]

    @cached_property
    def rise_counts(self) -> Array:
        """Counts above zero, frames x elements: above the last tare, before any the mean of the first frames before a press."""
        return self.counts - self._zeros.at(self.t_ns)

    @property
    def frames(self) -> pandas.DataFrame:
        """The measurement table in pandas: a row per frame, elements as the columns ``counts_0``, ``counts_1`` ..."""
        return self._pandas({**self._columns(), **_by_element("counts", self.counts)}, index="t_s")

    @property
    def rise(self) -> pandas.DataFrame:
        """Counts above zero in pandas: a row per frame, a column per element with its index as the name."""
        import pandas

        index = pandas.Index(self._seconds(self.t_ns), name="t_s")
        columns = pandas.RangeIndex(self.rise_counts.shape[1], name="element")
        table = pandas.DataFrame(self.rise_counts, index=index, columns=columns)
        table.attrs.update(self._attributes())
        return table

    @property
    def presses(self) -> pandas.DataFrame:
        """A row per dwell of a press in pandas: where, how deep, and each element's mean rise, ``rise_0``, ``rise_1`` ...

        ``x_mm``, ``y_mm`` are in the sensor's frame. Presses that were broken off and repeated are left out.
        """
        return self._pandas(self._dwells())

    @property
    def events(self) -> pandas.DataFrame:
        """What happened in the run, in pandas."""
        return self._pandas(self._event_columns(self._contents.events), index="t_s")

    @property
    def safety(self) -> pandas.DataFrame:
        """What the safety supervisor did, in pandas."""
        events = self._contents.safety
        return self._pandas(
            {
                "t_s": self._seconds(np.array([event.t_mono_ns for event in events], dtype=np.int64)),
                "verdict": [messages.word_of(event, "verdict") for event in events],
                "rule": [event.rule for event in events],
                "detail": [event.detail for event in events],
            },
            index="t_s",
        )

    def to_polars(self) -> polars.DataFrame:
        """The measurement table with the rises in polars, with the columns ``run`` and ``simulated``: polars keeps no attributes."""
        import polars

        columns = {"run": self.run_id, "simulated": self.simulated}
        table = {**self._columns(), **_by_element("counts", self.counts), **_by_element("rise", self.rise_counts)}
        return polars.DataFrame(table).select(*(polars.lit(value).alias(name) for name, value in columns.items()), polars.all())

    def to_xarray(self) -> xarray.Dataset:
        """Counts and rises as images: the dimensions ``time``, ``row`` and ``column``, with the elements' centres in mm."""
        import xarray

        columns = self._columns()
        images = (-1, *self.shape)
        dims = ("time", "row", "column")
        array = self.rig["array"]
        variables: dict[str, Any] = {name: ("time", column) for name, column in columns.items() if name != "t_s"}
        variables["counts"] = (dims, self.counts.reshape(images))
        variables["rise_counts"] = (dims, self.rise_counts.reshape(images))
        return xarray.Dataset(
            variables,
            coords={
                "time": ("time", columns["t_s"], {"units": "s", "long_name": "time since the run began"}),
                "row_centre_mm": ("row", array["row_centres_mm"]),
                "col_centre_mm": ("column", array["col_centres_mm"]),
            },
            attrs=self._attributes(),
        )

    def __repr__(self) -> str:
        simulated = ", SIMULATED" if self.simulated else ""
        status = self.exit_status or "never closed"
        told = self.metadata
        cut = "" if self.completeness == "complete" else f"; {self.completeness}"
        return (
            f"<Recording {self.run_id} on {told['rig']}{simulated}: {status}, {told['frames']} frames, "
            f"{told['presses']} presses, {told['duration_s']:.1f} s{cut}>"
        )

    def _repr_html_(self) -> str:
        told = self.metadata
        rows = {name: told[name] for name in ("experiment", "rig", "who", "exit_status", "message", "frames", "frames_lost")}
        rows |= {"started": f"{self.started:%Y-%m-%d %H:%M:%S} UTC", "duration": f"{told['duration_s']:.1f} s"}
        rows |= {"presses": f"{told['presses']} with {told['dwells']} dwells", "parameters": json.dumps(self.parameters)}
        peak = self.rise_counts.max(axis=0, initial=0.0).reshape(self.shape)
        image = html.image(peak, "greatest rise of each element, counts")
        return html.card(f"Run {self.run_id}", rows, self.simulated, self.warnings, image)

    @cached_property
    def _contents(self) -> Contents:
        return read_contents(self.path, self.shape[0] * self.shape[1])

    @cached_property
    def _timeline(self) -> Timeline:
        return Timeline(self._contents, self.rig)

    @cached_property
    def _zeros(self) -> Zeros:
        return Zeros(self._contents, self._timeline, self.rig)

    @property
    def _finished(self) -> Any:
        ends = [event.finished for event in self._contents.events if event.WhichOneof("event") == "finished"]
        return ends[-1] if ends else None

    def _attributes(self) -> dict[str, Any]:
        names = ("run_id", "experiment", "rig", "simulated", "exit_status", "completeness")
        told = {name: self.metadata[name] for name in names}
        # Files of arrays take neither None nor truth values.
        return {**told, "exit_status": told["exit_status"] or "", "simulated": int(self.simulated), "started": self.started.isoformat()}

    def _seconds(self, t_ns: Array) -> Array:
        """Time since the run's first event."""
        events, frames = self._contents.events, self._contents.frames
        start_ns = events[0].t_mono_ns if events else frames["t_mono_ns"][0] if len(frames) else 0
        return (t_ns - start_ns) * 1e-9

    def _columns(self) -> dict[str, Any]:
        timeline, frames = self._timeline, self._contents.frames[self._timeline.kept]
        columns: dict[str, Any] = {
            "t_s": self._seconds(timeline.t_ns),
            "t_ns": timeline.t_ns,
            "seq": frames["seq"],
            "press": timeline.press.astype(np.int32),
            "phase": phase_names(timeline.phase),
        }
        places = timeline.position_mm
        for axis, name in enumerate(("x_mm", "y_mm", "z_mm")):
            columns[name] = np.full(len(frames), np.nan) if places is None else places[:, axis]
        columns["covering_mm"] = timeline.covering_mm(timeline.t_ns)
        columns["temperature_c"] = frames["temperature_c"].astype(float)
        return {**columns, "lost_before": frames["lost_before"]}

    def _event_columns(self, events: list[Any]) -> dict[str, Any]:
        kinds = [event.WhichOneof("event") or "" for event in events]
        t_ns = np.array([event.t_mono_ns for event in events], dtype=np.int64)
        return {
            "t_s": self._seconds(t_ns),
            "t_ns": t_ns,
            "seq": [event.seq for event in events],
            "kind": kinds,
            "detail": [messages.to_dict(getattr(event, kind)) if kind else {} for event, kind in zip(events, kinds)],
        }

    def _dwells(self) -> dict[str, Any]:
        events = self._contents.events
        void = {event.press_repeated.press for event in events if event.WhichOneof("event") == "press_repeated"}
        dwells = [event.dwell_done for event in events if event.WhichOneof("event") == "dwell_done"]
        elements = self.shape[0] * self.shape[1]
        dwells = [dwell for dwell in dwells if dwell.press >= 0 and dwell.press not in void and len(dwell.mean_counts) == elements]
        means = np.array([dwell.mean_counts for dwell in dwells], dtype=np.float32).reshape(-1, elements)
        begun = np.array([dwell.from_mono_ns for dwell in dwells], dtype=np.int64)
        return {
            "press": [dwell.press for dwell in dwells],
            "dwell": [dwell.dwell for dwell in dwells],
            "element": [self._element_at(dwell.x_mm, dwell.y_mm) for dwell in dwells],
            "x_mm": [dwell.x_mm for dwell in dwells],
            "y_mm": [dwell.y_mm for dwell in dwells],
            "depth_mm": [dwell.depth_mm for dwell in dwells],
            "covering_mm": self._timeline.covering_mm(begun),
            "frames": [dwell.frames for dwell in dwells],
            "t_s": self._seconds(begun),
            "duration_s": [(dwell.to_mono_ns - dwell.from_mono_ns) * 1e-9 for dwell in dwells],
            **_by_element("rise", means - self._zeros.at(begun)),
        }

    def _element_at(self, x_mm: float, y_mm: float) -> int:
        """The element whose centre is within 0.3 pitch of a place in the sensor's frame; -1 if there is none."""
        array = self.rig["array"]
        cols, rows = np.array(array["col_centres_mm"]), np.array(array["row_centres_mm"])
        col, row = int(np.abs(cols - x_mm).argmin()), int(np.abs(rows - y_mm).argmin())
        apart = [*np.diff(cols), *np.diff(rows)]
        pitch_mm = min(apart) if apart else array["element_mm"][0]
        near = np.hypot(cols[col] - x_mm, rows[row] - y_mm) <= CENTRE_PITCHES * pitch_mm
        return row * len(cols) + col if near else -1

    def _pandas(self, columns: dict[str, Any], index: str | None = None) -> pandas.DataFrame:
        import pandas

        table = pandas.DataFrame(columns)
        table = table if index is None else table.set_index(index)
        table.attrs.update(self._attributes())
        return table


class Runs(list[Recording]):
    """Recordings in the order of their start; a table in a notebook. Made by ``tactus_client.runs``."""

    def __init__(self, folder: Path, is_told: bool = False):
        found = []
        #: Files that are not recordings of runs, and why.
        self.unreadable: dict[Path, str] = {}
        for path in _files(folder, DEPTH_MAX):
            try:
                found.append(Recording(path, is_told))
            except (OSError, ValueError) as error:
                self.unreadable[path] = str(error)
        super().__init__(sorted(found, key=lambda run: (run.started, run.run_id)))
        self.folder = folder

    def __repr__(self) -> str:
        return f"<{len(self)} runs in {self.folder}>"

    def _repr_html_(self) -> str:
        rows = [
            (
                run.run_id,
                run.experiment,
                run._head.run.get("rig", ""),
                f"{run.started:%Y-%m-%d %H:%M}",
                "SIMULATED" if run.simulated else "",
                *_marks(run),
            )
            for run in self
        ]
        return html.table(("run", "experiment", "rig", "started, UTC", "", "tags", "note"), rows)


def _marks(run: Recording) -> tuple[str, str]:
    """Tags and the note's first line; or why there are none."""
    try:
        marks = notes.read(run.path)
    except (OSError, ValueError) as error:
        return "", str(error)
    return " ".join(marks.tags), marks.note.partition("\n")[0]


def _by_element(name: str, values: Array) -> dict[str, Array]:
    return {f"{name}_{element}": values[:, element] for element in range(values.shape[1])}


def _folder(folder: str | os.PathLike[str] | None) -> Path:
    if folder is not None:
        found = Path(folder)
    else:
        found = next((one for one in FOLDERS if one.is_dir()), FOLDERS[0])
    if not found.is_dir():
        raise FileNotFoundError(
            f"there is no folder {found}: name the folder of the recordings; the installed service records in {FOLDERS[1]}"
        )
    return found


def _files(folder: Path, depth: int) -> list[Path]:
    here = sorted(folder.iterdir())
    files = [path for path in here if path.suffix == ".mcap" and path.is_file()]
    below = [path for path in here if depth > 0 and path.is_dir() and not path.is_symlink()]
    return files + [file for path in below for file in _files(path, depth - 1)]


def _find(part: str, folder: Path) -> Recording:
    """The run with this id, or the only one whose id contains it."""
    found = [run for run in runs(folder) if part and part in run.run_id]
    exact = [run for run in found if run.run_id == part]
    if len(exact or found) == 1:
        return (exact or found)[0]
    if found:
        raise UnknownRun(f"{part!r} is one of {', '.join(run.run_id for run in found)} in {folder}: which?")
    raise UnknownRun(f"no run {part!r} in {folder}; tactus_client.runs() lists them")
