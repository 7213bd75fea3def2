"""A person uses the dashboard."""

import re

import pytest
from lab import tactus
from playwright.sync_api import expect

HOLD = """
def run(rig):
    tare()
    for i in range(3):
        press(5.0, 4.9, depths_mm = [0.2], dwell_s = 0.5)
    press(7.1, 4.9, depths_mm = [0.4], dwell_s = 600.0)
"""
PATIENCE_MS = 60_000


def start_hold(lab, page):
    """Starts a run from the command line, and waits until the tip holds its last depth."""
    (lab.folder / "hold.star").write_text(HOLD)
    client = lab.start("tactus", "--json", "--endpoint", lab.endpoint, "run", "hold.star", "--no-report")
    expect(page.locator("#run")).to_contain_text(re.compile("running, 3 of 4 presses"), timeout=PATIENCE_MS)
    expect(page.locator("#depth")).to_have_text("0.400", timeout=PATIENCE_MS)
    return client


def end_hold(page, client):
    page.locator("#stop").click()
    expect(page.locator("#run")).to_contain_text("finished: stopped", timeout=PATIENCE_MS)
    client.wait_for("exit_status")
    client.end()


def rise(page):
    return int(page.locator("#rise").text_content())


def loaded(page):
    expect(page.locator("#array .element")).to_have_count(48)
    return page


def test_a_run_is_watched_and_stopped(lab, dashboard):
    page = loaded(dashboard)
    expect(page.locator("#simulated")).to_be_visible()
    expect(page.locator("#fault")).to_have_count(0)
    expect(page.locator("#stage")).to_contain_text("idle")
    expect(page.locator("#lease")).to_have_text("nobody")
    # Buttons are enabled when they mean something.
    for name in ("#pause", "#resume"):
        expect(page.locator(name)).to_be_disabled()
    for name in ("#reset", "#stop", "#take-zero"):
        expect(page.locator(name)).to_be_enabled()
    page.keep("idle")

    client = start_hold(lab, page)
    for name in ("#resume", "#reset", "#take-zero", "#go"):
        expect(page.locator(name)).to_be_disabled()
    # At this depth many elements respond; the brightest is below the tip.
    greatest = page.locator("#array").get_attribute("aria-label")
    assert re.search("at element (19|20|11|12)$", greatest), greatest
    expect(page.locator("#lease")).not_to_have_text("nobody")
    page.keep("pressing")

    # The client that runs the experiment holds the lease: whoever takes it over says why. An s in the reason is a letter.
    page.locator("#pause").click()
    expect(page.locator("#holder")).to_contain_text("holds the lease")
    page.locator("#reason").press_sequentially("so that it shows")
    page.get_by_role("button", name="Take over").click()
    expect(page.locator("#answer")).to_have_text("pause: done")
    expect(page.locator("#stopped")).to_have_text("")
    page.keep("taken-over")

    page.locator("#stop").click()
    expect(page.locator("#stopped")).to_have_text("stop: done")
    expect(page.locator("#run")).to_contain_text("finished: stopped")
    expect(page.locator("#stage")).to_contain_text("z 2.000 mm")
    expect(page.locator("#log")).to_contain_text("STOP by dashboard: button")
    assert "stopped by dashboard" in client.wait_for("exit_status")
    client.end()
    for name in ("#pause", "#resume"):
        expect(page.locator(name)).to_be_disabled()
    expect(page.locator("#reset")).to_be_enabled()
    page.keep("stopped")


@pytest.mark.parametrize(("width", "height"), [(1400, 900), (820, 1100), (390, 844), (844, 390)])
def test_stop_is_in_view_wherever_the_page_is_scrolled_to(dashboard, width, height):
    page = loaded(dashboard)
    page.set_viewport_size({"width": width, "height": height})
    # While the page asks something, too.
    page.locator("#reset").click()
    expect(page.locator("#sure")).to_be_visible()
    for to in (0, 0.25, 0.5, 0.75, 1):
        seen = page.evaluate(
            """(to) => {
                scrollTo(0, to * document.documentElement.scrollHeight);
                const { left, right, top, bottom } = document.getElementById("stop").getBoundingClientRect();
                const middle = document.elementFromPoint((left + right) / 2, (top + bottom) / 2);
                return {
                    inside: left >= 0 && top >= 0 && right <= innerWidth && bottom <= innerHeight, hit: middle.id, high: bottom - top,
                    wide: document.documentElement.scrollWidth <= innerWidth,
                };
            }""",
            to,
        )
        assert seen["inside"] and seen["hit"] == "stop" and seen["high"] >= 40, (to, seen)
        assert seen["wide"], "nothing is wider than the window"
    page.keep(f"scrolled-{width}")
    page.locator("#stop").click()
    expect(page.locator("#stopped")).to_have_text("stop: done")


