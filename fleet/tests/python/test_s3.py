"""A fleet in an object store that speaks S3."""

import json

import boto3
import pytest
from conftest import run
from moto.server import ThreadedMotoServer

KEYS = {"AWS_ACCESS_KEY_ID": "none", "AWS_SECRET_ACCESS_KEY": "none", "AWS_REGION": "us-east-1", "AWS_ALLOW_HTTP": "true"}


@pytest.fixture
def store():
    """What programs must know of a store with the bucket `labs`."""
    server = ThreadedMotoServer(ip_address="127.0.0.1", port=0)
    server.start()
    host, port = server.get_host_and_port()
    address = f"http://{host}:{port}"
    client = boto3.client("s3", endpoint_url=address, aws_access_key_id="none", aws_secret_access_key="none", region_name="us-east-1")
    client.create_bucket(Bucket="labs")
    yield KEYS | {"AWS_ENDPOINT": address}, client
    server.stop()


def test_a_fleet_in_s3_answers_as_one_in_a_folder(lab, store):
    keys, client = store
    tables = sorted(lab.glob("tables/*"))
    for kept in [0, 6]:
        told = json.loads(run("tactus-fleet", "--json", "ingest", *tables, "--to", "s3://labs/fleet", cwd=lab, env=keys))
        assert (told["runs_kept"], told["failed"]) == (kept, [])
    listed = [entry["Key"] for entry in client.list_objects_v2(Bucket="labs")["Contents"]]
    assert listed == sorted(f"fleet/{file.relative_to(lab / 'fleet')}" for file in lab.glob("fleet/*/*/*"))
    for sql in [
        "SELECT rig, date, count(*) AS frames, image(counts) AS image FROM frames GROUP BY rig, date ORDER BY rig, date",
        "SELECT run, frames, bytes FROM runs WHERE rig = 'rig-1' ORDER BY run",
    ]:
        there = run("tactus-fleet", "--json", "query", sql, "--at", "s3://labs/fleet", cwd=lab, env=keys)
        assert there and there == run("tactus-fleet", "--json", "query", sql, cwd=lab)
