import pytest

from tactus_client import frames, messages
from tactus_client.frames import Frame, Tally


def test_a_frame_has_the_fields_of_the_message(golden):
    frame = Frame.of(messages.Frame.FromString(golden("frame.hex")), shape=(1, 2))
    assert (frame.seq, frame.epoch, frame.device_tick) == (300, 2, 7)
    assert (frame.t_mono_ns, frame.t_wall_ns) == (1_000_000_000, 5)
    assert (frame.counts, frame.flags, frame.lost_before, frame.simulated) == ((100.0, -0.5), 1, 3, True)


def test_a_device_without_a_clock_has_no_tick():
    assert Frame.of(messages.Frame(seq=1), shape=None).device_tick is None
    assert Frame.of(messages.Frame(seq=1, device_tick=0), shape=None).device_tick == 0


def test_the_image_is_row_major_with_and_without_numpy(monkeypatch):
    frame = Frame.of(messages.Frame(counts=range(6)), shape=(2, 3))
    if frames.numpy is not None:
        assert frame.image.shape == (2, 3)
        assert frame.image.dtype == "float32"
        assert frame.image.tolist() == [[0, 1, 2], [3, 4, 5]]
    monkeypatch.setattr(frames, "numpy", None)
    assert frame.image == [[0, 1, 2], [3, 4, 5]]


def test_an_impossible_image_says_why():
    message = messages.Frame(counts=range(6))
    with pytest.raises(ValueError, match="has not told"):
        _ = Frame.of(message, shape=None).image
    with pytest.raises(ValueError, match="6 counts do not make 6 x 8"):
        _ = Frame.of(message, shape=(6, 8)).image


@pytest.mark.parametrize(
    "arrived, device_lost, bus_missing, restarts",
    [
        # Pairs of seq and lost_before.
        ([(5, 0), (6, 0), (7, 0)], 0, 0, 0),
        # Losses before the first frame are not between the first and the last.
        ([(5, 4), (6, 0)], 0, 0, 0),
        ([(5, 0), (9, 3)], 3, 0, 0),
        ([(5, 0), (9, 0)], 0, 3, 0),
        ([(5, 0), (9, 1), (10, 0)], 1, 2, 0),
        # `lost_before` cannot exceed the number of missing frames.
        ([(5, 0), (7, 9)], 1, 0, 0),
        # The service was restarted: nothing is known to be missing.
        ([(5, 0), (0, 0), (1, 0)], 0, 0, 1),
        ([(5, 0), (5, 0)], 0, 0, 1),
    ],
)
def test_device_losses_and_bus_losses_are_counted_separately(arrived, device_lost, bus_missing, restarts):
    tally = Tally()
    for seq, lost_before in arrived:
        tally.count(seq, lost_before)
    assert (tally.device_lost, tally.bus_missing, tally.restarts) == (device_lost, bus_missing, restarts)
    assert (tally.received, tally.first_seq, tally.last_seq) == (len(arrived), 5, arrived[-1][0])
