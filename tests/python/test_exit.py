"""Programs that forget what they opened at a real service."""

import subprocess
import sys

import tactus_client

FORGETFUL = """
import sys
import tactus_client
client = tactus_client.connect(sys.argv[1])
lease = client.lease()
for frame in client.frames():
    print(frame.simulated)
    break
"""


def test_a_program_that_forgets_its_streams_and_its_lease_ends_and_gives_the_lease_back(lab):
    # Only a hang takes a minute.
    done = subprocess.run([sys.executable, "-c", FORGETFUL, lab.endpoint], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout, done.stderr) == (0, "True\n", "")
    with tactus_client.connect(lab.endpoint) as client, client.lease() as lease:
        assert lease.is_held
