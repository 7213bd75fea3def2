"""The ophyd-async devices at a real service."""

import asyncio
import json
import subprocess
import sys
import threading

import bluesky.plan_stubs as bps
import bluesky.plans as bp
import numpy as np
import pytest
from bluesky import RunEngine
from bluesky.utils import FailedStatus, RunEngineInterrupted
from lab import REPOSITORY
from ophyd_async.core import init_devices

import tactus_client
from tactus_client.ophyd import Place, Press, Presser, Stage, TactileArray


@pytest.fixture
def client(standing_lab):
    with tactus_client.connect(standing_lab.endpoint) as client:
        yield client


@pytest.fixture
def run_engine():
    return RunEngine({}, context_managers=[])


@pytest.fixture
def devices(client, run_engine):
    with init_devices():
        array, stage, presser = TactileArray(client), Stage(client), Presser(client, dwell_s=0.1)
    return array, stage, presser


def test_the_example_collects_the_documents_of_its_presses(standing_lab):
    example = REPOSITORY / "clients/python/examples/bluesky_presses.py"
    done = subprocess.run(
        [sys.executable, example, "--endpoint", standing_lab.endpoint], capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    documents = [json.loads(line) for line in done.stdout.splitlines()]
    assert [kind for kind, _ in documents] == ["start", "descriptor", "event", "event", "stop"]
    start, descriptor, *events, stop = [document for _, document in documents]
    assert start["simulated"] and stop["exit_status"] == "success"
    assert descriptor["configuration"]["presser"]["data"]["presser-simulated"]
    for element, event in zip((18, 27), events):
        rise = np.array(event["data"]["presser-rise_counts"])
        assert rise.shape == (48,) and rise[element] > 100
        assert event["data"]["presser-depth_mm"] == 0.3
        assert np.array(event["data"]["array-counts"]).shape == (48,)
        recorded = tactus_client.open(event["data"]["presser-run_id"], standing_lab.folder / "runs")
        assert recorded.presses[[f"rise_{k}" for k in range(48)]].to_numpy()[0].tolist() == pytest.approx(rise.tolist(), abs=1e-3)


def test_the_stage_moves_at_the_safe_height_and_tells_where_it_is(devices, run_engine, client):
    array, stage, _ = devices
    documents = []
    run_engine(bp.list_scan([array], stage, [Place(1.0, 2.0), Place(3.0, 4.0)]), lambda name, one: documents.append((name, one)))
    events = [document["data"] for name, document in documents if name == "event"]
    origin = client.status().description.origin_mm
    assert [(event["stage-x_mm"], event["stage-y_mm"]) for event in events] == [
        (pytest.approx(origin[0] + x, abs=0.01), pytest.approx(origin[1] + y, abs=0.01)) for x, y in [(1, 2), (3, 4)]
    ]
    assert all(event["stage-z_mm"] > 1.9 for event in events)
    assert events[0]["array-seq"] < events[1]["array-seq"]
    located = asyncio.run_coroutine_threadsafe(stage.locate(), run_engine.loop).result(60)
    assert located["setpoint"] == Place(3.0, 4.0)
    assert located["readback"] == (pytest.approx(3.0, abs=0.01), pytest.approx(4.0, abs=0.01))


def test_what_the_service_refuses_fails_the_plan_with_its_reason(devices, run_engine, client):
    before = client.status().state.run_id
    with pytest.raises(FailedStatus) as failed:
        run_engine(bps.mv(devices[2], Press(5.1, 4.9, 0.9)))
    assert isinstance(failed.value.__cause__, tactus_client.Refused)
    assert "0.9" in str(failed.value.__cause__)
    assert client.status().state.run_id == before


@pytest.mark.parametrize("phase", ["idle", "load"])
def test_a_plan_that_is_broken_off_stops_the_press_and_raises_the_tip(client, run_engine, phase):
    with init_devices():
        # Longer than anybody takes to stop it.
        presser = Presser(client, dwell_s=20.0)
    before = client.status().state.run_id

    def interrupt():
        for event in events:
            is_phase = event.run_id != before and event.WhichOneof("event") == "phase_changed"
            if is_phase and tactus_client.messages.word_of(event.phase_changed, "phase") == phase:
                return run_engine.request_pause(defer=False)

    with client.events(history=1) as events, client.states() as states:
        breaking = threading.Thread(target=interrupt)
        breaking.start()
        with pytest.raises(RunEngineInterrupted):
            run_engine(bps.mv(presser, Press(5.1, 4.9, 0.3)))
        run_engine.abort("seen enough")
        breaking.join()
        while tactus_client.messages.word_of(state := states.receive(60), "phase") != "finished" or state.run_id == before:
            pass
    assert (tactus_client.messages.word_of(state, "exit_status"), "stopped by Bluesky" in state.message) == ("stopped", True), state.message
    assert client.status().stage.z_mm > 1.9
