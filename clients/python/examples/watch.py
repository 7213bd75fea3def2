"""Shows the live image in a terminal: denser characters are higher counts. Ctrl-C ends it."""

import argparse
import sys

import tactus_client

SHADES = " .:-=+*#%@"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--endpoint", help="default: the service of this machine")
    parser.add_argument("--rig", help="default: the one that is ready")
    options = parser.parse_args()

    try:
        client = tactus_client.connect(options.endpoint, options.rig)
    except (tactus_client.TactusError, ValueError) as error:
        sys.exit(str(error))
    with client:
        info = client.sensor_info()
        full_scale = info.full_scale_counts if info and info.full_scale_counts > 0 else 4095.0
        # A viewer needs no past frames.
        frames = client.frames(history=1)
        try:
            for frame in frames:
                show(frame, frames.missing, full_scale)
        except KeyboardInterrupt:
            pass
    return 0


def show(frame, missing, full_scale: float) -> None:
    """Draws one frame over the last one."""
    lines = []
    # Row 0 is at the origin corner, which is drawn at the bottom.
    for row in reversed(list(frame.image)):
        shades = (SHADES[min(int(max(counts, 0) / full_scale * len(SHADES)), len(SHADES) - 1)] for counts in row)
        lines.append("".join(shade * 2 for shade in shades))
    marks = "  SIMULATED" if frame.simulated else ""
    lines.append(f"frame {frame.seq}  lost at the device {missing.device}, on the bus {missing.bus}{marks}")
    print("\x1b[H\x1b[2J" + "\n".join(lines), flush=True)


if __name__ == "__main__":
    sys.exit(main())
