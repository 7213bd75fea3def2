"""The Python client runs experiments at a real service."""

import os
import pty
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from lab import tactus

import tactus_client

PRESSES = '''
"""Presses one place."""

DEPTHS_MM = param("depths_mm", default = [0.2], doc = "depths held", unit = "mm", min = 0.01)
TIMES = param("times", default = 1, doc = "number of presses", min = 1, max = 1000)

def run(rig):
    tare()
    for i in range(TIMES):
        press(5.1, 4.9, depths_mm = DEPTHS_MM)
'''


@pytest.fixture
def client(standing_lab):
    with tactus_client.connect(standing_lab.endpoint) as client:
        yield client


@pytest.fixture
def presses(tmp_path):
    path = tmp_path / "presses.star"
    path.write_text(PRESSES)
    return path


def test_a_run_is_waited_for_and_its_recording_opened(client, presses, capfd):
    run = client.run(presses, depths_mm=np.array([0.2, 0.4]), times=np.int64(1), seed=5)
    assert run.result is None and not run.is_over
    assert run.run_id in repr(run) and "SIMULATED" in repr(run) and "SIMULATED" in run._repr_html_()
    result = run.wait()
    # Nobody sees a bar in what is captured.
    assert capfd.readouterr().err == ""
    assert (result.exit_status, result.presses, result.dwells, result.simulated) == ("done", 1, 2, True)
    assert result == run.result and run.is_over
    assert "SIMULATED" in result._repr_html_()
    # The service was started in another folder.
    for opened in (run.open(), tactus_client.open(result), tactus_client.open(run.run_id, result.recording.parents[1])):
        assert opened.run_id == run.run_id
    assert (opened.parameters, opened.metadata["seed"]) == ({"depths_mm": [0.2, 0.4], "times": 1}, 5)
    assert opened.presses["depth_mm"].tolist() == [0.2, 0.4]
    assert opened.rise[18].max() > 100
    assert client.runs()[-1].run_id == run.run_id


def test_a_plan_moves_nothing_and_gives_the_verdict(client, presses):
    before = client.status().stage
    plan = client.plan(presses, depths_mm=[0.3], times=3)
    assert plan.is_possible and (plan.presses, plan.dwells, plan.deepest_mm) == (3, 3, pytest.approx(0.3))
    assert plan.parameters == {"depths_mm": [0.3], "times": 3}
    assert "possible" in plan._repr_html_()
    refused = client.plan(presses, depths_mm=[0.9])
    assert not refused.is_possible and refused.exit_status == "refused"
    assert "0.9" in refused.message and "presses.star" in refused.message
    assert refused.message in refused._repr_html_().replace("&quot;", '"').replace("&#x27;", "'")
    after = client.status().stage
    assert (before.x_mm, before.y_mm, before.z_mm) == (after.x_mm, after.y_mm, after.z_mm)


def test_what_cannot_be_run_is_refused_with_the_reason(client, presses, tmp_path):
    with pytest.raises(tactus_client.Refused, match="0.9") as refused:
        client.run(presses, depths_mm=[0.9])
    assert refused.value.exit_code == 4
    with pytest.raises(tactus_client.Refused, match="nothing"):
        client.run("nothing")
    with pytest.raises(tactus_client.Refused, match="depht_mm"):
        client.run(presses, depht_mm=0.3)
    with pytest.raises(tactus_client.Refused, match="depths_mm"):
        client.plan(presses, depths_mm="deep")
    with pytest.raises(TypeError, match="not object"):
        client.run(presses, depths_mm=object())
    with pytest.raises(FileNotFoundError, match="absent.star"):
        client.run(tmp_path / "absent.star")
    assert client.status().phase in ("idle", "finished")


def test_experiments_are_listed_with_the_types_of_their_parameters(client):
    experiments = client.experiments()
    depth = next(one for one in experiments["corners"].parameters if one.name == "depth_mm")
    assert (depth.kind, depth.default, depth.unit, depth.min, depth.max, depth.choices) == ("float", 0.3, "mm", 0.02, None, ())
    order = next(one for one in experiments["grid-sweep"].parameters if one.name == "order")
    assert order.choices == ("random", "raster")
    assert "corners" in experiments._repr_html_() and "depth_mm" in experiments["corners"]._repr_html_()


def test_a_run_is_paused_resumed_and_stopped(client, presses):
    run = client.run(presses, times=1000)
    with client.events() as events:
        wait_for(events, run.run_id, "dwell_done")
        run.pause("to look")
        wait_for(events, run.run_id, "paused")
        run.resume()
        wait_for(events, run.run_id, "resumed")
    with pytest.raises(TimeoutError, match="goes on"):
        run.wait(timeout_s=0.1)
    run.stop("seen enough")
    with pytest.raises(tactus_client.RunStopped, match="seen enough") as stopped:
        run.wait()
    assert stopped.value.result.exit_status == "stopped"
    assert tactus_client.open(stopped.value.result).exit_status == "stopped"


def test_the_folder_is_known_before_the_first_run(lab):
    with tactus_client.connect(lab.endpoint) as client:
        assert Path(client.status().recordings) == lab.folder / "runs"
        assert client.runs() == []


