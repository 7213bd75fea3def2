"""The dashboard in a real browser. Screenshots go to target/browser."""

import pathlib
import re
import shutil
import sys

import pytest
from playwright.sync_api import sync_playwright

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1] / "python"))
from lab import REPOSITORY, Lab  # noqa: E402

PICTURES = REPOSITORY / "target/browser"


@pytest.fixture(scope="session")
def browser():
    with sync_playwright() as playwright:
        # Chromium's sandbox does not work as root. Without it only our own page is opened.
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        yield browser
        browser.close()


@pytest.fixture(scope="session")
def lab(tmp_path_factory):
    """One lab for all tests: homing takes most of a test's time. A test leaves it without a run and without a fault.

    A page that is opened beside other work can take both cores for more than three frames of 30 Hz.
    """
    lab = Lab(tmp_path_factory.mktemp("lab"), rate_hz=10.0)
    yield lab
    lab.close()


@pytest.fixture(scope="session")
def web(lab):
    """The address of the dashboard."""
    process = lab.start("tactus-web", "--endpoint", lab.endpoint, "--listen", "127.0.0.1:0", "--runs", str(lab.folder / "runs"))
    yield process.wait_for("http://").split()[-1]
    process.end()


@pytest.fixture
def open_page(web, browser):
    """Opens the dashboard in a new window, with `keep` for a screenshot. Fails on script errors and on console errors or warnings."""
    pages = []
    PICTURES.mkdir(parents=True, exist_ok=True)
    # The console also reports a command that the service refuses as an error.
    refused = re.compile("the server responded with a status of (409|423|503)")

    def open_page(go=True, viewport=None, **options):
        page = browser.new_page(viewport=viewport or {"width": 1400, "height": 900}, **options)
        page.url_with_token = web
        page.errors = []
        page.on("pageerror", lambda error: page.errors.append(str(error)))
        page.on("console", lambda message: message.type in ("error", "warning") and not refused.search(message.text) and page.errors.append(message.text))
        page.keep = lambda name: page.screenshot(path=PICTURES / f"{name}.png", full_page=True)
        if go:
            page.goto(web)
        pages.append(page)
        return page

    yield open_page
    errors = [page.errors for page in pages if page.errors]
    for page in pages:
        # Shown with a test that fails.
        print(page.url, page.locator("body").inner_text(), sep="\n")
        page.close()
    assert errors == []


@pytest.fixture
def dashboard(open_page):
    """The page."""
    return open_page()
