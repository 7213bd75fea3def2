"""As fast as it goes: 1000 frames a second through the whole service."""

from lab import Folder, Service, at_least, check, plug, rig_file, until_gone


def check_1_khz():
    """rates: the service takes 1000 frames a second from a serial port, and loses none"""
    with Folder() as folder:
        rig = rig_file(folder, rate_hz=1000.0)
        with plug("--sensor", "cdc-acm", "--stage", "cdc-acm", rig=rig), Service(rig) as service:
            begin = service.until_connected()["sensor"]
            end = service.until("frames come", lambda said: said["sensor"]["frames"] >= begin["frames"] + 10_000)["sensor"]
            check("frames", at_least(10_000), end["frames"] - begin["frames"])
            check("frames lost", 0, end["frames_lost"] - begin["frames_lost"])
            check("frames dropped on the bus", 0, end["frames_dropped_on_bus"] - begin["frames_dropped_on_bus"])
    until_gone()
