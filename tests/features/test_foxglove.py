"""Foxglove's own client sees the lab live, and its messages are those of Foxglove's own package."""

import base64
import json
import os
import struct
import subprocess
from pathlib import Path

import foxglove.layouts as fl
import pytest
from foxglove_schemas_protobuf import FrameTransform_pb2, Grid_pb2, Log_pb2, RawImage_pb2
from google.protobuf.descriptor_pb2 import FileDescriptorProto, FileDescriptorSet
from lab import REPOSITORY, tactus
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

SCHEMAS = {
    "/array/grid": Grid_pb2.Grid,
    "/array/image": RawImage_pb2.RawImage,
    "/tf": FrameTransform_pb2.FrameTransform,
    "/tf/sensor": FrameTransform_pb2.FrameTransform,
    "/log": Log_pb2.Log,
}
PROTOCOLS = ["foxglove.sdk.v1", "foxglove.websocket.v1"]


@pytest.fixture
def web(lab):
    web = lab.start("tactus-web", "--endpoint", lab.endpoint, "--listen", "127.0.0.1:0")
    address = web.wait_for("http://").split()[-1].split("#")[0]
    web.wait_for("connected")
    yield address
    web.end()


@pytest.fixture(params=PROTOCOLS)
def viewer(request, web):
    """Lines of Foxglove's client."""
    program = [os.environ.get("NODE", "node"), str(Path(__file__).parent / "client.mjs")]
    address = web.replace("http://", "ws://") + "foxglove"
    process = subprocess.Popen([*program, address, request.param], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    yield (json.loads(line) for line in process.stdout)
    process.stdin.close()
    process.wait(timeout=60)
    process.stdout.close()


def test_a_viewer_sees_the_lab(lab, viewer):
    seen, rig, server = {}, None, {}
    # Whoever joins gets the present of each channel, and who serves, as soon as that is known.
    while set(seen) != set(SCHEMAS) or server.get("simulated") != "true" or rig is None:
        said = next(viewer)
        assert said["op"] not in ("error", "status"), said
        if said["op"] == "serverInfo":
            server = said["metadata"]
            name = said["name"]
        elif said["op"] == "advertise":
            for channel in said["channels"]:
                check_schema(channel)
        else:
            message = SCHEMAS[said["topic"]].FromString(base64.b64decode(said["message"]))
            seen[said["topic"]] = message
            if said["topic"] == "/log" and message.name == "rig":
                rig = message.message
    assert name == "Tactus bench (SIMULATED)" and rig == "rig bench, which is SIMULATED"
    grid, image, sensor = seen["/array/grid"], seen["/array/image"], seen["/tf/sensor"]
    assert (grid.column_count, grid.fields[0].name, len(grid.data)) == (8, "rise_counts", 4 * 48)
    assert (image.width, image.height, image.encoding) == (8, 6, "mono8")
    assert (sensor.parent_frame_id, sensor.child_frame_id, sensor.translation.x) == ("robot", "sensor", 0.02)
    assert seen["/tf"].child_frame_id == "tip"

    # A press is seen as it happens.
    (lab.folder / "press.star").write_text("def run(rig):\n    tare()\n    press(5.1, 4.9, depths_mm = [0.4])\n    log('pressed')\n")
    tactus("--endpoint", lab.endpoint, "run", "press.star", "--no-report", cwd=lab.folder)
    deepest_m, greatest, white, lines = 0.0, 0.0, 0, []
    while not any(line.message.startswith("ended: done") for line in lines):
        said = next(viewer)
        if said["op"] != "message":
            continue
        message = SCHEMAS[said["topic"]].FromString(base64.b64decode(said["message"]))
        if said["topic"] == "/tf":
            deepest_m = min(deepest_m, message.translation.z)
        elif said["topic"] == "/array/grid":
            greatest = max(greatest, *struct.unpack("<48f", message.data))
        elif said["topic"] == "/array/image":
            white = max(white, *message.data)
        elif said["topic"] == "/log":
            lines.append(message)
    assert abs(deepest_m + 0.4e-3) < 1e-5 and greatest > 100 and white == 255
    assert "pressed" in [line.message for line in lines]


def check_schema(channel):
    assert (channel["encoding"], channel["schemaEncoding"]) == ("protobuf", "protobuf")
    descriptor = SCHEMAS[channel["topic"]].DESCRIPTOR
    assert channel["schemaName"] == descriptor.full_name
    ours = {file.name: file for file in FileDescriptorSet.FromString(base64.b64decode(channel["schema"])).file}
    theirs = FileDescriptorProto()
    descriptor.file.CopyToProto(theirs)
    assert ours[theirs.name] == theirs


def test_pages_of_other_sites_and_other_protocols_are_refused(web):
    address = web.replace("http://", "ws://") + "foxglove"
    for origin, status in [("https://evil.example", 403), ("null", 403), ("https://app.foxglove.dev", None), (None, None)]:
        if status is None:
            with connect(address, origin=origin, subprotocols=PROTOCOLS[:1]) as socket:
                assert json.loads(socket.recv())["op"] == "serverInfo"
            continue
        with pytest.raises(InvalidStatus) as refused:
            connect(address, origin=origin, subprotocols=PROTOCOLS[:1])
        assert refused.value.response.status_code == status, origin
    with pytest.raises(InvalidStatus) as refused:
        connect(address, subprotocols=["something.else"])
    assert refused.value.response.status_code == 400


def test_the_layout_has_the_panels_and_keys_of_foxgloves_own_package():
    """The viewer itself is not free to run here; its package knows which panels and settings there are."""
    layout = json.loads((REPOSITORY / "config/viewers/foxglove.json").read_text())
    panels = {"Image": fl.ImagePanel, "3D": fl.ThreeDeePanel, "Plot": fl.PlotPanel, "Log": fl.LogPanel}
    parts = {
        "imageMode": fl.ImageModeConfig,
        "cameraState": fl.ThreeDeeCameraState,
        "scene": fl.BaseRendererSceneSettings,
        "transforms": fl.BaseRendererTransforms,
        "/array/grid": fl.BaseRendererGridTopicSettings,
    }
    placed = []

    def place(node):
        if isinstance(node, str):
            placed.append(node)
        else:
            assert node["direction"] in ("row", "column")
            place(node["first"])
            place(node["second"])

    def check(value, known, where):
        assert set(value) <= set(known), (where, set(value) - set(known))
        for key, part in value.items():
            if key in parts:
                check(part, parts[key]()._to_dict(), f"{where}.{key}")

    place(layout["layout"])
    assert sorted(placed) == sorted(layout["configById"])
    topics = set()
    for name, config in layout["configById"].items():
        known = panels[name.split("!")[0]]().config._to_dict()
        check(config, [*known, "foxglovePanelTitle"], name)
        check(config.get("topics", {}), parts | SCHEMAS, f"{name}.topics")
        for series in config.get("paths", []):
            check(series, fl.PlotSeries(value="")._to_dict(), f"{name}.paths")
            topics.add(series["value"].split(".")[0])
        topics |= set(config.get("topics", {}))
        topics.add(config.get("topicToRender") or config.get("imageMode", {}).get("imageTopic"))
    assert topics - {None} <= set(SCHEMAS)
