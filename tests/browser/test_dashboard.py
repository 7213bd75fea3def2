"""A person uses the dashboard."""

import re

from lab import tactus
from playwright.sync_api import expect

HOLD = """
def run(rig):
    tare()
    for i in range(3):
        press(12.0, 9.0, depths_mm = [0.2], dwell_s = 0.5)
    press(12.0, 9.0, depths_mm = [0.4], dwell_s = 600.0)
"""


def test_a_run_is_watched_and_stopped(lab, dashboard):
    page = dashboard
    expect(page.locator("#simulated")).to_be_visible()
    expect(page.locator("#array > div")).to_have_count(48)
    expect(page.locator("#fault")).to_be_hidden()
    expect(page.locator("#stage")).to_contain_text("idle")
    page.keep("idle")

    (lab.folder / "hold.star").write_text(HOLD)
    client = lab.start("tactus", "--json", "--endpoint", lab.endpoint, "run", "hold.star", "--no-report")
    expect(page.locator("#run")).to_contain_text(re.compile("running, 3 of 4 presses"), timeout=60_000)
    # At this depth many elements respond; the brightest cell is next to the tip.
    expect(page.locator("#depth")).to_have_text("0.400", timeout=60_000)
    rises = [int(text) for text in page.locator("#array > div").all_text_contents()]
    assert max(rises) > 100
    page.keep("pressing")

    # The client that runs the experiment holds the lease: whoever takes it over says why.
    page.locator("#pause").click()
    expect(page.locator("#holder")).to_contain_text("holds the lease")
    page.locator("#reason").fill("to show it, with an s")
    page.get_by_role("button", name="Take over").click()
    expect(page.locator("#answer")).to_have_text("pause: done")
    page.keep("taken-over")

    page.locator("#stop").click()
    expect(page.locator("#stopped")).to_have_text("stop: done")
    expect(page.locator("#run")).to_contain_text("finished: stopped")
    expect(page.locator("#stage")).to_contain_text("z 2.000 mm")
    assert "stopped by dashboard" in client.wait_for("exit_status")
    client.end()
    page.keep("stopped")


def test_stop_has_a_key_and_a_reset_asks_for_confirmation(lab, dashboard):
    page = dashboard
    expect(page.locator("#array > div")).to_have_count(48)
    page.keyboard.press("s")
    expect(page.locator("#stopped")).to_have_text("stop: done")
    page.locator("#reset").click()
    page.get_by_role("button", name="No", exact=True).click()
    expect(page.locator("#sure")).to_be_hidden()
    # If a reset had been sent, the page would show it before the answer to the pause.
    page.locator("#pause").click()
    expect(page.locator("#answer")).to_contain_text("PAUSE FAILED: no run is in progress")
    page.locator("#reset").click()
    page.get_by_role("button", name="Yes, reset").click()
    expect(page.locator("#answer")).to_have_text("reset: done", timeout=60_000)


def test_a_restarted_service_says_that_it_needs_a_reset(lab, dashboard):
    page = dashboard
    expect(page.locator("#array > div")).to_have_count(48)
    lab.daemon.end()
    expect(page.locator("#problem")).to_be_visible()
    page.keep("no-service")
    lab.daemon = lab.start("tactusd", "--config", "tactusd.toml")
    lab.daemon.wait_for("ready")
    expect(page.locator("#problem")).to_be_hidden(timeout=30_000)
    expect(page.locator("#fault")).to_contain_text("nothing moves before a reset", timeout=30_000)
    page.keep("fault")
    assert tactus("--endpoint", lab.endpoint, "status")["fault"]
