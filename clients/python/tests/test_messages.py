import pytest

from tactus_client import messages


def test_a_frame_is_read_from_golden_bytes(golden):
    frame = messages.Frame.FromString(golden("frame.hex"))
    assert (frame.seq, frame.epoch, frame.device_tick) == (300, 2, 7)
    assert (frame.t_mono_ns, frame.t_wall_ns) == (1_000_000_000, 5)
    assert list(frame.counts) == [100.0, -0.5]
    assert (frame.flags, frame.lost_before, frame.simulated) == (1, 3, True)
    assert frame.SerializeToString(deterministic=True) == golden("frame.hex")


def test_a_run_event_is_read_from_golden_bytes(golden):
    event = messages.RunEvent.FromString(golden("run_event.hex"))
    assert (event.seq, event.run_id) == (9, "r1")
    assert event.WhichOneof("event") == "finished"
    assert messages.name_of(event.finished, "exit_status") == "EXIT_STATUS_DEGRADED"
    assert event.finished.message == "ok"


def test_every_message_of_the_bus_has_a_class_of_its_name():
    for name in [
        "Frame",
        "SensorInfo",
        "StageState",
        "RunEvent",
        "RunState",
        "SafetyEvent",
        "Health",
        "RunRequest",
        "CommandRequest",
        "CommandReply",
    ]:
        assert messages.encoding(getattr(messages, name)) == f"application/protobuf;tactus.v1.{name}"


def test_a_value_of_a_later_version_is_returned_as_its_number():
    state = messages.RunState(phase=99)
    assert messages.name_of(state, "phase") == "99"


def test_invalid_bytes_are_refused():
    with pytest.raises(messages.DecodeError):
        messages.Frame.FromString(b"\x0a\x7f\x00")