def test_tags_and_notes_are_those_of_the_command_line(lab, presses, monkeypatch):
    with tactus_client.connect(lab.endpoint) as client:
        run_id = client.run(presses).wait().run_id
        told = client.runs()
        # The service must not choose where this program writes.
        with pytest.raises(PermissionError, match="tactus_client.runs"):
            told[0].tags += ["good"]
        monkeypatch.chdir(lab.folder)
        # Now it is the usual folder.
        (run,) = client.runs()
    assert (run.run_id, run.tags, run.note) == (run_id, [], "")
    run.tags += ["good", "dry"]
    run.note = 'new "covering"\n\x7f\tof 1 mm \u00e9'
    (listed,) = tactus("runs", "--runs", "runs", "--tag", "good", cwd=lab.folder)["runs"]
    assert (listed["tags"], listed["note"]) == (["dry", "good"], run.note)
    tactus("runs", "note", "--runs", "runs", run_id, "another", cwd=lab.folder)
    assert (run.tags, run.note, told[0].note) == (["dry", "good"], "another", "another")
    assert "dry good" in tactus_client.runs("runs")._repr_html_()
    for wrong, error in [(["two words"], ValueError), ([""], ValueError), ([3], TypeError)]:
        with pytest.raises(error, match="word"):
            run.tags = wrong
    run.path.with_name("notes.toml").write_text("tags = 3")
    with pytest.raises(tactus_client.UnreadableNotes, match=r"notes\.toml"):
        run.tags  # noqa: B018
    assert "notes.toml" in tactus_client.runs("runs")._repr_html_()


def wait_for(events, run_id, kind):
    """Waits for an event of a run; only a hang takes a minute."""
    while (event := events.receive(60)).run_id != run_id or event.WhichOneof("event") != kind:
        pass


def test_a_script_that_fails_is_an_error_with_its_message(client, tmp_path):
    # A dry run cannot know what a real sensor reads.
    script = "def run(rig):\n    tare()\n    if read(0.1).counts[0] > 0 and not rig.name == 'twin':\n        fail('enough of it')\n"
    (tmp_path / "fails.star").write_text(script)
    with pytest.raises((tactus_client.Refused, tactus_client.RunFailed), match="enough of it"):
        client.run(tmp_path / "fails.star").wait()


def test_ctrl_c_in_a_wait_stops_the_run_and_retracts(client, presses, standing_lab):
    script = "import signal, sys, tactus_client; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
    script += "client = tactus_client.connect(sys.argv[1]); run = client.run(sys.argv[2], times=1000)\n"
    script += "print(run.run_id, flush=True); run.wait()"
    program = subprocess.Popen(
        [sys.executable, "-c", script, standing_lab.endpoint, str(presses)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    run_id = program.stdout.readline().strip()
    with client.events() as events:
        wait_for(events, run_id, "dwell_done")
    program.send_signal(signal.SIGINT)
    _, told = program.communicate(timeout=60)
    assert "stopping and retracting" in told and told.endswith("KeyboardInterrupt\n")
    state = client.status().state
    assert (state.run_id, tactus_client.messages.word_of(state, "exit_status")) == (run_id, "stopped")
    assert client.status().stage.z_mm > 0


def test_progress_is_shown_in_a_terminal_only(presses, standing_lab):
    script = "import sys, tactus_client; client = tactus_client.connect(sys.argv[1]); client.run(sys.argv[2]).wait()"
    arguments = [sys.executable, "-c", script, standing_lab.endpoint, str(presses)]
    controller, terminal = pty.openpty()
    subprocess.run(arguments, stderr=terminal, check=True, timeout=120)
    os.close(terminal)
    shown = b""
    try:
        while piece := os.read(controller, 4096):
            shown += piece
    except OSError:
        # The terminal is gone.
        pass
    os.close(controller)
    assert b"presses [" in shown and b"/1 presses" in shown and b"SIMULATED" in shown


def test_a_service_that_dies_in_a_run_is_an_error(lab, presses):
    with tactus_client.connect(lab.endpoint) as client:
        run = client.run(presses, times=1000)
        with client.events() as events:
            wait_for(events, run.run_id, "dwell_done")
        lab.daemon.process.kill()
        with pytest.raises(tactus_client.NoAnswer, match="disappeared"):
            run.wait()
    opened = tactus_client.open(run)
    assert opened.exit_status is None and len(opened.frames) > 0
    assert any("no end" in warning for warning in opened.warnings)


def test_the_status_and_a_frame_show_themselves(client):
    status = client.status()
    assert (status.rig, status.simulated, status.covering_mm) == ("bench", True, pytest.approx(1.016))
    assert "SIMULATED" in repr(status) and "SIMULATED" in status._repr_html_()
    frame = next(client.frames(history=1))
    shown = frame._repr_html_()
    assert shown.count("<td") == 48 and "SIMULATED" in shown and f"frame {frame.seq}" in shown


def test_the_environment_names_the_service(standing_lab, monkeypatch):
    monkeypatch.setenv("TACTUS_ENDPOINT", standing_lab.endpoint)
    with tactus_client.connect() as client:
        assert client.rig == "bench"
    monkeypatch.setenv("TACTUS_RIG", "no such name")
    with pytest.raises(ValueError, match="rig name"):
        tactus_client.connect()


def test_the_folder_of_runs_is_asked_for_where_it_is_not_known(client, tmp_path):
    (tmp_path / "empty").mkdir()
    assert list(client.runs(tmp_path / "empty")) == []
    assert repr(client.runs(Path(tmp_path / "empty"))).startswith("<0 runs in")
