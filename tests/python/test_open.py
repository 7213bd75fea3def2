"""`tactus_client.open` beside the output of Tactus itself: the same numbers."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from lab import tactus
from mcap.reader import make_reader

import tactus_client

DRIFT = """
def run(rig):
    tare()
    press(5.1, 4.9, depths_mm = [0.2, 0.4])
    covering(2.54)
    tare()
    press(5.1, 4.9, depths_mm = [0.8])
    move(1.0, 1.0)
    log("done", rig.name)
"""


@pytest.fixture(scope="module")
def runs(element_centres, tmp_path_factory):
    """Recordings that differ in what is hard about them."""
    folder = tmp_path_factory.mktemp("runs")
    (folder / "drift.star").write_text(DRIFT)
    made = {"element centres": Path(element_centres["recording"])}
    made["a change of covering"] = Path(tactus("run", "drift.star", "--embedded", "--no-report", cwd=folder)["recording"])
    made = {name: folder / path for name, path in made.items()}
    whole = made["element centres"].read_bytes()
    with made["element centres"].open("rb") as file:
        chunks = make_reader(file).get_summary().chunk_indexes
    in_chunk = chunks[len(chunks) // 3].chunk_start_offset + 200
    for name, content in {
        "cut in a chunk": whole[: len(whole) * 6 // 10],
        "a chunk damaged": flipped(whole, in_chunk),
        "damaged and cut": flipped(whole, in_chunk)[: len(whole) * 7 // 10],
    }.items():
        path = folder / "damaged" / name.replace(" ", "-") / "recording.mcap"
        path.parent.mkdir(parents=True)
        path.write_bytes(content)
        made[name] = path
    return made


def flipped(content, at):
    content = bytearray(content)
    content[at] ^= 1
    return bytes(content)


ALL = ["element centres", "a change of covering", "cut in a chunk", "a chunk damaged", "damaged and cut"]
WHOLE = ALL[:2]


@pytest.mark.parametrize("name", ALL)
def test_the_frames_are_the_rows_of_the_export(runs, name, tmp_path):
    # Of damaged recordings it warns with its exit code.
    tactus("export", runs[name], "--out", tmp_path / "table.parquet", check=name in WHOLE)
    table = pq.read_table(tmp_path / "table.parquet")
    run = tactus_client.open(runs[name])
    frames = run.frames
    assert len(frames) == table.num_rows > 0
    for column in ["t_ns", "press", "x_mm", "y_mm", "z_mm", "covering_mm"]:
        assert (frames[column].to_numpy() == table[column].to_numpy()).all(), column
    assert frames["phase"].tolist() == table["phase"].to_pylist()
    counts = np.array(table["counts"].to_pylist(), dtype=np.float32)
    assert (run.counts == counts).all()
    assert (frames[[f"counts_{element}" for element in range(48)]].to_numpy() == counts).all()
    assert (run.rig, run.run_id) == (json.loads(table.schema.metadata[b"tactus.rig"]), table["run"][0].as_py())


def test_the_temperature_is_the_one_of_the_sensor(tmp_path):
    # The board of five magnetometers tells its temperature.
    rig = (Path(__file__).parents[2] / "config/rigs/sim.toml").read_text()
    for here, there in {
        "rows = 6": "rows = 5",
        "cols = 8": "cols = 3",
        "[0.9, 2.9, 5.1, 7.1, 9.1, 11.1, 13.3, 15.3]": "[0.9, 2.9, 4.9]",
        "[0.9, 2.9, 4.9, 6.9, 8.9, 10.9]": "[0.9, 2.9, 4.9, 6.9, 8.9]",
        "miswired = ": "# ",
        'protocol = "weiss-dsa"': 'protocol = "anyskin"',
    }.items():
        assert here in rig
        rig = rig.replace(here, there)
    (tmp_path / "board.toml").write_text(rig)
    (tmp_path / "rest.star").write_text("def run(rig):\n    wait(1.0)\n")
    made = tactus("run", "rest.star", "--rig-file", "board.toml", "--no-report", cwd=tmp_path)
    recording = tmp_path / made["recording"]
    # A board has no clock, of which the export warns with its exit code.
    tactus("export", recording, "--out", tmp_path / "table.parquet", check=False)
    told = pq.read_table(tmp_path / "table.parquet")["temperature_c"].to_numpy()
    assert (told == 25.0).all() and len(told) > 20
    assert (tactus_client.open(recording).frames["temperature_c"].to_numpy() == told).all()


@pytest.mark.parametrize("name", ALL)
def test_the_metadata_is_that_of_record_info(runs, name):
    info = tactus("record", "info", runs[name], check=name in WHOLE)
    told = tactus_client.open(runs[name]).metadata
    for key in ["run_id", "experiment", "rig", "who", "simulated", "continues", "exit_status", "message", "versions"]:
        assert told[key] == info[key], key
    for key in ["frames", "frames_lost", "frames_missing", "presses", "dwells"]:
        assert told[key] == info[key], key
    assert told["duration_s"] == pytest.approx(info["duration_s"])
    assert f"{told['started']:%Y-%m-%dT%H:%M:%SZ}" == info["started"]
    assert (told["completeness"] == "complete") == (info["completeness"]["state"] == "complete")


def test_rises_are_above_the_last_tare(runs):
    run = tactus_client.open(runs["a change of covering"])
    presses, rise, events = run.presses, run.rise, run.events
    tares = events[events.kind == "tare_done"]
    dwells = [detail for detail in events[events.kind == "dwell_done"].detail]
    assert len(tares) == 2 and len(dwells) == len(presses) == 3
    assert presses["covering_mm"].tolist() == [1.016, 1.016, 2.54]
    assert presses["element"].tolist() == [18, 18, 18]
    for index, dwell in enumerate(dwells):
        zero = np.array(tares.detail.iloc[int(index == 2)]["baseline_counts"], dtype=np.float32)
        mean = np.array(dwell["mean_counts"], dtype=np.float32) - zero
        told = presses.iloc[index][[f"rise_{element}" for element in range(48)]].to_numpy(dtype=np.float32)
        assert (told == mean).all()
        assert mean[18] > 50
        # The mean of the dwell's frames is what the service said it is.
        own = rise[(run.t_ns >= dwell["from_mono_ns"] - 20_000_000) & (run.t_ns <= dwell["to_mono_ns"])]
        assert own[18].mean() == pytest.approx(mean[18], abs=12)
    assert run.rise_counts.shape == (len(rise), 48)


def test_a_run_reads_in_pandas_polars_and_xarray(runs):
    run = tactus_client.open(runs["element centres"])
    frames, table, images = run.frames, run.to_polars(), run.to_xarray()
    assert dict(images.sizes) == {"time": len(frames), "row": 6, "column": 8}
    assert (images["rise_counts"].isel(row=1, column=2).values == run.rise[10].to_numpy()).all()
    assert images["col_centre_mm"].values.tolist() == run.rig["array"]["col_centres_mm"]
    assert (table["counts_10"].to_numpy() == frames["counts_10"].to_numpy()).all()
    assert table["run"].unique().to_list() == [run.run_id]
    # Simulated is told in each of them.
    assert "SIMULATED" in repr(run) and "SIMULATED" in run._repr_html_()
    assert table["simulated"].all() and images.attrs["simulated"] == 1
    for pandas_table in (frames, run.rise, run.presses, run.events, run.safety):
        assert pandas_table.attrs["simulated"] == 1
    pressed = frames[frames.phase == "hold"]
    assert set(pressed.press) == set(range(48))
    assert (run.parameters["depths_mm"], run.metadata["seed"]) == ([0.2, 0.3, 0.4, 0.5, 0.6], 3)
    assert "press(" in run.script


@pytest.mark.parametrize("name", ["cut in a chunk", "a chunk damaged", "damaged and cut"])
def test_a_damaged_recording_opens_as_far_as_it_goes_and_says_so(runs, name):
    whole, run = (tactus_client.open(runs[one]) for one in ("element centres", name))
    assert 0 < len(run.frames) < len(whole.frames)
    assert run.completeness != "complete"
    assert run.completeness in repr(run)
    assert any(run.completeness in warning for warning in run.warnings)
    assert "Note:" in run._repr_html_()
    assert ("cut" in name) == (run.exit_status is None)


@pytest.mark.parametrize("at", range(0, 100, 7))
def test_any_cut_gives_frames_or_an_error_that_says_what_to_do(runs, at, tmp_path):
    whole = runs["a change of covering"].read_bytes()
    path = tmp_path / "recording.mcap"
    path.write_bytes(whole[: len(whole) * at // 100])
    try:
        run = tactus_client.open(path)
    except tactus_client.UnreadableRecording as error:
        assert at < 30 and "tactus recover" in str(error)
    else:
        assert len(run.frames) == len(run.rise) < 10_000
        assert run.completeness.startswith("readable up to byte")


def test_no_damage_at_the_start_goes_unnoticed(runs, tmp_path):
    whole = runs["a change of covering"].read_bytes()
    path = tmp_path / "recording.mcap"
    told = (recorded := tactus_client.open(runs["a change of covering"])).metadata
    start = whole.index(b"rig.json") + 2_000
    for at in range(8, start, 211):
        path.write_bytes(flipped(whole, at))
        try:
            damaged = tactus_client.open(path)
        except tactus_client.UnreadableRecording:
            continue
        assert damaged.rig == recorded.rig
        same = (damaged.parameters, damaged.script, damaged.metadata) == (recorded.parameters, recorded.script, told)
        assert same or damaged.warnings, at


def test_a_run_is_found_by_path_folder_id_and_part_of_an_id(runs):
    path = runs["a change of covering"]
    run_id, folder = path.parent.name, path.parent.parent
    for found in [
        tactus_client.open(path),
        tactus_client.open(str(path)),
        tactus_client.open(path.parent),
        tactus_client.open(run_id, folder),
        tactus_client.open(run_id[:-3], folder),
    ]:
        assert found.run_id == run_id
    with pytest.raises(tactus_client.UnknownRun, match="no run 'nothing'"):
        tactus_client.open("nothing", folder)
    with pytest.raises(FileNotFoundError, match="no recording"):
        tactus_client.open(folder / "absent.mcap")
    with pytest.raises(FileNotFoundError, match="name the folder"):
        tactus_client.open("run", folder / "absent")
    (folder / "other.mcap").write_text("no recording")
    with pytest.raises(tactus_client.UnreadableRecording, match="not the recording of a run"):
        tactus_client.open(folder / "other.mcap")


def test_several_runs_are_listed_in_the_order_of_their_start(runs):
    folder = runs["cut in a chunk"].parents[1]
    (folder / "sub").mkdir()
    shutil.copy(runs["a change of covering"], folder / "sub" / "recording.mcap")
    listed = tactus_client.runs(folder)
    assert [run.started for run in listed] == sorted(run.started for run in listed)
    ids = {run["run_id"] for run in tactus("runs", "--runs", folder)["runs"]}
    assert {run.run_id for run in listed} == ids
    assert listed[-1].run_id in listed._repr_html_()
    assert len(listed) == 4
    with pytest.raises(tactus_client.UnknownRun, match="which"):
        tactus_client.open("element", folder)


def test_opening_reads_only_the_start(runs):
    run = tactus_client.open(runs["element centres"])
    assert not {"_contents", "_timeline"} & set(vars(run))
    assert run.simulated and run.rig["name"] == "sim"
    assert not {"_contents", "_timeline"} & set(vars(run))


def test_without_numpy_an_error_says_what_to_install():
    script = "import sys; sys.modules['numpy'] = None; import tactus_client; tactus_client.open('x')"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert "pip install 'tactus-client[pandas]'" in done.stderr
