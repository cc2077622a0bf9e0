"""The notebooks run from the first cell to the last. Set IVCAM_NOTEBOOKS to keep what they show."""

import importlib.util
import os
import pathlib

import pytest

NOTEBOOKS = pathlib.Path(__file__).resolve().parents[1] / "notebooks"
NEEDED = {
    "archive": ["matplotlib", "pandas"],
    "calibration": ["matplotlib", "cv2"],
    "lenses": ["matplotlib", "pandas", "optiland"],
    "photograph": ["matplotlib"],
}


def test_each_notebook_has_its_packages_listed() -> None:
    assert {path.stem for path in NOTEBOOKS.glob("*.ipynb")} == set(NEEDED)


@pytest.mark.parametrize("name", sorted(NEEDED))
def test_notebooks_run(name: str) -> None:
    for package in ["nbformat", "nbclient", "ipykernel", *NEEDED[name]]:
        if importlib.util.find_spec(package) is None:
            pytest.skip(f"{package} is not installed")
    import nbclient
    import nbformat

    file = NOTEBOOKS / f"{name}.ipynb"
    notebook = nbformat.read(file, 4)  # type: ignore[no-untyped-call,unused-ignore]
    assert all(not cell.get("outputs") for cell in notebook.cells), "its outputs are not stripped"
    folder = {"metadata": {"path": str(NOTEBOOKS)}}
    client = nbclient.NotebookClient(notebook, timeout=600, kernel_name="python3", resources=folder)
    client.execute()
    shown = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    assert any("image/png" in output.get("data", {}) for output in shown)
    assert not [output for output in shown if output.get("name") == "stderr"], "it warns"
    if os.environ.get("IVCAM_NOTEBOOKS"):
        path = pathlib.Path(os.environ["IVCAM_NOTEBOOKS"]) / f"{name}.ipynb"
        nbformat.write(notebook, path)  # type: ignore[no-untyped-call,unused-ignore]