def test_stop_has_a_key_and_a_reset_asks_for_confirmation(lab, dashboard):
    page = loaded(dashboard)
    page.keyboard.press("s")
    expect(page.locator("#stopped")).to_have_text("stop: done")
    page.locator("#reset").click()
    page.get_by_role("button", name="No", exact=True).click()
    expect(page.locator("#sure")).to_have_count(0)
    expect(page.locator("#answer")).to_have_text("")
    page.locator("#reset").click()
    # Stopping needs no answer to the question.
    page.keyboard.press("s")
    page.get_by_role("button", name="Yes, reset").click()
    expect(page.locator("#answer")).to_have_text("reset: done", timeout=PATIENCE_MS)


def test_a_page_without_the_token_looks_and_stops(lab, open_page):
    page = open_page(go=False)
    page.goto(page.url_with_token.partition("#")[0])
    loaded(page)
    expect(page.locator("#obstacle")).to_contain_text("can look and stop only")
    for name in ("#pause", "#resume", "#reset"):
        expect(page.locator(name)).to_be_disabled()
    page.locator("#stop").click()
    expect(page.locator("#stopped")).to_have_text("stop: done")


def test_all_viewers_see_the_same_zero_and_the_last_minutes(lab, dashboard, open_page):
    page = loaded(dashboard)
    client = start_hold(lab, page)
    assert rise(page) > 1_000
    late = loaded(open_page())
    expect(late.locator("#zero")).to_contain_text("tare of")
    # Noise of 2 counts in each of 48 elements, at two moments.
    assert abs(rise(late) - rise(page)) < 150, (rise(late), rise(page))
    assert page.locator("#zero").text_content() == late.locator("#zero").text_content()
    # The presses before this page was opened.
    late.wait_for_function("() => import('./lab.js').then(({ lab }) => lab.frames.length > 60 && lab.frames[0].seq < lab.frame.seq - 60)")
    end_hold(page, client)
    expect(page.locator("#drift")).to_contain_text("at rest now against the zero")
    page.locator("#take-zero").click()
    for each in (page, late):
        expect(each.locator("#zero")).to_contain_text("taken here")
        expect(each.locator("#log")).to_contain_text("a new zero for all viewers")


def test_safety_news_of_a_run_that_is_over_is_marked_as_past(lab, dashboard):
    page = loaded(dashboard)
    client = start_hold(lab, page)
    # The sensor is silent while the tip is in contact: the supervisor stops the stage, and the run repeats the press.
    lab.mock.tell("sensor stall 2s")
    expect(page.locator("#safety.now")).to_contain_text("silence", timeout=PATIENCE_MS)
    expect(page.locator("#log tr.stop").first).to_be_visible()
    page.keep("safety-now")
    # Until the press is repeated the fault holds, and a stop would leave it for a reset.
    expect(page.locator("#zero")).to_contain_text("reference of", timeout=PATIENCE_MS)
    expect(page.locator("#depth")).to_have_text("0.400", timeout=PATIENCE_MS)
    expect(page.locator("#fault")).to_have_count(0)
    end_hold(page, client)
    expect(page.locator("#safety.past")).to_contain_text(re.compile("^past, .*, run .*-hold-.*silence"))
    expect(page.locator("#safety.now")).to_have_count(0)
    expect(page.locator("#log tr.past").first).to_be_visible()
    page.keep("safety-past")


def test_elements_are_clicked_for_their_traces(lab, dashboard):
    page = loaded(dashboard)
    expect(page.locator("#element-chart")).to_have_count(0)
    page.locator('[data-element="19"]').click()
    expect(page.locator(".trace-key")).to_contain_text("element 19")
    expect(page.locator("#element-chart canvas")).to_be_visible()
    # With the keyboard: to the right, and Enter.
    page.keyboard.press("ArrowRight")
    page.keyboard.press("Enter")
    expect(page.locator('[data-element="20"]')).to_have_attribute("aria-pressed", "true")
    expect(page.locator(".trace-key")).to_have_count(2)
    page.keep("traces")
    page.locator('[data-element="19"]').click()
    expect(page.locator(".trace-key")).to_have_count(1)
    page.locator("#no-traces").click()
    expect(page.locator("#element-chart")).to_have_count(0)


