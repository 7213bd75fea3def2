"""The Python of the book, as it stands there; only the service's address is added."""

import re
import subprocess
import sys

from lab import REPOSITORY

PAGE = REPOSITORY / "docs/book/how-to/subscribe.md"


def test_the_books_subscriber_prints_live_frames(lab):
    program, *_ = re.findall(r"^```python\n(.*?)^```", PAGE.read_text(), re.MULTILINE | re.DOTALL)
    assert "connect()" in program
    program = program.replace("connect()", f'connect("{lab.endpoint}")')
    reader = subprocess.Popen([sys.executable, "-u", "-c", program], stdout=subprocess.PIPE, text=True)
    try:
        # The image of a frame has six rows.
        first = [reader.stdout.readline() for _ in range(6)]
        assert re.match(r"\d+ \[\[", first[0]), first
        assert first[5].endswith("]]\n"), first
    finally:
        reader.kill()
        reader.communicate()
