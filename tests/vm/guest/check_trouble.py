"""The service with endpoints that stall and devices that are slow."""

from lab import Folder, Service, at_least, between, check, plug, rig_file, until_gone

BOTH = ("--sensor", "cdc-acm", "--stage", "cdc-acm")


def check_a_stalled_endpoint():
    """trouble: after a stall the kernel clears the halt, and the service receives frames again"""
    with Folder() as folder, plug(*BOTH) as mock, Service(rig_file(folder)) as service:
        before = service.until_connected()["sensor"]
        for _ in range(3):
            mock.do("sensor halt")
            seen = service.status()["sensor"]["frames"]
            service.until("frames come", lambda said: said["sensor"]["frames"] >= seen + 30)
        after = service.status()["sensor"]
        check("connected", True, after["connected"])
        check("frames lost by three stalls", between(0, 60), after["frames_lost"] - before["frames_lost"])
    until_gone()


def check_a_slow_sensor():
    """trouble: a slow sensor loses frames, which are counted; at its normal speed it loses none"""
    with Folder() as folder, plug(*BOTH) as mock, Service(rig_file(folder)) as service:
        before = service.until_connected()["sensor"]
        # 20 transfers a second for 30 frames a second: a third of them is lost.
        mock.do("sensor slow 50ms")
        slow = service.until(
            "frames are lost", lambda said: said["sensor"]["frames_lost"] >= before["frames_lost"] + 10
        )["sensor"]
        check("connected while it is slow", True, slow["connected"])
        mock.do("sensor slow 0s")
        # First, frames that had not been fetched arrive.
        begin = service.until("frames come", lambda said: said["sensor"]["frames"] >= slow["frames"] + 90)["sensor"]
        end = service.until("frames come", lambda said: said["sensor"]["frames"] >= begin["frames"] + 90)["sensor"]
        check("frames", at_least(90), end["frames"] - begin["frames"])
        check("frames lost at normal speed", 0, end["frames_lost"] - begin["frames_lost"])
    until_gone()


def check_a_silent_sensor():
    """trouble: a sensor that is silent for two seconds causes a gap of at least 59 frames"""
    with Folder() as folder, plug(*BOTH) as mock, Service(rig_file(folder)) as service:
        before = service.until_connected()["sensor"]
        mock.do("sensor stall 2s")
        after = service.until(
            "frames come again",
            lambda said: said["sensor"]["frames_lost"] > before["frames_lost"] and said["sensor"]["connected"],
        )["sensor"]
        check("frames lost", between(59, 150), after["frames_lost"] - before["frames_lost"])
    until_gone()
