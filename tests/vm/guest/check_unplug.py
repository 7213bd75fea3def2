"""The service with cables that are unplugged and plugged in again."""

import json
import os
import time
from pathlib import Path

from lab import REPOSITORY, SENSOR, Folder, Service, between, check, plug, rig_file, that, until_gone, wait

RATE_HZ = 30
# The press is long enough to unplug the cable during it.
HOLD = """
def run(rig):
    tare()
    press(5.0, 5.0, depths_mm = [0.3], dwell_s = 4.0)
"""
PATIENT = {"reconnect_s = 10.0": "reconnect_s = 100.0"}
BOTH = ("--sensor", "cdc-acm", "--stage", "cdc-acm")


def is_lost(said) -> bool:
    return not said["sensor"]["connected"]


def lost_in(since: float) -> int:
    """The most frames since then, by the host's clock; one second is added for frames in transit."""
    return round((time.monotonic() - since + 1) * RATE_HZ)


def check_idle():
    """unplug: without a run; back in the same port, then in another port"""
    with Folder() as folder, plug(*BOTH) as mock, Service(rig_file(folder)) as service:
        service.until_connected()
        for back in ("sensor plug", "sensor plug elsewhere"):
            lost_before = service.status()["sensor"]["frames_lost"]
            out = time.monotonic()
            mock.do("sensor unplug")
            said = service.until("the sensor is lost", is_lost)
            check(f"before {back!r}: sensor connected, stage", [False, "not homed"],
                  [said["sensor"]["connected"], said["stage"]["status"]])
            down_s = time.monotonic() - out
            mock.do(back)
            said = service.until_connected()
            lost = said["sensor"]["frames_lost"] - lost_before
            check(f"{back}: frames lost while it was unplugged", between(round(down_s * RATE_HZ) - 15, lost_in(out)), lost)
        lost = service.status()["sensor"]["frames_lost"]
        service.until("frames come", lambda now: now["sensor"]["frames"] > said["sensor"]["frames"] + 60)
        check("frames lost after that", lost, service.status()["sensor"]["frames_lost"])
    until_gone()


def check_as_another_node():
    """unplug: back as another node, because a program holds the old one open; the permanent name finds it"""
    with Folder() as folder, plug(*BOTH) as mock, Service(rig_file(folder)) as service:
        service.until_connected()
        before = Path(SENSOR).resolve()
        holder = os.open(before, os.O_RDONLY | os.O_NOCTTY | os.O_NONBLOCK)
        mock.do("sensor unplug")
        service.until("the sensor is lost", is_lost)
        mock.do("sensor plug")
        service.until_connected()
        after = Path(SENSOR).resolve()
        os.close(holder)
        check("the node after plugging in again", that(f"not {before}", lambda seen: seen != str(before)), str(after))
    until_gone()


def check_the_wrong_one():
    """unplug: another sensor in its place is not used"""
    with Folder() as folder, plug(*BOTH) as mock, Service(rig_file(folder)) as service:
        service.until_connected()
        node = Path(SENSOR).resolve()
        mock.do("sensor unplug")
        service.until("the sensor is lost", is_lost)
        wait("its node is gone", lambda: not node.exists(), 30)
        with plug("--sensor", "cdc-acm", "--serial", "SIM-OTHER"):
            wait("the other one has its node", node.exists, 30)
            seen = {service.status()["sensor"]["connected"] for _ in range(5)}
            check("connected to the other one", {False}, seen)
        until_gone("SIM-OTHER")
        mock.do("sensor plug")
        check("connected to its own again", True, service.until_connected()["sensor"]["connected"])
    until_gone()


def check_another_array_under_the_same_name():
    """unplug: an array of another size is refused with a message that says so"""
    smaller = {"rows = 6": "rows = 5", "6.9, 8.9, 10.9]": "6.9, 8.9]"}
    with Folder() as folder, Folder() as other:
        refusal = "the frame has 40 elements, the rig's array has 48"
        with plug(*BOTH, rig=rig_file(other, **smaller)), Service(rig_file(folder), says=refusal) as service:
            check("the message of the service", that(f"{refusal!r}", lambda said: refusal in said), service.said.split("error=")[-1])
    until_gone()


def pressing(service) -> dict:
    return service.until("the tip presses", lambda said: said["run"]["phase"] == "running" and said["stage"]["z_mm"] < -0.2)


def summary_of(client) -> tuple[int, dict]:
    status = client.wait()
    return status, json.loads(client.until(lambda line: line.startswith("{"), "a summary"))


def check_in_a_run():
    """unplug: the sensor, in the middle of a press; the press is repeated, and the gap is counted"""
    with Folder() as folder, plug(*BOTH) as mock, Service(rig_file(folder, **PATIENT)) as service:
        service.until_connected()
        client = service.start_run(HOLD)
        pressing(service)
        out = time.monotonic()
        mock.do("sensor unplug")
        service.until("the sensor is lost", is_lost)
        mock.do("sensor plug")
        status, summary = summary_of(client)
        check("exit status of the run, how it ended, presses", [3, "degraded", 1],
              [status, summary["exit_status"], summary["presses"]])
        check("frames lost in the run", between(1, lost_in(out)), summary["frames_lost"])
        check("height of the tip, mm", that("at least 1.9", lambda seen: seen >= 1.9), service.status()["stage"]["z_mm"])
    until_gone()


def check_the_stage_in_a_run():
    """unplug: the stage, in the middle of a press; the run fails and says that the tip is not retracted"""
    with Folder() as folder, plug(*BOTH) as mock, Service(rig_file(folder, **PATIENT)) as service:
        service.until_connected()
        client = service.start_run(HOLD)
        pressing(service)
        mock.do("stage unplug")
        status, summary = summary_of(client)
        check("exit status of the run, how it ended", [1, "failed"], [status, summary["exit_status"]])
        check("message of the run", that("that the tip is not retracted", lambda said: "THE TIP IS NOT RETRACTED" in said),
              summary["message"])
        mock.do("stage plug")
        said = service.until_connected()
        check("plugged in again: sensor connected, stage", [True, "not homed"],
              [said["sensor"]["connected"], said["stage"]["status"]])
    until_gone()
