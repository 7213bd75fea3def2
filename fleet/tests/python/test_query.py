"""`tactus fleet query` answers as DuckDB and polars do."""

import datetime
import json

import duckdb
import polars
import pytest
from conftest import run

SHARED = [
    "SELECT rig, count(*) AS frames, avg(x_mm) AS x_mm, min(z_mm) AS z_mm FROM frames GROUP BY rig ORDER BY rig",
    "SELECT rig, date, phase, count(*) AS frames FROM frames WHERE press >= 0 GROUP BY rig, date, phase ORDER BY rig, date, phase",
    "SELECT run, press, count(*) AS frames, max(t_ns) AS t_ns FROM frames WHERE phase = 'hold' AND rig = 'rig-1' GROUP BY run, press HAVING count(*) > 10 ORDER BY run, press",
    "SELECT DISTINCT rig, simulated, experiment, covering_mm FROM frames WHERE date = '2026-03-02' ORDER BY rig",
]

# Of lists; polars has no such SQL.
LISTS = [
    "SELECT rig, phase, avg(counts[18]) AS mean, max(counts[1]) AS largest FROM frames GROUP BY rig, phase ORDER BY rig, phase",
    """SELECT rig, element, avg(counts) AS mean FROM
       (SELECT rig, unnest(range(1, 49)) AS element, unnest(counts) AS counts FROM frames WHERE date > '2026-03-01')
       GROUP BY rig, element ORDER BY rig, element""",
    "SELECT rig, t_ns, counts[18] - lag(counts[18]) OVER (PARTITION BY rig, run ORDER BY t_ns) AS step FROM frames ORDER BY rig, run, t_ns LIMIT 500",
]


def ask(lab, sql, *options):
    out = run("tactus-fleet", "--json", "query", sql, *options, cwd=lab)
    return [json.loads(line) for line in out.splitlines()]


def plain(value):
    return value.isoformat() if isinstance(value, datetime.date) else value


def assert_same(rows, others):
    """Sums of floats depend on their order, so these may differ in the last digits."""
    assert len(rows) == len(others) > 0
    for row, other in zip(rows, others, strict=True):
        assert row.keys() == other.keys()
        for name, value in other.items():
            is_float = isinstance(value, float)
            assert row[name] == (pytest.approx(value, rel=1e-12) if is_float else plain(value)), (name, row, other)


def of_duckdb(lab, sql):
    frames = duckdb.read_parquet(f"{lab}/fleet/*/*/*.parquet", hive_partitioning=True)
    answer = frames.query("frames", sql)
    return [dict(zip(answer.columns, row, strict=True)) for row in answer.fetchall()]


@pytest.mark.parametrize("sql", SHARED + LISTS)
def test_duckdb_answers_the_same(lab, sql):
    assert_same(ask(lab, sql), of_duckdb(lab, sql))


@pytest.mark.parametrize("sql", SHARED)
def test_polars_answers_the_same(lab, sql):
    frames = polars.scan_parquet(f"{lab}/fleet/**/*.parquet", hive_partitioning=True)
    assert_same(ask(lab, sql), polars.SQLContext({"frames": frames}).execute(sql, eager=True).to_dicts())


def test_an_image_is_the_mean_of_each_element(lab):
    means = of_duckdb(lab, LISTS[1])
    for row in ask(lab, "SELECT rig, image(counts) AS image FROM frames WHERE date > '2026-03-01' GROUP BY rig ORDER BY rig"):
        assert row["image"] == pytest.approx([one["mean"] for one in means if one["rig"] == row["rig"]], rel=1e-12)


def test_files_of_answers_are_read(lab):
    sql = "SELECT rig, date, run, press, depth_mm, image FROM dwells ORDER BY rig, run, press"
    rows = ask(lab, sql)
    ask(lab, sql, "--out", "dwells.parquet")
    assert_same(rows, polars.read_parquet(lab / "dwells.parquet").to_dicts())
    ask(lab, sql, "--out", "dwells.csv")
    table = polars.read_csv(lab / "dwells.csv")
    assert table["depth_mm"].to_list() == [row["depth_mm"] for row in rows]
    assert [json.loads(image) for image in table["image"]] == [row["image"] for row in rows]
