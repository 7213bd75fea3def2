import runpy
from pathlib import Path


def test_the_types_of_the_messages_are_those_of_the_descriptors():
    maker = runpy.run_path(str(Path(__file__).parents[1] / "make_stub.py"))
    assert maker["STUB"].read_text(encoding="utf-8") == maker["stub"](), "run make_stub.py"
