"""A stock zenoh client of a simulated sensor. The sensor behaves like a real one, but marks its frames as simulated."""

import socket

import tactus_client
from lab import Process, tactus


def free_endpoint():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"


def test_a_subscriber_follows_live_frames_at_one_kilohertz(tmp_path):
    endpoint = free_endpoint()
    args = ["--endpoint", endpoint, "simulate", "--live", "--array", "fingertip", "--scene", "cylinder", "--rate-hz", "1000"]
    sensor = Process("tactus", args, tmp_path)
    try:
        sensor.wait_for("simulated sensor")
        with tactus_client.connect(endpoint) as client:
            frames, lost = [], 0
            for frame in client.frames():
                lost += frame.lost_before
                frames.append(frame)
                if len(frames) == 2000:
                    break
    finally:
        sensor.end()
    assert all(frame.simulated for frame in frames)
    assert (len(frames[0].image), len(frames[0].image[0])) == (14, 20)
    # Every sequence number is a frame that arrived or one that was reported as lost.
    assert frames[-1].seq - frames[0].seq == len(frames) - 1 + lost - frames[0].lost_before
    # 2,000 frames are two seconds on the sensor's clock.
    assert frames[-1].device_tick - frames[0].device_tick == 1000 * (frames[-1].seq - frames[0].seq)
    peaks = [max(map(max, frame.image)) for frame in frames]
    assert max(peaks) > min(peaks) + 50, "the tool moves up and down"


def test_the_image_is_in_the_json(tmp_path):
    told = tactus("simulate", "--scene", "spaceship", "--array", "tekscan-5027", "--depth-mm", 0.5, cwd=tmp_path)
    assert told["simulated"]
    assert (len(told["image"]), len(told["image"][0])) == (26, 36)
    assert max(map(max, told["image"])) > 2 * told["image"][0][0]
