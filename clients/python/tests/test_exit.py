"""A program ends when its last line is done, whatever it left open."""

import os
import signal
import subprocess
import sys

import pytest

BEGINNING = """
import sys
import tactus_client
client = tactus_client.connect(sys.argv[1])
"""

FORGOTTEN = {
    "a loop that is left": "for frame in client.frames():\n    break",
    "a stream that stays open": "frames = client.frames(); next(frames)",
    "streams of every kind": "streams = [client.frames(), client.events(), client.states()]; next(streams[0])",
    "a client that nobody has any more": "frames = client.frames(); del client; next(frames)",
    "two clients": "other = tactus_client.connect(sys.argv[1]); next(other.frames()); next(client.frames())",
    "a lease": "lease = client.lease(); next(client.frames())",
    "a run": "client.run('corners'); next(client.frames())",
    "a closed client": "frames = client.frames(); next(frames); client.close()",
    "a thread that reads": (
        "import threading\n"
        "frames = client.frames()\n"
        "threading.Thread(target=lambda: list(frames), daemon=True).start()\n"
        "next(client.frames())"
    ),
    "an event loop": "import asyncio\nframes = client.frames()\nasyncio.run(asyncio.to_thread(frames.receive))",
}


def run(script, endpoint):
    """Runs a script to its end; only a hang takes a minute."""
    return subprocess.run([sys.executable, "-c", BEGINNING + script, endpoint], capture_output=True, text=True, timeout=60)


@pytest.mark.parametrize("script", FORGOTTEN.values(), ids=FORGOTTEN.keys())
def test_a_program_ends_whatever_it_forgot(pulse, script):
    done = run(script, pulse)
    assert (done.returncode, done.stderr) == (0, "")


def test_an_exception_ends_the_program(pulse):
    done = run("for frame in client.frames():\n    raise RuntimeError('seen enough')", pulse)
    assert done.returncode == 1
    assert done.stderr.endswith("RuntimeError: seen enough\n")


@pytest.mark.parametrize("wait", ["list(client.events())", "for frame in client.frames(): pass"])
def test_ctrl_c_ends_the_program(pulse, wait):
    script = BEGINNING + f"next(client.frames()); print('ready', flush=True)\n{wait}"
    # As from a terminal: a shell may have told its background jobs to ignore Ctrl-C.
    process = subprocess.Popen(
        [sys.executable, "-c", f"import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n{script}", pulse],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout.readline() == "ready\n"
    process.send_signal(signal.SIGINT)
    _, told = process.communicate(timeout=60)
    assert process.returncode == -signal.SIGINT
    assert told.endswith("KeyboardInterrupt\n")


@pytest.mark.parametrize("fate", [signal.SIGKILL, signal.SIGSTOP], ids=["dies", "hangs"])
def test_a_service_that_goes_away_holds_no_program(pulse_process, fate):
    endpoint, service = pulse_process
    script = f"lease = client.lease(); frames = client.frames(); next(frames)\nimport os; os.kill({service.pid}, {int(fate)})"
    try:
        done = run(script, endpoint)
        assert (done.returncode, done.stderr) == (0, "")
    finally:
        if fate == signal.SIGSTOP:
            os.kill(service.pid, signal.SIGCONT)


def test_a_stream_that_nobody_has_ends(pulse):
    script = """
import gc, weakref
frames = client.frames()
ended = weakref.ref(frames)
next(frames)
del frames
gc.collect()
assert ended() is None
"""
    assert run(script, pulse).returncode == 0