def test_the_colour_bar_is_free_or_fixed_in_counts_or_share(lab, dashboard):
    page = loaded(dashboard)
    bar = page.locator("#colour-bar")
    expect(bar).to_have_attribute("aria-label", re.compile(r"from 0 to \d+ counts"))
    page.select_option("#scale", "fixed")
    page.locator("#scale-max").fill("800")
    page.locator("#scale-max").press("Enter")
    expect(bar).to_have_attribute("aria-label", "Colour bar from 0 to 800 counts")
    # The limit of one element is 2000 counts.
    page.select_option("#unit", "share")
    expect(bar).to_have_attribute("aria-label", "Colour bar from 0 to 40.0 % of the limit")
    page.reload()
    loaded(page)
    expect(bar).to_have_attribute("aria-label", "Colour bar from 0 to 40.0 % of the limit")


def refused_once(page, path, words):
    """The first request for a path is answered with "not now"; returns the requests."""
    asked = []

    def refuse_the_first(route):
        asked.append(route.request)
        if len(asked) == 1:
            route.fulfill(status=503, body=words)
        else:
            route.continue_()

    page.route(path, refuse_the_first)
    return asked


def test_a_dry_run_that_a_newer_one_ended_is_asked_for_again(lab, dashboard):
    page = loaded(dashboard)
    asked = refused_once(page, "**/plan", "a newer dry run has ended this one")
    page.select_option("#experiment", "image")
    expect(page.locator("#verdict.possible")).to_contain_text("4, 4 dwells", timeout=PATIENCE_MS)
    assert len(asked) == 2


def test_a_list_of_experiments_that_cannot_be_made_now_is_asked_for_again(lab, open_page):
    page = open_page(go=False)
    asked = refused_once(page, "**/experiments", "the experiments are being listed: ask again")
    page.goto(page.url_with_token)
    expect(page.locator("#experiment")).to_be_visible(timeout=PATIENCE_MS)
    assert len(asked) == 2


def test_an_experiment_is_chosen_checked_and_started(lab, dashboard):
    page = loaded(dashboard)
    page.select_option("#experiment", "image")
    expect(page.locator("#verdict.possible")).to_contain_text("4, 4 dwells", timeout=PATIENCE_MS)
    expect(page.locator("#start")).to_be_enabled()
    # A verdict holds for the form that it was made for.
    page.locator("#parameter-depth_mm").fill("3")
    page.locator("#parameter-depth_mm").press("Tab")
    expect(page.locator("#verdict.refused")).to_contain_text("REFUSED on rig bench, covering 1.016 mm", timeout=PATIENCE_MS)
    expect(page.locator("#start")).to_be_disabled()
    page.keep("refused")
    page.locator("#parameter-coverings_mm").fill("1.016, oops")
    page.locator("#parameter-coverings_mm").press("Tab")
    expect(page.locator(".wrong")).to_contain_text("numbers with commas")
    expect(page.locator("#start")).to_be_disabled()

    page.locator("#parameter-coverings_mm").fill("1.016")
    page.locator("#parameter-depth_mm").fill("0.1")
    page.locator("#who").fill("ada s.")
    page.locator("#who").press("Tab")
    expect(page.locator("#stopped")).to_have_text("")
    expect(page.locator("#verdict.possible")).to_contain_text("1, 1 dwells", timeout=PATIENCE_MS)
    page.keep("possible")
    page.locator("#start").click()
    expect(page.locator("#run")).to_contain_text("by ada s.", timeout=PATIENCE_MS)
    expect(page.locator("#run")).to_contain_text("finished: done, 1 of 1 presses", timeout=PATIENCE_MS)
    expect(page.locator("#answer")).to_have_text("start image: done")
    expect(page.locator("#log")).to_contain_text("image started by ada s.")


