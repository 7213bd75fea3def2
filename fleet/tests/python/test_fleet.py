"""DuckDB and polars read the files of a fleet, with the sums of the measurement tables that it was made of."""

import duckdb
import polars
import pytest


@pytest.fixture(scope="session")
def sums(lab):
    """By rig and date: the frames in a hold, and the sum of element 17 over them."""
    table = (
        polars.scan_parquet(f"{lab}/tables/*.parquet", include_file_paths="path")
        .filter(polars.col("phase") == "hold")
        .group_by(
            polars.col("path").str.extract(r"(rig-\d+)\.parquet$").alias("rig"),
            polars.col("run").str.slice(0, 8).str.to_date("%Y%m%d").cast(polars.String).alias("date"),
        )
        .agg(polars.len().alias("frames"), polars.col("counts").list.get(17).cast(polars.Float64).sum())
        .sort("rig", "date")
        .collect()
    )
    assert len(table) == 6
    return list(table.iter_rows())


def test_duckdb_reads_the_same(lab, sums):
    rows = duckdb.sql(
        f"""SELECT rig, CAST(date AS VARCHAR), count(*), sum(counts[18]::DOUBLE)
            FROM read_parquet('{lab}/fleet/*/*/*.parquet', hive_partitioning = true)
            WHERE phase = 'hold' GROUP BY rig, date ORDER BY rig, date"""
    ).fetchall()
    assert rows == sums


def test_polars_reads_the_same(lab, sums):
    table = (
        polars.scan_parquet(f"{lab}/fleet/**/*.parquet", hive_partitioning=True)
        .filter(polars.col("phase") == "hold")
        .group_by("rig", "date")
        .agg(polars.len().alias("frames"), polars.col("counts").list.get(17).cast(polars.Float64).sum())
        .sort("rig", "date")
        .collect()
    )
    assert [(rig, str(date), frames, counts) for rig, date, frames, counts in table.iter_rows()] == sums


def test_simulated_data_say_so(lab):
    frames = polars.scan_parquet(f"{lab}/fleet/**/*.parquet")
    assert frames.select(polars.col("simulated").all()).collect().item()
