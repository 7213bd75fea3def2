"""Files that numpy and mcap write become measurement tables."""

import json

import numpy
import pyarrow.parquet as pq
import pytest
from lab import tactus
from mcap.writer import Writer

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


def check(told, path, counts):
    (run,) = told["runs"]
    assert (run["presses"], run["holds"], run["frames"]) == (3, 3, len(counts)), told
    table = pq.read_table(path).to_pydict()
    assert table["counts"] == counts.reshape(len(counts), -1).astype("f4").tolist()
    assert max(table["press"]) == 2 and {"idle", "load", "hold"} <= set(table["phase"])
    assert abs(min(table["z_mm"]) + 0.5) < 1e-6
