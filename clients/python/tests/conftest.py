"""Fixtures: golden bytes, free ports, and the example publisher in place of a service."""

import json
import os
import shutil
import socket
import subprocess
from pathlib import Path

import pytest

HERE = Path(__file__).parent
REPOSITORY = HERE.parents[2]


@pytest.fixture
def golden():
    """Reads the bytes of a golden file."""

    def read(name: str) -> bytes:
        lines = (HERE / "golden" / name).read_text().splitlines()
        return bytes.fromhex("".join(line.split("#")[0] for line in lines))

    return read


@pytest.fixture
def free_endpoint() -> str:
    """An endpoint on which nothing listens."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        return f"tcp/127.0.0.1:{server.getsockname()[1]}"


@pytest.fixture(scope="session")
def pulse_program() -> str:
    """The publisher of synthetic frames: $TACTUS_PULSE, or built from this repository."""
    if program := os.environ.get("TACTUS_PULSE"):
        return program
    if not shutil.which("cargo") or not (REPOSITORY / "Cargo.toml").exists():
        pytest.skip("needs $TACTUS_PULSE, or cargo and the repository")
    built = subprocess.run(
        ["cargo", "build", "-p", "tactus-bus", "--example", "pulse", "--message-format", "json"],
        cwd=REPOSITORY,
        check=True,
        stdout=subprocess.PIPE,
        text=True,
    )
    messages = map(json.loads, built.stdout.splitlines())
    programs = [message["executable"] for message in messages if message.get("executable")]
    return programs[-1]


@pytest.fixture
def pulse(pulse_process):
    """The endpoint of a publisher at 200 Hz that loses every tenth frame at the device."""
    return pulse_process[0]


@pytest.fixture
def pulse_process(pulse_program, free_endpoint):
    """Starts that publisher, and gives its endpoint and its process."""
    process = subprocess.Popen([pulse_program, free_endpoint, "200", "10"], stdout=subprocess.PIPE, text=True)
    try:
        ready = json.loads(process.stdout.readline())
        assert ready["ready"] and ready["endpoint"] == free_endpoint
        yield free_endpoint, process
    finally:
        process.terminate()
        process.communicate()
