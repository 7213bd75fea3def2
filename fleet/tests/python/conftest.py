"""A fleet of synthetic runs, and the program."""

import os
import subprocess
from pathlib import Path

import pytest

PROGRAMS = Path(os.environ["TACTUS_FLEET_PROGRAMS"]).absolute()


def run(*args, cwd, env=None):
    """Runs a program of the fleet; what it printed."""
    command = [PROGRAMS / args[0], *args[1:]]
    done = subprocess.run([str(arg) for arg in command], cwd=cwd, env=env and os.environ | env, capture_output=True, text=True)
    assert done.returncode == 0, done
    return done.stdout


@pytest.fixture(scope="session")
def lab(tmp_path_factory):
    """A folder with a fleet of two rigs, three days each, and the tables that it was made of."""
    folder = tmp_path_factory.mktemp("lab")
    run("examples/synthetic_tables", "tables", 2, 3, 1000, cwd=folder)
    run("tactus-fleet", "ingest", *sorted(folder.glob("tables/*")), "--to", "fleet", cwd=folder)
    return folder
