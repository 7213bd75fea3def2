"""Reads the messages of a recording into columns, as far as the file goes."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, McapRecord, Metadata, Schema
from mcap.stream_reader import StreamReader, get_chunk_data_stream

from tactus_client import messages
from tactus_client.errors import UnreadableRecording

#: Name of the metadata record that makes an MCAP file a run's recording.
METADATA_NAME = "tactus.run"
#: No record of a recording is longer; a length beyond it is damage.
RECORD_MAX_BYTES = 64 * 1024 * 1024
#: A record's kind and length; in a message's record also channel, number and two times.
RECORD_HEAD = struct.Struct("<BQ")
MESSAGE_HEAD = struct.Struct("<HIQQ")

FRAME_COLUMNS = np.dtype(
    [
        ("seq", "u8"),
        ("epoch", "u4"),
        ("has_tick", "?"),
        ("device_tick", "u8"),
        ("t_mono_ns", "i8"),
        ("t_wall_ns", "i8"),
        ("flags", "u4"),
        ("lost_before", "u4"),
        ("simulated", "?"),
        ("tick_ns", "u8"),
    ]
)
STAGE_COLUMNS = np.dtype(
    [("t_mono_ns", "i8"), ("x_mm", "f8"), ("y_mm", "f8"), ("z_mm", "f8"), ("status", "u1"), ("simulated", "?")]
)


@dataclass(frozen=True)
class Head:
    """The start of a recording."""

    #: The metadata record of the run.
    run: dict[str, str]
    #: Attached files by name.
    attachments: dict[str, bytes]


@dataclass
class Contents:
    """The messages of a recording."""

    #: ``FRAME_COLUMNS``, in the order of arrival; counts are frames x elements.
    frames: np.ndarray[Any, Any]
    counts: np.ndarray[Any, Any]
    #: Elements that were not read, by index of the frame.
    bad_elements: dict[int, tuple[int, ...]]
    #: ``STAGE_COLUMNS``, as recorded.
    stage: np.ndarray[Any, Any]
    events: list[Any]
    safety: list[Any]
    #: Length of a device tick as last told by the sensor; 0 without a clock.
    tick_ns: int
    #: Messages that cannot be read, and frames whose counts are not one number per element; they are left out.
    malformed: int
    #: Chunks that a damaged place has made unreadable.
    lost_chunks: int
    #: Why the file could not be read to its end; empty if it could.
    cut: str


def read_head(path: Path) -> Head:
    """Reads up to the first message. Raises ``UnreadableRecording`` if the file is not the recording of a run."""
    run: dict[str, str] = {}
    attachments: dict[str, bytes] = {}
    problem = "it does not say which run it is"
    try:
        with path.open("rb") as file:
            for record in _records(file):
                if isinstance(record, Metadata) and record.name == METADATA_NAME:
                    run = dict(record.metadata)
                elif isinstance(record, Attachment):
                    attachments[record.name] = record.data
                elif isinstance(record, Chunk):
                    break
    except OSError:
        raise
    except Exception as error:
        # The reader of a damaged file may raise anything.
        problem = f"{type(error).__name__}: {error}"
    if not run.get("run_id") or "rig.json" not in attachments:
        raise UnreadableRecording(f"{path} is not the recording of a run, or is damaged at its start ({problem}); try `tactus recover`")
    return Head(run, attachments)


def read_contents(path: Path, elements: int) -> Contents:
    """Reads all messages, around chunks that are damaged, up to where the file is cut off."""
    scan = _Scan(elements)
    at_byte, cut = 0, ""
    with path.open("rb") as file:
        records = _records(file)
        while True:
            try:
                record = next(records, None)
            except OSError:
                raise
            except Exception as error:
                # The reader of a damaged file may raise anything.
                cut = f"readable up to byte {at_byte}: {_in_words(error)}"
                break
            if record is None:
                break
            scan.take(record)
            at_byte = file.tell()
    return scan.contents(cut)


def _records(file: Any) -> Iterator[McapRecord]:
    return iter(StreamReader(file, emit_chunks=True, record_size_limit=RECORD_MAX_BYTES).records)


def _in_words(error: Exception) -> str:
    text = str(error)
    return "the file ends here, without its end mark" if type(error).__name__ in ("EndOfFile", "error") else text or type(error).__name__


@dataclass
class _Scan:
    elements: int
    lost_chunks: int = 0
    malformed: int = 0
    _schemas: dict[int, str] = field(default_factory=dict)
    _kinds: dict[int, str] = field(default_factory=dict)
    _frames: list[tuple[Any, ...]] = field(default_factory=list)
    _counts: list[bytes] = field(default_factory=list)
    _bad_elements: dict[int, tuple[int, ...]] = field(default_factory=dict)
    _stage: list[tuple[Any, ...]] = field(default_factory=list)
    _events: list[Any] = field(default_factory=list)
    _safety: list[Any] = field(default_factory=list)
    _tick_ns: int = 0

    def take(self, record: McapRecord) -> None:
        if isinstance(record, Schema):
            self._schemas[record.id] = record.name.rpartition(".")[2]
        elif isinstance(record, Channel):
            self._kinds[record.id] = self._schemas.get(record.schema_id, "")
        elif isinstance(record, Chunk):
            try:
                stream, length = get_chunk_data_stream(record, validate_crc=True)
            except Exception:
                # It does not unpack, or its checksum is wrong: no message is better than a wrong one.
                self.lost_chunks += 1
            else:
                self._records(stream.read(length))

    def _records(self, data: bytes) -> None:
        """Takes the records within a chunk."""
        at = 0
        while at < len(data):
            opcode, length = RECORD_HEAD.unpack_from(data, at)
            body = at + RECORD_HEAD.size
            at = body + length
            if opcode == Opcode.MESSAGE:
                channel = MESSAGE_HEAD.unpack_from(data, body)[0]
                try:
                    self._message(self._kinds.get(channel), data[body + MESSAGE_HEAD.size : at])
                except messages.DecodeError:
                    self.malformed += 1
            elif opcode == Opcode.SCHEMA:
                self.take(Schema.read(ReadDataStream(BytesIO(data[body:at]))))
            elif opcode == Opcode.CHANNEL:
                self.take(Channel.read(ReadDataStream(BytesIO(data[body:at]))))

    def _message(self, kind: str | None, message: bytes) -> None:
        if kind == "Frame":
            self._frame(_PackedFrame.FromString(message))
        elif kind == "StageState":
            state = messages.StageState.FromString(message)
            self._stage.append((state.t_mono_ns, state.x_mm, state.y_mm, state.z_mm, state.status, state.simulated))
        elif kind == "RunEvent":
            self._events.append(messages.RunEvent.FromString(message))
        elif kind == "SafetyEvent":
            self._safety.append(messages.SafetyEvent.FromString(message))
        elif kind == "SensorInfo":
            self._tick_ns = messages.SensorInfo.FromString(message).tick_ns

    def _frame(self, frame: Any) -> None:
        counts = frame.counts
        if len(counts) != 4 * self.elements:
            self.malformed += 1
            return
        if frame.bad_elements:
            self._bad_elements[len(self._frames)] = tuple(frame.bad_elements)
        self._frames.append(
            (
                frame.seq,
                frame.epoch,
                frame.HasField("device_tick"),
                frame.device_tick,
                frame.t_mono_ns,
                frame.t_wall_ns,
                frame.flags,
                frame.lost_before,
                frame.simulated,
                self._tick_ns,
            )
        )
        self._counts.append(counts)

    def contents(self, cut: str) -> Contents:
        counts = np.frombuffer(b"".join(self._counts), dtype="<f4").reshape(-1, self.elements)
        return Contents(
            frames=np.array(self._frames, dtype=FRAME_COLUMNS),
            counts=counts,
            bad_elements=self._bad_elements,
            stage=np.array(self._stage, dtype=STAGE_COLUMNS),
            events=self._events,
            safety=self._safety,
            tick_ns=self._tick_ns,
            malformed=self.malformed,
            lost_chunks=self.lost_chunks,
            cut=cut,
        )


def _packed_frame() -> Any:
    """The class of ``tactus.v1.Frame`` with the counts as bytes: on the wire packed floats are the same, and numpy reads those at once."""
    file = descriptor_pb2.FileDescriptorProto()
    messages.Frame.DESCRIPTOR.file.CopyToProto(file)
    fields = {field.name: field for message in file.message_type if message.name == "Frame" for field in message.field}
    fields["counts"].type = descriptor_pb2.FieldDescriptorProto.TYPE_BYTES
    fields["counts"].label = descriptor_pb2.FieldDescriptorProto.LABEL_OPTIONAL
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(messages.Frame.DESCRIPTOR.full_name))


_PackedFrame = _packed_frame()
