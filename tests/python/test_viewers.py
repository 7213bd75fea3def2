"""Foxglove's own package reads what is written for viewers, and Prometheus' own parser the metrics."""

import struct
import urllib.request

import pytest
from foxglove_schemas_protobuf import FrameTransform_pb2, Grid_pb2, Log_pb2, RawImage_pb2
from google.protobuf.descriptor_pb2 import FileDescriptorProto, FileDescriptorSet
from lab import tactus
from mcap.reader import make_reader
from prometheus_client.parser import text_string_to_metric_families

SCHEMAS = {
    "foxglove.Grid": Grid_pb2.Grid,
    "foxglove.RawImage": RawImage_pb2.RawImage,
    "foxglove.FrameTransform": FrameTransform_pb2.FrameTransform,
    "foxglove.Log": Log_pb2.Log,
}


@pytest.fixture(scope="module")
def view(element_centres, tmp_path_factory):
    path = tmp_path_factory.mktemp("view") / "view.mcap"
    told = tactus("export", element_centres["recording"], "--format", "foxglove", "--out", path)
    assert told["frames"] == element_centres["frames"]
    return path


def messages(path, topic):
    with open(path, "rb") as file:
        for schema, _, message in make_reader(file).iter_messages(topics=[topic]):
            yield SCHEMAS[schema.name].FromString(message.data)


def test_schemas_are_foxgloves(view):
    with open(view, "rb") as file:
        summary = make_reader(file).get_summary()
    assert {schema.name for schema in summary.schemas.values()} == set(SCHEMAS)
    assert {(one.metadata["rig"], one.metadata["simulated"]) for one in summary.channels.values()} == {("sim", "true")}
    for schema in summary.schemas.values():
        ours = {file.name: file for file in FileDescriptorSet.FromString(schema.data).file}
        theirs = FileDescriptorProto()
        SCHEMAS[schema.name].DESCRIPTOR.file.CopyToProto(theirs)
        assert ours[theirs.name] == theirs


def test_the_array_is_a_grid_and_an_image(view):
    grids, images = list(messages(view, "/array/grid")), list(messages(view, "/array/image"))
    grid = grids[0]
    assert (grid.column_count, grid.row_stride, grid.cell_stride, grid.fields[0].name) == (8, 32, 4, "rise_counts")
    assert abs(grid.cell_size.x - 14.4e-3 / 7) < 1e-9 and grid.frame_id == "sensor"
    # The deepest press is the brightest, at the same element: the image's first line is its top.
    rises = [struct.unpack("<48f", grid.data) for grid in grids]
    best = max(range(len(rises)), key=lambda frame: max(rises[frame]))
    element = rises[best].index(max(rises[best]))
    image = images[best]
    assert (image.width, image.height, image.encoding, max(image.data)) == (8, 6, "mono8", 255)
    assert image.data.index(255) == (5 - element // 8) * 8 + element % 8
    assert (image.timestamp, len(images)) == (grids[best].timestamp, len(grids))


def test_the_tip_is_a_transform_and_the_run_a_log(view):
    (sensor,) = messages(view, "/tf/sensor")
    assert (sensor.parent_frame_id, sensor.child_frame_id, sensor.translation.x) == ("robot", "sensor", 0.02)
    z = [transform.translation.z for transform in messages(view, "/tf")]
    assert abs(min(z) + 0.6e-3) < 1e-6, "metres"
    lines = list(messages(view, "/log"))
    assert (lines[0].name, lines[0].message) == ("rig", "rig sim, which is SIMULATED")
    assert lines[1].name == "started" and lines[-1].name == "finished" and lines[-1].level == Log_pb2.Log.INFO


def test_prometheus_reads_the_metrics(lab):
    web = lab.start("tactus-web", "--endpoint", lab.endpoint, "--listen", "127.0.0.1:0")
    try:
        address = web.wait_for("http://").split()[-1].split("#")[0]
        web.wait_for("connected")
        with urllib.request.urlopen(address + "metrics") as reply:
            assert reply.headers["content-type"].startswith("text/plain; version=0.0.4")
            families = {family.name: family for family in text_string_to_metric_families(reply.read().decode())}
        (connected,) = families["tactus_service_connected"].samples
        assert (connected.labels, connected.value) == ({"rig": "bench"}, 1.0)
        assert families["tactus_dashboard_frames_missed"].type == "counter"
        assert all(family.documentation for family in families.values())
    finally:
        web.end()
