"""Makes the measurement tables of this folder with the tools that others write them with.

Usage: python make_tables.py   (pip install pyarrow pandas polars; made with pyarrow 26, pandas 3, polars 1)
"""

import json
import pathlib

import pandas
import polars
import pyarrow as pa
import pyarrow.parquet as pq

HERE = pathlib.Path(__file__).parent
RIG = {
    "schema": "tactus.rig/1",
    "name": "two by two, described with data",
    "simulated": True,
    "array": {
        "name": "square",
        "rows": 2,
        "cols": 2,
        "element_mm": [1.8, 1.8],
        "col_centres_mm": [0.9, 2.9],
        "row_centres_mm": [0.9, 2.9],
        "rate_hz": 30.0,
        "full_scale_counts": 4095,
        "step_counts": 1.0,
    },
    "registration": {"origin_mm": [20.0, 15.0], "rotation_deg": 0.0},
    "psf": {"sigma_intercept_mm": 2.22, "sigma_per_mm": 0.497},
    "sensitivity_counts_per_mm": [1000.0, 990.0, -20.0, 1010.0],
    "sensitivity_reference": {"indenter": "cyl1", "covering_mm": 1.016},
    "baseline_counts": 100.0,
    "indenters": {"cyl1": {"shape": "cylinder", "diameter_mm": 1.0}},
}
META = {"tactus.rig": json.dumps(RIG)}
ROWS = 6
COLUMNS = {
    "run": (pa.string(), ["a"] * 4 + ["b"] * 2),
    "press": (pa.int32(), [-1, 0, 0, -1, -1, 0]),
    "phase": (pa.string(), ["idle", "load", "hold", "retract", "idle", "approach"]),
    "t_ns": (pa.int64(), [0, 33_000_000, 70_000_000, 100_000_000, 5, 40_000_000]),
    "x_mm": (pa.float64(), [20.9, 20.9, 20.9, 20.9, 22.9, 22.9]),
    "y_mm": (pa.float64(), [15.9] * ROWS),
    "z_mm": (pa.float64(), [2.0, -0.1, -0.2, 1.0, 2.0, 0.3]),
    "covering_mm": (pa.float64(), [1.016] * ROWS),
    "indenter": (pa.string(), ["cyl1"] * ROWS),
    "temperature_c": (pa.float64(), [None, 21.5, 21.5, None, None, 21.75]),
    "counts": (pa.list_(pa.float32()), [[100.0 + row, 101.0, 102.5, 99.0] for row in range(ROWS)]),
}


def table(**changes):
    """The table, with columns replaced by (type, values), or taken out by None."""
    columns = {name: changes.get(name, column) for name, column in COLUMNS.items()}
    return pa.table({name: pa.array(c[1], type=c[0]) for name, c in columns.items() if c is not None})


def write(name, data, meta=META, **options):
    pq.write_table(data.replace_schema_metadata(meta), HERE / f"{name}.parquet", **options)


def changed(column, row, value):
    kind, values = COLUMNS[column]
    values = list(values)
    values[row] = value
    return {column: (kind, values)}


def valid():
    write("valid_pyarrow", table())
    texts = {name: (pa.large_string(), COLUMNS[name][1]) for name in ["run", "phase", "indenter"]}
    lists = {"counts": (pa.large_list(pa.float32()), COLUMNS["counts"][1])}
    write("valid_large", table(**texts, **lists), compression="zstd")
    fixed = {"counts": (pa.list_(pa.float32(), 4), COLUMNS["counts"][1])}
    write("valid_fixed_list", table(**fixed), compression="none", use_dictionary=False)
    write("valid_item", table(), use_compliant_nested_type=False, data_page_version="2.0", row_group_size=4)
    required = pa.schema([pa.field(n, k, nullable=n == "temperature_c") for n, (k, _) in COLUMNS.items()])
    write("valid_required", table().cast(required), version="1.0")
    coded = table()
    for name in ["run", "phase", "indenter"]:
        coded = coded.set_column(coded.schema.get_field_index(name), name, coded[name].dictionary_encode())
    write("valid_dictionary", coded)
    write("valid_reordered", table().select(sorted(COLUMNS)).append_column("remark", pa.array(["x"] * ROWS)))
    frame = table(temperature_c=(pa.null(), [None] * ROWS)).to_pandas().set_index("run", append=True).reset_index("run")
    write("valid_pandas_null_temperature", pa.Table.from_pandas(frame))
    polars.from_arrow(table()).write_parquet(HERE / "valid_polars.parquet", metadata=META)


def invalid():
    for name in COLUMNS:
        write(f"missing_{name}", table(**{name: None}))
    write("type_press", table(press=(pa.int64(), COLUMNS["press"][1])))
    write("type_run", table(run=(pa.binary(), COLUMNS["run"][1])))
    write("type_t_ns", table(t_ns=(pa.timestamp("ns"), COLUMNS["t_ns"][1])))
    write("type_x_mm", table(x_mm=(pa.float32(), COLUMNS["x_mm"][1])))
    write("type_counts", table(counts=(pa.list_(pa.float64()), COLUMNS["counts"][1])))
    write("type_counts_plain", table(counts=(pa.float32(), [1.0] * ROWS)))
    write("type_phase", table(phase=(pa.uint8(), [0] * ROWS)))
    write("value_run_null", table(**changed("run", 3, None)))
    write("value_run_again", table(**changed("run", 5, "a")))
    write("value_press", table(**changed("press", 2, -2)))
    write("value_phase", table(**changed("phase", 4, "resting")))
    write("value_t_ns", table(**changed("t_ns", 2, 32_999_999)))
    write("value_t_ns_null", table(**changed("t_ns", 1, None)))
    write("value_x_mm", table(**changed("x_mm", 0, float("inf"))))
    write("value_y_mm", table(**changed("y_mm", 5, None)))
    write("value_z_mm", table(**changed("z_mm", 1, float("nan"))))
    write("value_covering_mm", table(**changed("covering_mm", 3, 0.0)))
    write("value_indenter", table(**changed("indenter", 2, "cyl9")))
    write("value_temperature_c", table(**changed("temperature_c", 4, float("-inf"))))
    write("value_counts_short", table(**changed("counts", 5, [1.0, 2.0, 3.0])))
    write("value_counts_empty", table(**changed("counts", 0, [])))
    write("value_counts_null", table(**changed("counts", 3, None)))
    write("value_counts_hole", table(**changed("counts", 2, [1.0, None, 3.0, 4.0])))
    write("value_counts_nan", table(**changed("counts", 4, [1.0, 2.0, float("nan"), 4.0])))
    # Four million equal values in a file of some kilobytes.
    write("long_counts", table(**changed("counts", 3, [1.0] * 4_000_000)), compression="zstd")
    write("long_run", table(run=(pa.string(), ["a" * 300] * ROWS)))
    write("rig_missing", table(), meta={})
    write("rig_wrong", table(), meta={"tactus.rig": json.dumps({**RIG, "schema": "tactus.rig/2"})})


valid()
invalid()
