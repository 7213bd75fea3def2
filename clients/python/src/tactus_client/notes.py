"""What people write about a run: tags and a note, in ``notes.toml`` beside its recording, which is never changed."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tactus_client.errors import UnreadableNotes

#: Name of the file beside the recording; ``tactus runs tag`` and the dashboard write the same.
NAME = "notes.toml"


@dataclass(frozen=True)
class Notes:
    """Tags and note of a run."""

    tags: tuple[str, ...] = ()
    note: str = ""


def read(recording: Path) -> Notes:
    """The notes of a recording; none if nobody wrote any."""
    path = recording.with_name(NAME)
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        return Notes()
    except UnicodeDecodeError as error:
        raise UnreadableNotes(f"{path}: {error}") from error
    values = _parsed(path, text)
    tags, note = values.pop("tags", []), values.pop("note", "")
    is_right = isinstance(note, str) and isinstance(tags, list) and all(isinstance(tag, str) for tag in tags)
    if values or not is_right:
        raise UnreadableNotes(f"{path}: it should have a list of texts, tags, and a text, note, and nothing else")
    return Notes(tuple(tags), note)


def write(recording: Path, tags: Iterable[str], note: str) -> None:
    """Puts these tags and this note in the place of those of a recording."""
    words = sorted(set(map(_tag, [tags] if isinstance(tags, str) else tags)))
    if not isinstance(note, str):
        raise TypeError(f"a note is a text, not {type(note).__name__}")
    text = f"tags = [{', '.join(map(_quoted, words))}]\nnote = {_quoted(note)}\n"
    path = recording.with_name(NAME)
    part = path.with_name(f"notes.{os.getpid()}.part")
    try:
        part.write_text(text, encoding="utf-8", newline="")
        part.replace(path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise


def _parsed(path: Path, text: str) -> dict[str, Any]:
    if sys.version_info >= (3, 11):
        import tomllib
    else:
        import tomli as tomllib
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise UnreadableNotes(f"{path}: {error}") from error


def _tag(word: str) -> str:
    if not isinstance(word, str):
        raise TypeError(f"a tag is a word, not {type(word).__name__}")
    if not word or any(letter.isspace() or not letter.isprintable() for letter in word):
        raise ValueError(f"{word!r}: a tag is one word")
    return word


def _quoted(text: str) -> str:
    """As a basic string of TOML: that of JSON, but for one letter."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
