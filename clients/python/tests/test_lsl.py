import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import tactus_client

pytest.importorskip("pylsl", exc_type=(ImportError, RuntimeError))


@pytest.fixture
def own_network():
    """The beginning of a command that runs in a network of its own."""
    command = ["unshare", "--user", "--map-root-user", "--net"]
    if not shutil.which("unshare") or subprocess.run([*command, "true"], capture_output=True).returncode:
        pytest.skip("this machine allows no network namespaces, and LSL would listen on all interfaces")
    return command


def test_frames_arrive_in_an_inlet_with_the_times_of_their_arrival(own_network, pulse_program):
    script = Path(__file__).with_name("lsl_round_trip.py")
    done = subprocess.run([*own_network, sys.executable, script, pulse_program], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["name"] == "Tactus pulse (SIMULATED)"
    assert (told["channels"], told["rate_hz"], told["simulated"]) == (48, 200.0, "true")
    # LSL's clock and the wall clock go equally fast.
    offsets_s = told["offsets_s"]
    assert len(offsets_s) == 200
    assert max(offsets_s) - min(offsets_s) < 0.1


def test_an_outlet_wants_to_hear_that_it_can_be_reached(pulse):
    from tactus_client.lsl import FrameOutlet

    with tactus_client.connect(pulse) as client, pytest.raises(ValueError, match="all interfaces"):
        FrameOutlet(client)
