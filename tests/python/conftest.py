"""The runs that the tests use."""

import pytest
from lab import Lab, tactus


@pytest.fixture(scope="session")
def element_centres(tmp_path_factory):
    """The summary of an element-centre run on the embedded rig."""
    folder = tmp_path_factory.mktemp("embedded")
    return tactus("run", "element-centres", "--embedded", "--seed", 3, "--no-report", cwd=folder)


@pytest.fixture(scope="session")
def standing_lab(tmp_path_factory):
    """A lab for tests that leave it as it was."""
    lab = Lab(tmp_path_factory.mktemp("lab"))
    yield lab
    lab.close()


@pytest.fixture
def lab(tmp_path):
    lab = Lab(tmp_path)
    yield lab
    lab.close()
