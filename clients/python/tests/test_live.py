"""Tests with a running publisher of synthetic frames: see ``pulse`` in ``conftest.py``."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
import zenoh

import tactus_client
from tactus_client import messages
from tactus_client.client import _config

COUNT_FRAMES = Path(__file__).parents[1] / "examples" / "count_frames.py"


@pytest.fixture
def client(pulse):
    with tactus_client.connect(pulse) as client:
        yield client


def test_frames_arrive_complete_and_all_losses_are_at_the_device(client):
    assert client.rig == "pulse"
    frames = client.frames()
    seen = [next(frames) for _ in range(500)]
    seqs = [frame.seq for frame in seen]
    # The publisher leaves out every tenth frame.
    assert seqs == [seq for seq in range(seqs[0], seqs[-1] + 1) if seq % 10 != 9]
    assert frames.missing == (seqs[-1] - seqs[0] + 1 - 500, 0)
    assert (frames.overrun, frames.unreadable) == (0, 0)
    for frame in seen:
        assert frame.simulated
        assert frame.shape == (6, 8)
        assert len(frame.image) == 6 and len(frame.image[0]) == 8
        assert all(100 <= counts <= 1000 for counts in frame.counts)


def test_a_late_subscriber_gets_past_and_live_frames(client):
    with client.frames() as early:
        while next(early).seq < 100:
            pass
        with client.frames() as late:
            # The service keeps 10 s of frames, and has run for less.
            assert next(late).seq == 0
            while next(late).seq <= early.tally.last_seq:
                pass
            assert late.missing.bus == 0
        with client.frames(history=1) as viewer:
            assert next(viewer).seq >= 100


def test_a_run_is_followed_by_its_events(client):
    reply = client.run("corners", depth_mm=0.3, seed=7)
    assert reply.state.experiment == "corners"
    client.pause("to look")
    client.resume()
    # A late subscriber gets the events from the beginning.
    with client.events() as events:
        client.stop("enough")
        seen = [next(events) for _ in range(4)]
    assert [event.seq for event in seen] == [0, 1, 2, 3]
    assert [event.WhichOneof("event") for event in seen] == ["started", "paused", "resumed", "finished"]
    started = seen[0].started
    assert (started.experiment, started.seed, started.who) == ("corners", 7, seen[0].started.who)
    assert started.who.startswith("python")
    assert json.loads(started.parameters_json) == {"depth_mm": 0.3}
    with client.states() as states:
        # The state follows the event, once the recording is closed.
        assert any(messages.name_of(state, "phase") == "RUN_PHASE_FINISHED" for state in states)
    assert client.status().rig == "pulse"


def test_a_refusal_is_an_error_that_says_why(client):
    with pytest.raises(tactus_client.Refused, match="no run is going on") as refused:
        client.pause()
    assert refused.value.exit_code == 1


def test_an_absent_rig_does_not_answer(pulse):
    no_answer = pytest.raises(tactus_client.NoAnswer, match="tactus/elsewhere/cmd/status")
    with tactus_client.connect(pulse, "elsewhere") as stranger, no_answer:
        stranger.status(timeout_s=3_600)


def test_a_closed_stream_ends(client):
    frames = client.frames()
    frames.close()
    frames.close()
    assert len(list(frames)) == frames.tally.received


def test_streams_end_with_the_client(client):
    events = client.events()
    client.close()
    assert list(events) == []


def test_the_example_counts(pulse):
    counted = subprocess.run(
        [sys.executable, COUNT_FRAMES, "--endpoint", pulse, "--frames", "200"],
        check=True,
        stdout=subprocess.PIPE,
        text=True,
    )
    tally = json.loads(counted.stdout)
    assert (tally["frames"], tally["bus_missing"]) == (200, 0)
    span = tally["last_seq"] - tally["first_seq"] + 1
    assert tally["device_lost"] == span - 200 > 0


def test_a_read_commands_nothing_and_a_stop_needs_no_name(pulse, monkeypatch):
    with tactus_client.connect(pulse) as client:
        client.run("corners")
        request = messages.CommandRequest(who="reader").SerializeToString()
        for selector in ["tactus/**", "tactus/*/cmd/*", "**", "tactus/pulse/cmd/*"]:
            for payload in [None, request]:
                # What is refused is not answered.
                replies = client._session.get(selector, payload=payload, target=zenoh.QueryTarget.ALL, timeout=0.05)
                assert [reply for reply in replies if reply.ok is not None] == []
        assert messages.name_of(client.status().state, "phase") == "RUN_PHASE_RUNNING"
        monkeypatch.setenv("TACTUS_RIG", "elsewhere")
        assert tactus_client.stop(pulse).rig == "pulse"
        assert messages.name_of(client.status().state, "phase") == "RUN_PHASE_FINISHED"


def test_the_lease_is_held_for_several_commands(client):
    with client.lease() as lease:
        assert lease.is_held and lease.secret
        client.run("corners")
        client.pause()
    assert not lease.is_held
    client.stop()


def test_frames_of_another_publisher_are_not_the_rigs(client, pulse):
    rogue = zenoh.open(_config(pulse))
    frames = client.frames(history=1)
    fake = messages.Frame(seq=10**9).SerializeToString()
    for _ in range(100):
        rogue.put("tactus/pulse/sensor/frame", fake, encoding=messages.encoding(messages.Frame))
    assert all(next(frames).seq < 10**9 for _ in range(50))
    rogue.close()
