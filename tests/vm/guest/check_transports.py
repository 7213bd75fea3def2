"""The service finds every kind of USB device by its identity, and `tactus devices` says what to write for it."""

import json

from check_enumeration import BULK_LINK, HID_LINK
from check_streaming import run_on
from lab import SENSOR, Folder, Service, check, plug, rig_file, until_gone

SERIAL = '{ kind = "serial", usb = { vid = 0x1209, pid = 0x0001, serial = "SIM-SENSOR" }, baud = 115200 }'
HID = '{ kind = "hid", vid = 0x1209, pid = 0x0003, serial = "SIM-SENSOR", interface = 0 }'
BULK = (
    '{ kind = "usb", vid = 0x1209, pid = 0x0004, serial = "SIM-SENSOR", interface = 0, endpoint_in = 0x81, '
    "endpoint_out = 0x01 }"
)


def speaking(folder, transport, link=None):
    """The shipped rig with its sensor on another transport, and with a described frame format if there is a link file."""
    changes = {f'{{ kind = "serial", path = "{SENSOR}", baud = 115200 }}': transport}
    if link:
        changes['protocol = "weiss-dsa"'] = f'protocol = "declared"\nformat = "{link}"'
    return rig_file(folder, **changes)


def run_with(kind, transport, link=None):
    with Folder() as folder:
        rig = speaking(folder, transport, link)
        with plug("--sensor", kind, "--stage", "cdc-acm", rig=rig), Service(rig) as service:
            run_on(folder, service, kind)
    until_gone()


def check_a_run_over_hid():
    """transports: an experiment whose sensor sends HID reports"""
    run_with("hid", HID, HID_LINK)


def check_a_run_over_bulk():
    """transports: an experiment whose sensor has a bulk endpoint"""
    run_with("bulk", BULK, BULK_LINK)


def found_elsewhere(kind, transport, link=None):
    with Folder() as folder:
        rig = speaking(folder, transport, link)
        with plug("--sensor", kind, "--stage", "cdc-acm", rig=rig) as mock, Service(rig) as service:
            service.until_connected()
            mock.do("sensor unplug")
            gone = service.until("the sensor is gone", lambda said: not said["sensor"]["connected"])
            before = gone["sensor"]["frames"]
            mock.do("sensor plug elsewhere")
            service.until("frames again", lambda said: said["sensor"]["connected"] and said["sensor"]["frames"] > before)
            check(f"{kind}: read again after it was unplugged and plugged in elsewhere", True, True)
    until_gone()


def check_found_elsewhere():
    """transports: a device that is named by its identity is found at any port"""
    found_elsewhere("cdc-acm", SERIAL)
    found_elsewhere("hid", HID, HID_LINK)
    found_elsewhere("bulk", BULK, BULK_LINK)


def check_what_to_write():
    """transports: `tactus devices` says what to write into a rig file for each device, and which rig uses it"""
    with Folder() as folder:
        rig = speaking(folder, HID, HID_LINK)
        with plug("--sensor", "hid", "--stage", "cdc-acm", rig=rig), Service(rig) as service:
            service.until_connected()
            said = json.loads(service.tactus("devices", "--rig", rig).stdout)
            ours = [device for device in said["devices"] if (device["serial"] or "").startswith("SIM")]
            check("the line for the rig file is shown", True, HID in [device["transport"] for device in ours])
            claimed = sorted(link["role"] for device in ours for link in device["rigs"])
            check("roles of the devices in the rig", ["sensor", "stage"], claimed)
            check("missing devices", [], said["missing"])
            check("the service holds them", {"held"}, {device["access"] for device in ours if device["rigs"]})
    until_gone()
