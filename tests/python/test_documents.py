"""The notebook and the snippets of the client's README, at a real service."""

import re
import subprocess
import sys

import nbformat
from lab import REPOSITORY
from nbclient import NotebookClient

CLIENT = REPOSITORY / "clients/python"


def test_the_notebook_runs(standing_lab, tmp_path, monkeypatch):
    monkeypatch.setenv("TACTUS_ENDPOINT", standing_lab.endpoint)
    notebook = nbformat.read(CLIENT / "examples/first_press.ipynb", as_version=4)
    nbformat.validate(notebook)
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert not any(cell.outputs or cell.execution_count for cell in cells), "it is kept without what it once gave"
    NotebookClient(notebook, timeout=120, resources={"metadata": {"path": str(tmp_path)}}).execute()
    shown = [output.get("data", {}) for cell in cells for output in cell.outputs]
    assert sum("image/png" in data for data in shown) == 2
    pages = "".join(data.get("text/html", "") for data in shown)
    assert "SIMULATED" in pages and "possible" in pages and "refused" in pages


def test_the_snippets_of_the_readme_run_one_after_the_other(standing_lab, tmp_path, monkeypatch):
    monkeypatch.setenv("TACTUS_ENDPOINT", standing_lab.endpoint)
    text = (CLIENT / "README.md").read_text()
    snippets = re.findall(r"^```(\w*)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    assert {language for language, _ in snippets} == {"python", "sh"}
    program = "\n".join(snippet for language, snippet in snippets if language == "python")
    done = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert "SIMULATED" in done.stdout
    commands = "".join(snippet for language, snippet in snippets if language == "sh")
    named = set(re.findall(r"(?:clients|config)/[\w./-]+", commands))
    assert len(named) >= 6 and all((REPOSITORY / path).exists() for path in named), named