def test_the_tip_is_moved_above_an_element_and_a_step_aside(lab, dashboard):
    page = loaded(dashboard)
    page.locator("#above-element").fill("9")
    page.locator("#above-element").press("Tab")
    page.locator("#go").click()
    # Element 9: column 1 at 2.9 mm, row 1 at 2.9 mm; the sensor's origin is at (20, 15).
    expect(page.locator("#stage")).to_contain_text(re.compile(r"idle, x 22\.(89|90)\d, y 17\.(89|90)\d, z 2\.000"), timeout=PATIENCE_MS)
    expect(page.locator("#run")).to_contain_text("finished: done", timeout=PATIENCE_MS)
    page.locator("#jog-x-up").click()
    expect(page.locator("#stage")).to_contain_text(re.compile(r"x 23\.(89|90)\d"), timeout=PATIENCE_MS)
    expect(page.locator("#run")).to_contain_text("finished: done", timeout=PATIENCE_MS)
    expect(page.locator("#above")).to_have_attribute("aria-label", re.compile("inside the envelope"))
    # Up by a step; down by more than is left goes to the safe height, and no further.
    expect(page.locator("#jog-z-down")).to_be_disabled()
    page.locator("#jog-z-up").click()
    expect(page.locator("#stage")).to_contain_text(re.compile(r"idle, x 23\.(89|90)\d, y 17\.(89|90)\d, z 3\.000"), timeout=PATIENCE_MS)
    expect(page.locator("#run")).to_contain_text("finished: done", timeout=PATIENCE_MS)
    page.keep("moved")
    page.locator("#step").select_option("5")
    page.locator("#jog-z-down").click()
    expect(page.locator("#stage")).to_contain_text(re.compile(r"idle, x 23\.(89|90)\d, y 17\.(89|90)\d, z 2\.000"), timeout=PATIENCE_MS)
    expect(page.locator("#run")).to_contain_text("finished: done", timeout=PATIENCE_MS)
    expect(page.locator("#jog-z-down")).to_be_disabled()


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_pictures_say_that_they_are_simulated(lab, dashboard, open_page, scheme):
    loaded(dashboard)
    page = loaded(open_page(color_scheme=scheme, viewport={"width": 390, "height": 844}))
    expect(page).to_have_title("Tactus bench (SIMULATED)")
    for picture in ("#array", "#above", "#section"):
        expect(page.locator(f"{picture} .simulated-mark")).to_have_text("SIMULATED")
    page.keep(f"phone-{scheme}")


def test_a_restarted_service_says_that_it_needs_a_reset(lab, dashboard):
    page = loaded(dashboard)
    lab.daemon.end()
    expect(page.locator("#problem")).to_be_visible()
    expect(page.locator("#reset")).to_be_disabled()
    # Nothing that was known is shown as the present.
    expect(page.locator("#array.empty")).to_be_visible()
    expect(page.locator("#stage")).to_have_text("unknown")
    page.keep("no-service")
    lab.daemon = lab.start("tactusd", "--config", "tactusd.toml")
    lab.daemon.wait_for("ready")
    expect(page.locator("#problem")).to_have_count(0, timeout=30_000)
    expect(page.locator("#fault")).to_contain_text("nothing moves before a reset", timeout=30_000)
    expect(page.locator("#log")).to_contain_text("has ended")
    page.select_option("#experiment", "image")
    expect(page.locator("#verdict.possible")).to_be_visible(timeout=PATIENCE_MS)
    expect(page.locator("#start")).to_be_disabled()
    page.keep("fault")
    assert tactus("--endpoint", lab.endpoint, "status")["fault"]
    page.locator("#reset").click()
    page.get_by_role("button", name="Yes, reset").click()
    expect(page.locator("#fault")).to_have_count(0, timeout=PATIENCE_MS)
    expect(page.locator("#start")).to_be_enabled()


def test_stop_works_when_the_rest_of_the_page_does_not(lab, dashboard, open_page):
    loaded(dashboard)
    page = open_page(go=False)
    page.route("**/main.js", lambda route: route.fulfill(content_type="text/javascript", body="throw new Error('broken')"))
    page.goto(dashboard.url_with_token)
    page.locator("#stop").click()
    expect(page.locator("#stopped")).to_have_text("stop: done")
    assert page.errors == ["broken"]
    page.errors.clear()


# The last test: it leaves another covering in place.
def test_a_run_goes_on_with_another_covering_once_it_is_confirmed(lab, dashboard):
    page = loaded(dashboard)
    page.select_option("#experiment", "image")
    expect(page.locator("#verdict.possible")).to_be_visible(timeout=PATIENCE_MS)
    page.locator("#start").click()
    # This rig is at serial ports: a person changes its covering, and confirms it by its thickness.
    expect(page.locator("#run")).to_contain_text("2.54 mm covering", timeout=PATIENCE_MS)
    expect(page.locator("#resume")).to_be_disabled()
    page.locator("#covering").fill("2.0")
    page.locator("#resume").click()
    expect(page.locator("#answer")).to_contain_text("RESUME FAILED")
    page.locator("#covering").fill("2.54")
    page.locator("#resume").click()
    expect(page.locator("#answer")).to_have_text("resume: done")
    expect(page.locator("#section")).to_have_attribute("aria-label", re.compile("covering 2.54 mm"), timeout=PATIENCE_MS)
    page.keep("covering")
    page.locator("#stop").click()
    expect(page.locator("#run")).to_contain_text("finished: stopped", timeout=PATIENCE_MS)
