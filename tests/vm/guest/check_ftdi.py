"""The same rig behind FTDI chips."""

from check_streaming import run_on
from lab import Folder, Service, check, plug, rig_file, until_gone

PORT = "/dev/serial/by-id/usb-Tactus_SIM_virtual_{0}_SIM-{1}-if00-port0"
SENSOR, STAGE = PORT.format("sensor", "SENSOR"), PORT.format("stage", "STAGE")


def check_a_run():
    """ftdi: an experiment over two adapters with FTDI chips"""
    with (
        Folder() as folder,
        plug("--sensor", "ftdi", "--stage", "ftdi"),
        Service(rig_file(folder, SENSOR, STAGE)) as service,
    ):
        run_on(folder, service, "ftdi")
        check("frames lost since the start", 0, service.status()["sensor"]["frames_lost"])
    until_gone()


def check_unplugged_and_plugged_in_again():
    """ftdi: the sensor's adapter is unplugged and plugged into another port"""
    with (
        Folder() as folder,
        plug("--sensor", "ftdi", "--stage", "ftdi") as mock,
        Service(rig_file(folder, SENSOR, STAGE)) as service,
    ):
        service.until_connected()
        mock.do("sensor unplug")
        service.until("the sensor is lost", lambda said: not said["sensor"]["connected"])
        mock.do("sensor plug elsewhere")
        before = service.until_connected()["sensor"]["frames"]
        after = service.until("frames come again", lambda said: said["sensor"]["frames"] >= before + 30)
        check("connected again", True, after["sensor"]["connected"])
    until_gone()
