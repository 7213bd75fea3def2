"""Files that numpy and mcap write become measurement tables."""

import json
from types import SimpleNamespace

import numpy
import pyarrow.parquet as pq
import pytest
from google.protobuf import descriptor_pool, message_factory
from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorProto
from google.protobuf.timestamp_pb2 import Timestamp
from lab import tactus
from mcap.writer import Writer
from mcap_protobuf.schema import build_file_descriptor_set
from mcap_protobuf.writer import Writer as ProtobufWriter
from mcap_ros2.writer import Writer as RosWriter

RIG = """
[rig]
name = "bench"
indenter = "tip"
array = { rows = 2, cols = 2, pitch_mm = 2.0, element_mm = [1.8, 1.8], full_scale_counts = 4095 }
registration = { origin_mm = [0.0, 0.0] }
covering = { thickness_mm = 1.0 }
indenters = { tip = { shape = "sphere", diameter_mm = 2.0 } }
"""


@pytest.fixture
def frames():
    """Three presses of half a millimetre at 50 Hz: time in s, depth in mm, counts of 2 x 2 elements."""
    one = numpy.concatenate([numpy.full(20, -1.0), numpy.linspace(-1, 0.5, 10), numpy.full(20, 0.5), numpy.linspace(0.5, -1, 10)])
    depth_mm = numpy.tile(one, 3)
    pressed = numpy.maximum(depth_mm, 0)[:, None, None] * 100
    counts = (50 + pressed * numpy.array([[1.0, 2.0], [3.0, 4.0]])).round().astype("u2")
    return numpy.arange(len(depth_mm)) / 50, depth_mm, counts


def test_compressed_numpy_arrays(frames, tmp_path):
    seconds, depth_mm, counts = frames
    numpy.savez_compressed(tmp_path / "a.npz", t=seconds, depth=depth_mm.astype(">f4"), counts=counts, gain=3.0, who="me")
    (tmp_path / "map.toml").write_text(
        """
schema = "tactus.mapping/1"
time = { column = "t", unit = "s" }
x = { at_mm = 1.0 }
y = { at_mm = 1.0 }
z = { column = "depth", unit = "mm", direction = -1, origin = 0.0 }
counts = { columns = "counts[{n}]", first = 0, order = "row-major", zero = "raw" }
"""
        + RIG
    )
    check(tactus("import", "--map", "map.toml", "a.npz", cwd=tmp_path), tmp_path / "a.parquet", counts)


