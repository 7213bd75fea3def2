"""Opens a recording and its measurement table with stock Python packages, and compares them with the output of Tactus.

    pip install mcap mcap-protobuf-support pyarrow
    cargo run -p tactus-record --example sample_recording -- DIR
    python tests/python/check_recording.py DIR/sample.mcap DIR/sample.json DIR/sample.parquet

The second file is the output of `tactus record info --json`. Any recording works, with or without a table.
"""

import argparse
import collections
import json
import sys

MESSAGES = {
    "sensor/frame": "tactus.v1.Frame",
    "sensor/info": "tactus.v1.SensorInfo",
    "stage/state": "tactus.v1.StageState",
    "run/event": "tactus.v1.RunEvent",
    "safety/state": "tactus.v1.SafetyEvent",
}
PHASES = {"idle", "approach", "load", "hold", "unload", "retract"}


def check_recording(path, info):
    """Reads the MCAP file; returns its frames and its rig."""
    from mcap.reader import make_reader
    from mcap_protobuf.decoder import DecoderFactory

    with open(path, "rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()], validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None, "the recording has no summary"
        schemas = {channel.topic: summary.schemas[channel.schema_id] for channel in summary.channels.values()}
        assert set(schemas) == {f"tactus/{info['rig']}/{suffix}" for suffix in MESSAGES}, set(schemas)
        for topic, schema in schemas.items():
            assert schema.name == MESSAGES[topic.split("/", 2)[2]], (topic, schema.name)
            assert schema.encoding == "protobuf", schema.encoding

        runs = [record.metadata for record in reader.iter_metadata() if record.name == "tactus.run"]
        assert len(runs) == 1, runs
        assert runs[0]["run_id"] == info["run_id"]
        assert runs[0]["simulated"] == str(info["simulated"]).lower()

        files = {attachment.name: attachment.data for attachment in reader.iter_attachments()}
        assert {"rig.json", "rig.toml", "versions.json", "parameters.json", runs[0]["script"]} <= set(files)
        assert {name: len(data) for name, data in files.items()} == {
            file["name"]: file["bytes"] for file in info["attachments"]
        }
        rig = json.loads(files["rig.json"])
        assert rig["schema"] == "tactus.rig/1"

        counts = collections.Counter()
        frames, dwells, statuses = [], set(), []
        for _, channel, message, decoded in reader.iter_decoded_messages(log_time_order=False):
            counts[channel.topic] += 1
            kind = channel.topic.split("/", 2)[2]
            if kind == "sensor/frame":
                assert message.log_time == message.publish_time == decoded.t_wall_ns
                assert message.sequence == decoded.seq % 2**32
                frames.append(decoded)
            elif kind == "run/event" and decoded.HasField("dwell_done"):
                dwells.add((decoded.dwell_done.press, decoded.dwell_done.dwell))
            elif kind == "run/event" and decoded.HasField("finished"):
                statuses.append(decoded.finished.exit_status)
    assert dict(counts) == info["topics"], (dict(counts), info["topics"])

    elements = rig["array"]["rows"] * rig["array"]["cols"]
    assert all(len(frame.counts) == elements for frame in frames)
    steps = [after.seq - before.seq for before, after in zip(frames, frames[1:])]
    assert len(frames) == info["frames"]
    assert sum(step - 1 for step in steps) == info["frames_lost"], "received = recorded + lost"
    assert sum(step > 1 for step in steps) == info["gaps"]
    assert len(dwells) == info["dwells"] and len({press for press, _ in dwells}) == info["presses"]
    assert len(statuses) == (info["exit_status"] is not None)
    return frames, rig


def check_table(path, info, frames, rig):
    """Reads the measurement table of this one recording."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    table = pq.read_table(path)
    assert {name: str(table.schema.field(name).type) for name in table.column_names} == {
        "run": "string",
        "press": "int32",
        "phase": "string",
        "t_ns": "int64",
        "x_mm": "double",
        "y_mm": "double",
        "z_mm": "double",
        "covering_mm": "double",
        "indenter": "string",
        "temperature_c": "double",
        "counts": "list<element: float not null>",
    }
    assert pa.types.is_float32(table.schema.field("counts").type.value_type)
    assert json.loads(table.schema.metadata[b"tactus.rig"]) == rig
    clock = json.loads(table.schema.metadata[b"tactus.clock"])
    assert clock["schema"] == "tactus.clock/1" and clock["runs"][0]["run"] == info["run_id"]

    rows = table.to_pydict()
    assert set(rows["run"]) == {info["run_id"]}
    assert rows["counts"] == [list(frame.counts) for frame in frames]
    assert all(after > before for before, after in zip(rows["t_ns"], rows["t_ns"][1:]))
    assert set(rows["phase"]) <= PHASES
    assert set(rows["indenter"]) <= set(rig["indenters"])
    for frame, t_ns in zip(frames, rows["t_ns"]):
        assert t_ns <= frame.t_mono_ns + 1_000_000, "a frame is sampled before it arrives"
    assert {press for press in rows["press"] if press >= 0} >= set(range(info["presses"]))
    assert sum(count is None for count in rows["temperature_c"]) in (0, len(frames))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recording")
    parser.add_argument("info")
    parser.add_argument("table", nargs="?")
    arguments = parser.parse_args()
    with open(arguments.info, encoding="utf-8") as stream:
        info = json.load(stream)
    frames, rig = check_recording(arguments.recording, info)
    print(f"{arguments.recording}: {len(frames)} frames, {info['frames_lost']} lost, {info['dwells']} dwells: agrees")
    if arguments.table:
        check_table(arguments.table, info, frames, rig)
        print(f"{arguments.table}: {len(frames)} rows: agrees")
    return 0


if __name__ == "__main__":
    sys.exit(main())
