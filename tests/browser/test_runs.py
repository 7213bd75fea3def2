"""A person looks for runs, marks them, compares them, takes their data along, and makes one again."""

import re
from pathlib import Path

import pytest
from lab import tactus
from playwright.sync_api import expect

PRESSES = """
COUNT = param("count", default = 1, doc = "presses")

def run(rig):
    tare()
    for i in range(COUNT):
        press(5.0 + i, 4.9, depths_mm = [0.2], dwell_s = 0.1)
"""
PATIENCE_MS = 60_000


@pytest.fixture(scope="module")
def two_runs(lab):
    """Ids of two runs of one experiment."""
    (lab.folder / "few.star").write_text(PRESSES)
    run = ["--endpoint", lab.endpoint, "run", "few.star", "--no-report", "--who", "ada"]
    return [tactus(*run, "-p", f"count={count}", cwd=lab.folder)["run_id"] for count in (1, 2)]


@pytest.fixture
def shelf(open_page, two_runs):
    page = open_page()
    page.locator("#to-runs").click()
    page.locator("#words").fill("few ada")
    expect(page.locator("#found")).to_contain_text(re.compile(r"^\d+ of \d+ runs"))
    return page


def row(page, run_id):
    return page.locator(f"tr[data-run='{run_id}']")


def test_runs_are_found_marked_and_compared(shelf, two_runs):
    page, (first, second) = shelf, two_runs
    expect(row(page, first)).to_contain_text("done")
    row(page, first).locator(".name").click()
    page.locator(".tags").fill("good first")
    # An s in a note is a letter, and stops nothing.
    page.locator(".note-text").press_sequentially("so many presses")
    page.locator(".keep").click()
    expect(page.locator(".said")).to_have_text("kept")
    expect(page.locator("#stopped")).to_have_text("")
    page.locator("#reload").click()
    page.locator("#words").fill("GOOD")
    expect(row(page, second)).to_have_count(0)
    expect(row(page, first)).to_contain_text("so many presses")
    page.locator("#words").fill("few ada")

    expect(page.locator("#compare")).to_be_disabled()
    for run_id in two_runs:
        row(page, run_id).get_by_role("checkbox").click()
    page.locator("#compare").click()
    expect(page.locator("#comparison")).to_contain_text("-p count")
    expect(page.locator("#comparison")).not_to_contain_text("covering")
    page.locator("#all-facts").click()
    expect(page.locator("#comparison")).to_contain_text("covering")
    page.keep("runs")


def test_a_run_is_reported_and_taken_along(shelf, two_runs):
    page, (first, _) = shelf, two_runs
    row(page, first).locator(".name").click()
    for kind, start in (("parquet", b"PAR1"), ("csv", b"run,press,phase"), ("npz", b"PK"), ("mcap", b"\x89MCAP")):
        with page.expect_download() as told:
            page.locator(f"a.{kind}").click()
        assert told.value.suggested_filename == f"{first}.{kind}"
        assert Path(told.value.path()).read_bytes().startswith(start), kind
    with page.context.expect_page() as told:
        page.locator("a.report").click()
    report = told.value
    expect(report.locator("h1")).to_contain_text("few")
    report.close()


def test_a_run_is_made_again(lab, shelf, two_runs):
    page, (first, second) = shelf, two_runs
    row(page, second).locator(".name").click()
    page.locator(".again").click()
    expect(page.locator(".details")).to_contain_text(re.compile("again .*: done"), timeout=PATIENCE_MS)
    page.locator("#to-lab").click()
    # Until the new run has begun, the last one is shown.
    run = page.locator("#run")
    finished = re.compile(rf"\b(?!{first}|{second})\d+-\d+-few-\w+ .*finished: done")
    expect(run).to_contain_text(finished, timeout=PATIENCE_MS)
    again = re.search(r"\d+-\d+-few-\w+", run.inner_text()).group()
    page.locator("#to-runs").click()
    page.locator("#words").fill("few")
    expect(row(page, again)).to_contain_text("done")
    compared = tactus("runs", "compare", second, again, "--runs", lab.folder / "runs")
    assert compared["same"]["-p count"] == ["2", "2"] and "seed" in compared["same"]


def test_only_who_has_the_token_writes(shelf, two_runs):
    page, (first, _) = shelf, two_runs
    reply = page.request.post(page.url + f"runs/{first}/notes", data='{"tags": [], "note": ""}')
    assert reply.status == 401
    for path in ("runs/no-such/report", f"runs/{first}/pdf", "runs/..%2F..%2Fetc/mcap"):
        assert page.request.get(page.url + path).status == 404, path


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize(("width", "height"), [(1400, 900), (820, 1100), (390, 844)])
def test_runs_fit_the_window_and_stop_is_in_view(open_page, two_runs, width, height, scheme):
    page = open_page(viewport={"width": width, "height": height}, color_scheme=scheme)
    page.locator("#to-runs").click()
    page.locator("#words").fill("few ada")
    row(page, two_runs[0]).locator(".name").click()
    for run_id in two_runs:
        row(page, run_id).get_by_role("checkbox").click()
    page.locator("#compare").click()
    expect(page.locator("#comparison")).to_contain_text("-p count")
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), "nothing is wider than the window"
    box = page.locator("#stop").bounding_box()
    assert box["y"] >= 0 and box["y"] + box["height"] <= height
    page.keep(f"runs-{width}-{scheme}")