def test_topics_of_an_mcap_file(frames, tmp_path):
    seconds, depth_mm, counts = frames
    with open(tmp_path / "a.mcap", "wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema(name="any", encoding="jsonschema", data=b"{}")
        channel = {
            topic: writer.register_channel(topic=topic, message_encoding="json", schema_id=schema)
            for topic in ("/skin", "/stage")
        }

        def write(topic, at_s, message):
            at_ns = 10**18 + round(at_s * 1e9)
            writer.add_message(channel[topic], at_ns, json.dumps(message).encode(), at_ns)

        for at_s, depth, image in zip(seconds, depth_mm, counts, strict=True):
            # The stage reports twice as often, and between the frames.
            write("/stage", at_s - 0.005, {"pose": {"up_um": -1e3 * depth}})
            write("/skin", at_s, {"values": image.flatten().tolist()})
            write("/stage", at_s + 0.005, {"pose": {"up_um": -1e3 * depth}})
        writer.finish()
    (tmp_path / "map.toml").write_text(
        """
schema = "tactus.mapping/1"
file = { topic = "/skin" }
time = { column = "log_time", unit = "ns" }
x = { at_mm = 1.0 }
y = { at_mm = 1.0 }
z = { column = "/stage:pose.up_um", unit = "um", direction = 1, origin = 0.0 }
counts = { columns = "values[{n}]", first = 0, order = "row-major", zero = "raw" }
"""
        + RIG
    )
    check(tactus("import", "--map", "map.toml", "a.mcap", cwd=tmp_path), tmp_path / "a.parquet", counts)


BINARY_MAP = """
schema = "tactus.mapping/1"
file = { topic = "/skin" }
time = { column = "stamp", unit = "ns" }
x = { at_mm = 1.0 }
y = { at_mm = 1.0 }
z = { column = "/stage:pose.up_um", unit = "um", direction = 1, origin = 0.0 }
counts = { columns = "values[{n}]", first = 0, order = "row-major", zero = "raw" }
"""
START_S = 1_700_000_000


def test_topics_in_protobuf(frames, tmp_path):
    skin, stage = protobuf_classes()
    with open(tmp_path / "a.mcap", "wb") as file:
        writer = ProtobufWriter(file)
        for at_ns, depth, image in moments(frames):
            if image is None:
                # A field that has its default is not in the message.
                writer.write_message("/stage", stage(pose={"up_um": -1e3 * depth}), at_ns, at_ns)
            else:
                message = skin(values=image, picture=b"xy")
                message.stamp.seconds, message.stamp.nanos = divmod(at_ns, 10**9)
                writer.write_message("/skin", message, at_ns, at_ns)
        writer.finish()
    (tmp_path / "map.toml").write_text(BINARY_MAP + RIG)
    check(tactus("import", "--map", "map.toml", "a.mcap", cwd=tmp_path), tmp_path / "a.parquet", frames[2])


def test_topics_of_ros_2(frames, tmp_path):
    with open(tmp_path / "a.mcap", "wb") as file:
        writer = RosWriter(file)
        skin = writer.register_msgdef(
            "lab_msgs/msg/Skin",
            'string<=9 frame_id "a"\nint8 KIND=3\nbuiltin_interfaces/Time stamp  # when\nuint16[] values\nbool[2] flags\n',
        )
        line = "=" * 80
        stage = writer.register_msgdef(
            "lab_msgs/msg/Stage",
            f"uint8 state\nPose pose\n{line}\nMSG: lab_msgs/Pose\nfloat64 up_um\nEmpty[2] nothing\n{line}\nMSG: lab_msgs/Empty\n",
        )
        for at_ns, depth, image in moments(frames):
            if image is None:
                pose = {"up_um": -1e3 * float(depth), "nothing": [SimpleNamespace(), SimpleNamespace()]}
                writer.write_message("/stage", stage, {"state": 1, "pose": pose}, at_ns)
            else:
                stamp = {"sec": at_ns // 10**9, "nanosec": at_ns % 10**9}
                message = {"frame_id": "skin", "stamp": stamp, "values": image, "flags": [True, False]}
                writer.write_message("/skin", skin, message, at_ns)
        writer.finish()
    (tmp_path / "map.toml").write_text(BINARY_MAP + RIG)
    check(tactus("import", "--map", "map.toml", "a.mcap", cwd=tmp_path), tmp_path / "a.parquet", frames[2])


def test_what_is_wrong_in_a_message_is_named(frames, tmp_path):
    (tmp_path / "map.toml").write_text(BINARY_MAP + RIG)

    def refused(encoding, name, schema, message, topic="/skin"):
        with open(tmp_path / "a.mcap", "wb") as file:
            writer = Writer(file)
            writer.start()
            schema_id = writer.register_schema(name=name, encoding=encoding[1], data=schema)
            channel = writer.register_channel(topic=topic, message_encoding=encoding[0], schema_id=schema_id)
            writer.add_message(channel, 1, message, 1)
            writer.finish()
        told = tactus("import", "--map", "map.toml", "a.mcap", cwd=tmp_path, check=False)
        assert told["exit_code"] == 1
        return told["error"]

    ros = ("cdr", "ros2msg")
    short = refused(ros, "lab/msg/Skin", b"float64 x\nuint16[] values", b"\0\1\0\0" + bytes(8) + b"\3\0\0\0\1\0")
    assert "message 0 of /skin: field values[1]: the message ends before it" in short
    many = refused(ros, "lab/msg/Skin", b"uint16[] values", b"\0\1\0\0" + b"\xff" * 4)
    assert "field values: the message is too short for 4294967295 values" in many
    assert "no CDR" in refused(ros, "lab/msg/Skin", b"float64 x", b"\7\7\0\0")
    assert "does not describe lab/Pose" in refused(ros, "lab/msg/Skin", b"Pose pose", b"")
    endless = refused(ros, "lab/msg/Skin", b"Skin skin", b"\0\1\0\0")
    assert "lab/Skin contains itself" in endless
    protobuf = ("protobuf", "protobuf")
    assert 'topic "/skin": the schema of lab.Skin' in refused(protobuf, "lab.Skin", b"\xff", b"")
    described = build_file_descriptor_set(protobuf_classes()[0]).SerializeToString()
    assert "message 0 of /skin: no lab.Skin" in refused(protobuf, "lab.Skin", described, b"\xff")
    assert "does not describe lab.Other" in refused(protobuf, "lab.Other", described, b"")
    assert 'messages in "cbor"' in refused(("cbor", ""), "lab.Skin", b"", b"")
    # The topic that is wanted is another one.
    assert 'no topic "/skin"' in refused(("cbor", ""), "lab.Skin", b"", b"", topic="/other")


def moments(frames):
    """Times in ns with the depth, and with the image or between two frames, when only the stage reports."""
    for at_s, depth, image in zip(*frames, strict=True):
        at_ns = START_S * 10**9 + round(at_s * 1e9)
        yield at_ns - 5_000_000, depth, None
        yield at_ns, depth, image.flatten().tolist()
        yield at_ns + 5_000_000, depth, None


def protobuf_classes():
    """Messages that no program here has a file of."""
    file = FileDescriptorProto(name="lab.proto", package="lab", syntax="proto3", dependency=["google/protobuf/timestamp.proto"])
    kinds = FieldDescriptorProto
    for name, fields in {
        "Skin": [
            ("stamp", kinds.TYPE_MESSAGE, ".google.protobuf.Timestamp"),
            ("values", kinds.TYPE_UINT32, None),
            ("picture", kinds.TYPE_BYTES, None),
        ],
        "Pose": [("up_um", kinds.TYPE_DOUBLE, None)],
        "Stage": [("pose", kinds.TYPE_MESSAGE, ".lab.Pose")],
    }.items():
        message = file.message_type.add(name=name)
        for number, (field, kind, type_name) in enumerate(fields, 1):
            label = kinds.LABEL_REPEATED if field == "values" else kinds.LABEL_OPTIONAL
            message.field.add(name=field, number=number, type=kind, type_name=type_name, label=label)
    pool = descriptor_pool.DescriptorPool()
    known = FileDescriptorProto()
    Timestamp.DESCRIPTOR.file.CopyToProto(known)
    pool.Add(known)
    pool.Add(file)
    return [message_factory.GetMessageClass(pool.FindMessageTypeByName(f"lab.{name}")) for name in ("Skin", "Stage")]


def check(told, path, counts):
    (run,) = told["runs"]
    assert (run["presses"], run["holds"], run["frames"]) == (3, 3, len(counts)), told
    table = pq.read_table(path).to_pydict()
    assert table["counts"] == counts.reshape(len(counts), -1).astype("f4").tolist()
    assert max(table["press"]) == 2 and {"idle", "load", "hold"} <= set(table["phase"])
    assert abs(min(table["z_mm"]) + 0.5) < 1e-6
