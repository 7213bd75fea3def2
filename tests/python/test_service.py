"""A stock zenoh client beside a run: every frame arrives."""

import json
import subprocess
import sys

import tactus_client
from lab import REPOSITORY, tactus

SCRIPT = """
def run(rig):
    tare()
    for i in range(3):
        press(5.0, 5.0, depths_mm = [0.2, 0.4])
"""


def test_a_subscriber_beside_a_run_misses_no_frame(lab):
    (lab.folder / "presses.star").write_text(SCRIPT)
    counter = subprocess.Popen(
        [sys.executable, REPOSITORY / "clients/python/examples/count_frames.py", "--endpoint", lab.endpoint, "--frames", "300"],
        stdout=subprocess.PIPE,
        text=True,
    )
    summary = tactus("--endpoint", lab.endpoint, "run", lab.folder / "presses.star", "--no-report", cwd=lab.folder)
    assert summary["exit_status"] == "done"
    assert summary["presses"] == 3
    counted = json.loads(counter.communicate(timeout=120)[0])
    assert counter.returncode == 0
    assert counted["frames"] >= 300
    assert counted["bus_missing"] == 0
    assert counted["device_lost"] == 0
    assert counted["last_seq"] - counted["first_seq"] == counted["frames"] - 1


def test_the_client_runs_stops_and_follows_events(lab):
    with tactus_client.connect(lab.endpoint) as client:
        reply = client.run("element-centres", order="raster")
        assert reply.state.run_id
        kinds = []
        for event in client.events():
            kinds.append(event.WhichOneof("event"))
            if kinds[-1] == "dwell_done" and "stop_requested" not in kinds:
                frame = next(client.frames())
                assert frame.simulated and len(frame.image) == 6
                client.stop("seen enough")
            if kinds[-1] == "finished":
                break
        assert kinds[0] == "started"
        assert "stop_requested" in kinds
        assert "seen enough" in event.finished.message
        assert event.run_id == reply.state.run_id
