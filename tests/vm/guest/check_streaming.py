"""The service runs an experiment on a rig whose devices are both on USB."""

import json

from lab import Folder, Hung, Service, check, at_least, plug, rig_file, until_gone

PRESSES = """
def run(rig):
    tare()
    for i in range(2):
        press(5.0, 5.0, depths_mm = [0.2, 0.4])
"""


def run_on(folder, service, what):
    """Runs the experiment and checks its summary."""
    service.until_connected()
    client = service.start_run(PRESSES)
    status = client.wait()
    summary = json.loads(client.until(lambda line: line.startswith("{"), "a summary"))
    if "error" in summary:
        raise Hung(f"no run: {summary}")
    check(f"{what}: exit status of the run, and its message", [0, ""], [status, summary["message"]])
    check(f"{what}: how it ended, presses, dwells, frames lost", ["done", 2, 4, 0],
          [summary["exit_status"], summary["presses"], summary["dwells"], summary["frames_lost"]])
    check(f"{what}: frames recorded", at_least(100), summary["frames"])


def check_a_run():
    """streaming: an experiment over CDC-ACM, sensor and stage"""
    with Folder() as folder, plug("--sensor", "cdc-acm", "--stage", "cdc-acm"), Service(rig_file(folder)) as service:
        run_on(folder, service, "cdc-acm")
        check("frames lost since the start", 0, service.status()["sensor"]["frames_lost"])
    until_gone()


def check_a_run_on_one_cable():
    """streaming: the same with sensor and stage on one cable, as a composite device"""
    port = "/dev/serial/by-id/usb-Tactus_SIM_virtual_rig_SIM-RIG-if0"
    with (
        Folder() as folder,
        plug("--sensor", "cdc-acm", "--stage", "cdc-acm", "--composite"),
        Service(rig_file(folder, sensor=f"{port}0", stage=f"{port}2")) as service,
    ):
        run_on(folder, service, "composite")
    until_gone("SIM-RIG")
