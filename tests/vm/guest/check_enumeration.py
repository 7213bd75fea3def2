"""The kernel and udev recognise our devices."""

from pathlib import Path

from lab import REPOSITORY, SENSOR, STAGE, check, plug, until_gone, usb_devices, wait

HID_LINK = REPOSITORY / "config/links/digitacts-hid.toml"
BULK_LINK = REPOSITORY / "config/links/digitacts.toml"


def check_each_device_has_its_numbers_and_its_name():
    """enumeration: each device has its ids, its serial number and a permanent name"""
    with (
        plug("--sensor", "cdc-acm", "--stage", "cdc-acm"),
        plug("--sensor", "ftdi", "--serial", "SIM-FTDI"),
        plug("--sensor", "hid", "--link", HID_LINK, "--serial", "SIM-HID"),
        plug("--sensor", "bulk", "--link", BULK_LINK, "--serial", "SIM-BULK"),
        plug("--sensor", "cdc-acm", "--stage", "cdc-acm", "--composite"),
    ):
        wanted = {
            "SIM-SENSOR": ("1209:0001", "virtual sensor"),
            "SIM-STAGE": ("1209:0002", "virtual stage"),
            "SIM-FTDI": ("0403:6001", "virtual sensor"),
            "SIM-HID": ("1209:0003", "virtual sensor"),
            "SIM-BULK": ("1209:0004", "virtual sensor"),
            "SIM-RIG": ("1209:0005", "virtual rig"),
        }
        wait("all devices are enumerated", lambda: len(usb_devices()) == len(wanted), 30)
        check("what the kernel enumerates", wanted, usb_devices())
        names = [
            SENSOR,
            STAGE,
            "/dev/serial/by-id/usb-Tactus_SIM_virtual_sensor_SIM-FTDI-if00-port0",
            "/dev/serial/by-id/usb-Tactus_SIM_virtual_rig_SIM-RIG-if00",
            "/dev/serial/by-id/usb-Tactus_SIM_virtual_rig_SIM-RIG-if02",
        ]
        for name in names:
            wait(f"udev names {name}", Path(name).exists, 30)
        nodes = sorted(Path(name).resolve().name for name in names)
        check("serial ports behind the permanent names", ["ttyACM0", "ttyACM1", "ttyACM2", "ttyACM3", "ttyUSB0"], nodes)
        wait("the report device", Path("/dev/hidraw0").exists, 30)
    until_gone(*wanted)
    check("devices after unplugging", {}, usb_devices())
