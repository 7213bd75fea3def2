"""Stock tools open the files of a run: mcap, mcap-protobuf-support and pyarrow."""

import json
import math
import subprocess
import sys
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from lab import binary, tactus
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory


@pytest.fixture(scope="module")
def table(element_centres, tmp_path_factory):
    path = tmp_path_factory.mktemp("table") / "table.parquet"
    tactus("export", element_centres["recording"], "--out", path)
    return path


def test_every_message_and_row_agrees_with_the_output_of_tactus(element_centres, table, tmp_path):
    info = tmp_path / "info.json"
    info.write_text(json.dumps(tactus("record", "info", element_centres["recording"])))
    checker = Path(__file__).with_name("check_recording.py")
    subprocess.run([sys.executable, checker, element_centres["recording"], info, table], check=True)


def test_the_recording_opens_with_stock_mcap(element_centres):
    with open(element_centres["recording"], "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        summary = reader.get_summary()
        topics = {channel.topic for channel in summary.channels.values()}
        assert "tactus/sim/sensor/frame" in topics
        attachments = {attachment.name for attachment in reader.iter_attachments()}
        assert {"rig.json", "rig.toml", "element-centres.star", "versions.json"} <= attachments
        frames = [frame for *_, frame in reader.iter_decoded_messages(topics=["tactus/sim/sensor/frame"])]
    assert len(frames) == element_centres["frames"]
    assert all(len(frame.counts) == 48 and frame.simulated for frame in frames)
    assert [frame.seq for frame in frames] == list(range(frames[0].seq, frames[0].seq + len(frames)))


def test_a_recording_that_was_damaged_and_cut_opens_with_stock_mcap_once_it_is_recovered(element_centres, tmp_path):
    damaged, recovered = tmp_path / "damaged.mcap", tmp_path / "recovered.mcap"
    content = bytearray(Path(element_centres["recording"]).read_bytes())
    # One bit in the middle, and no end.
    content[len(content) // 2] ^= 1
    damaged.write_bytes(content[: len(content) * 9 // 10])
    told = tactus("recover", damaged, "--out", recovered, check=False)
    with open(recovered, "rb") as file:
        topics = ["tactus/sim/sensor/frame"]
        reader = make_reader(file, decoder_factories=[DecoderFactory()], validate_crcs=True)
        seqs = [frame.seq for *_, frame in reader.iter_decoded_messages(topics=topics)]
    assert seqs == sorted(set(seqs)), told
    # A tenth is cut off, and a chunk holds half a second.
    assert len(seqs) > 0.85 * element_centres["frames"], told


def test_the_table_opens_with_pyarrow_and_holds_the_press(element_centres, table):
    rows = pq.read_table(table)
    assert rows.num_rows == element_centres["frames"]
    assert json.loads(rows.schema.metadata[b"tactus.rig"])["schema"] == "tactus.rig/1"
    columns = rows.to_pydict()
    assert set(columns["press"]) == set(range(-1, 48))
    assert set(columns["phase"]) == {"idle", "approach", "load", "hold", "unload", "retract"}
    assert all(later > earlier for earlier, later in zip(columns["t_ns"], columns["t_ns"][1:]))
    depths = {round(-z, 1) for z, phase in zip(columns["z_mm"], columns["phase"]) if phase == "hold"}
    assert depths == {0.2, 0.3, 0.4, 0.5, 0.6}
    assert all(math.isfinite(x) for x in columns["x_mm"])


def test_a_table_with_a_wrong_column_is_refused_with_its_name(table, tmp_path):
    rows = pq.read_table(table)
    index = rows.schema.get_field_index("press")
    wrong = rows.set_column(index, "press", rows["press"].cast("float64")).replace_schema_metadata(rows.schema.metadata)
    path = tmp_path / "wrong.parquet"
    pq.write_table(wrong, path)
    said = subprocess.run([binary("tactus"), "validate", path], capture_output=True, text=True)
    assert said.returncode == 1
    assert "press" in said.stderr
