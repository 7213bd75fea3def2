"""The measurement table of a set, as `tactus discover` reads it: Parquet with the rig in its metadata."""

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from rig import ELEMENTS, FINE, RATE_HZ

SCHEMA = pa.schema(
    [
        pa.field("run", pa.string(), False),
        pa.field("press", pa.int32(), False),
        pa.field("phase", pa.string(), False),
        pa.field("t_ns", pa.int64(), False),
        pa.field("x_mm", pa.float64(), False),
        pa.field("y_mm", pa.float64(), False),
        pa.field("z_mm", pa.float64(), False),
        pa.field("covering_mm", pa.float64(), False),
        pa.field("indenter", pa.string(), False),
        pa.field("temperature_c", pa.float64()),
        pa.field("counts", pa.list_(pa.field("element", pa.float32(), False)), False),
    ]
)


def write(file, rig, path, counts):
    """Writes the table: a row for each frame, with the commanded place of the tool."""
    frames = path.frames
    x_mm, y_mm, z_mm = path.positions_mm[::FINE].T
    ends = pa.array(np.arange(frames + 1, dtype=np.int32) * ELEMENTS)
    lists = pa.ListArray.from_arrays(ends, pa.array(counts.astype(np.float32).ravel()))
    columns = {
        "run": ["run-1"] * frames,
        "press": path.presses[::FINE].astype(np.int32),
        "phase": path.phases[::FINE].tolist(),
        "t_ns": (np.arange(frames) * (1e9 / RATE_HZ)).astype(np.int64),
        "x_mm": x_mm,
        "y_mm": y_mm,
        "z_mm": z_mm,
        "covering_mm": np.full(frames, rig.thickness_mm),
        "indenter": [rig.tool] * frames,
        "temperature_c": pa.nulls(frames, pa.float64()),
        "counts": lists.cast(SCHEMA.field("counts").type),
    }
    schema = SCHEMA.with_metadata({"tactus.rig": rig.declared()})
    arrays = [pa.array(columns[name.name], name.type) if name.name != "counts" else columns["counts"] for name in schema]
    pq.write_table(pa.Table.from_arrays(arrays, schema=schema), file, compression="zstd")
