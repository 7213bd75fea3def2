"""Reads the messages of a recording into columns, as far as the file goes."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, Metadata, Schema
from mcap.stream_reader import get_chunk_data_stream
from mcap.writer import MCAP0_MAGIC
from zstandard import ZstdError

from tactus_client import messages
from tactus_client.errors import UnreadableRecording

#: Name of the metadata record that makes an MCAP file a run's recording.
METADATA_NAME = "tactus.run"
#: No record of a recording is longer; a length beyond it is damage.
RECORD_MAX_BYTES = 64 * 1024 * 1024
#: A record's kind and length; within a chunk the number of a channel or a schema always follows.
RECORD_HEAD = struct.Struct("<BQ")
INNER_HEAD = struct.Struct("<BQH")
#: Channel, number and two times of a message.
MESSAGE_HEAD_BYTES = 22
#: What the readers of damaged records raise.
DAMAGE = (McapError, ZstdError, ValueError, struct.error)

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
        # NaN if the sensor tells none.
        ("temperature_c", "f4"),
    ]
)
STAGE_COLUMNS = np.dtype([("t_mono_ns", "i8"), ("x_mm", "f8"), ("y_mm", "f8"), ("z_mm", "f8"), ("status", "u1"), ("simulated", "?")])


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
    with path.open("rb") as file:
        try:
            for opcode, body in _records(file):
                if opcode == Opcode.METADATA:
                    record = Metadata.read(_stream(body))
                    if record.name == METADATA_NAME:
                        run = _checked(record.metadata)
                elif opcode == Opcode.ATTACHMENT:
                    if zlib.crc32(body[:-4]) != int.from_bytes(body[-4:], "little"):
                        raise ValueError("the checksum of an attached file is wrong")
                    attachment = Attachment.read(_stream(body))
                    attachments[attachment.name] = attachment.data
                elif opcode == Opcode.CHUNK:
                    break
        except (_Cut, *DAMAGE) as error:
            problem = str(error)
    if not run.get("run_id") or "rig.json" not in attachments:
        raise UnreadableRecording(f"{path} is not the recording of a run, or is damaged at its start ({problem}); try `tactus recover`")
    return Head(run, attachments)


def read_contents(path: Path, elements: int) -> Contents:
    """Reads all messages, around chunks that are damaged, up to where the file is cut off."""
    scan = _Scan(elements)
    at_byte, cut = 0, ""
    with path.open("rb") as file:
        try:
            for opcode, body in _records(file):
                scan.take(opcode, body)
                at_byte = file.tell()
        except _Cut as error:
            cut = f"readable up to byte {at_byte}: {error}"
    return scan.contents(cut)


def _checked(metadata: dict[str, str]) -> dict[str, str]:
    """The metadata without its checksum, which is over the lengths and texts of all other fields: MCAP has none for it."""
    fields = {name: value for name, value in metadata.items() if name != "crc32"}
    texts = [text.encode() for field in sorted(fields.items()) for text in field]
    checksum = zlib.crc32(b"".join(len(text).to_bytes(8, "little") + text for text in texts))
    if metadata.get("crc32", f"{checksum:08x}") != f"{checksum:08x}":
        raise ValueError("the checksum of the run's metadata is wrong")
    return fields


class _Cut(Exception):
    """Why nothing can be read from here on."""


def _records(file: BinaryIO) -> Iterator[tuple[int, bytes]]:
    """The kind and the body of each record."""
    if file.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
        raise _Cut("the start mark is wrong")
    while True:
        head = file.read(RECORD_HEAD.size)
        if len(head) < RECORD_HEAD.size:
            raise _Cut("the file ends here, without its end mark")
        opcode, length = RECORD_HEAD.unpack(head)
        if opcode == 0 or Opcode.DATA_END < opcode < 128 or length > RECORD_MAX_BYTES:
            raise _Cut(f"there is no record of kind {opcode} that is {length} bytes long")
        body = file.read(length)
        if len(body) < length:
            raise _Cut("the file ends here, within a record")
        yield opcode, body
        if opcode == Opcode.FOOTER:
            if file.read() != MCAP0_MAGIC:
                raise _Cut("the end mark is wrong")
            return


def _stream(body: bytes) -> ReadDataStream:
    return ReadDataStream(BytesIO(body))


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

    def take(self, opcode: int, body: bytes) -> None:
        """Takes what a record has of messages; a damaged one has none."""
        try:
            if opcode == Opcode.SCHEMA:
                schema = Schema.read(_stream(body))
                self._schemas[schema.id] = schema.name.rpartition(".")[2]
            elif opcode == Opcode.CHANNEL:
                channel = Channel.read(_stream(body))
                self._kinds[channel.id] = self._schemas.get(channel.schema_id, "")
            elif opcode == Opcode.CHUNK:
                # If its checksum is wrong it gives nothing: no message is better than a wrong one.
                chunk = Chunk.read(_stream(body))
                if chunk.uncompressed_size > RECORD_MAX_BYTES:
                    raise ValueError("no chunk is so long")
                stream, length = get_chunk_data_stream(chunk, validate_crc=True)
                self._within(stream.read(length))
        except DAMAGE:
            self.lost_chunks += 1

    def _within(self, data: bytes) -> None:
        """Takes the records within a chunk."""
        at = 0
        while at < len(data):
            opcode, length, channel = INNER_HEAD.unpack_from(data, at)
            body = at + RECORD_HEAD.size
            at = body + length
            if opcode == Opcode.MESSAGE:
                try:
                    self._message(self._kinds.get(channel), data[body + MESSAGE_HEAD_BYTES : at])
                except messages.DecodeError:
                    self.malformed += 1
            elif opcode != Opcode.CHUNK:
                self.take(opcode, data[body:at])

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
                frame.temperature_c if frame.HasField("temperature_c") else np.nan,
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
