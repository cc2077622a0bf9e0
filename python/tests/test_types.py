"""The stubs are complete, and `help` has a text for everything."""

import inspect
import pathlib
import subprocess
import sys

import pytest

import ivcam

EXAMPLE = pathlib.Path(__file__).resolve().parents[1] / "examples" / "tour.py"


def test_an_example_passes_strict_types(tmp_path: pathlib.Path) -> None:
    pytest.importorskip("mypy", reason="mypy is not installed")
    line = [sys.executable, "-m", "mypy", "--strict", "--cache-dir", str(tmp_path), str(EXAMPLE)]
    done = subprocess.run(line, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stdout
    wrong = tmp_path / "wrong.py"
    wrong.write_text('import ivcam\nivcam.Lens("biogon").trace(3, "x", wavelength="red")\n')
    line[-1] = str(wrong)
    done = subprocess.run(line, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 1 and "wavelength" in done.stdout


def test_everything_public_has_a_docstring() -> None:
    for name in ivcam.__all__:
        thing = getattr(ivcam, name)
        if isinstance(thing, (int, str)):
            continue
        assert inspect.getdoc(thing), name
        if inspect.isclass(thing):
            for member, value in inspect.getmembers(thing):
                is_own = member in vars(thing) and not member.startswith("_")
                if is_own and (callable(value) or isinstance(value, property)):
                    assert inspect.getdoc(value), f"{name}.{member}"


def test_the_stub_has_what_the_compiled_part_has() -> None:
    from ivcam import _ivcam

    stub = pathlib.Path(ivcam.__file__).with_name("_ivcam.pyi").read_text()
    for name, thing in vars(_ivcam).items():
        if name.startswith("__") or not (inspect.isclass(thing) or callable(thing)):
            continue
        assert f"class {name}" in stub or f"def {name}(" in stub, name
        members = vars(thing) if inspect.isclass(thing) else {}
        for member in members:
            assert member.startswith("__") or f"def {member}(" in stub, f"{name}.{member}"


def test_names_are_those_that_programs_use() -> None:
    assert repr(ivcam.NotFoundError) == "<class 'ivcam.NotFoundError'>"
    for name in ivcam.__all__:
        module = getattr(getattr(ivcam, name), "__module__", "ivcam")
        assert module == "ivcam", name
