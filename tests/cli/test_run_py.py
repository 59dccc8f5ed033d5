"""run.py on its own: what it needs of Python, when it installs again, what it says."""

from __future__ import annotations

import ast
import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest

RUN = Path(__file__).parents[2] / "run.py"


@pytest.fixture
def run(tmp_path, monkeypatch):
    """run.py as a module that believes to live in an empty folder."""
    spec = importlib.util.spec_from_file_location("run", RUN)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    for name in ("pyproject.toml", "constraints.txt"):
        (tmp_path / name).write_text("a")
    venv = tmp_path / ".venv"
    venv.mkdir()
    (venv / "python").write_text("")
    places = {"HOME": tmp_path, "VENV": venv, "STAMP": venv / "ready.json", "PYTHON": venv / "python"}
    for name, value in places.items():
        monkeypatch.setattr(module, name, value)
    return module


@pytest.fixture
def done(run, monkeypatch):
    """Names of the steps that `set_up` takes, in order."""
    steps = []
    for step in ("make_venv", "install_package", "install_system_parts"):
        monkeypatch.setattr(run, step, lambda *_, step=step: steps.append(step))
    return steps


def test_standard_library_only():
    imports = [node for node in ast.walk(ast.parse(RUN.read_text("utf-8"))) if isinstance(node, ast.Import)]
    names = {alias.name for node in imports for alias in node.names}
    assert names <= set(sys.stdlib_module_names)


def test_an_old_python_can_read_it():
    ast.parse(RUN.read_text("utf-8"), feature_version=(3, 7))


@pytest.mark.parametrize("version", [(3, 9), (3, 14)])
def test_another_python_is_looked_for(run, monkeypatch, version):
    monkeypatch.setattr(run.sys, "version_info", (*version, 0))
    monkeypatch.setattr(run, "works", lambda command: command[0] == "python3.12")
    assert run.suitable_python() == ["python3.12"]
    monkeypatch.setattr(run, "works", lambda command: False)
    with pytest.raises(run.Stop, match=r"needs Python 3\.11, 3\.12 or 3\.13; this is {}\.{} ".format(*version)):
        run.main(["demo"])


def test_help_and_nonsense():
    for arguments, code in ((["--help"], 0), ([], 2), (["fly"], 2)):
        done = subprocess.run([sys.executable, RUN, *arguments], capture_output=True, text=True)
        assert done.returncode == code and "python3 run.py demo" in done.stdout


def test_installs_once_and_again_when_requirements_change(run, done):
    run.set_up(for_tests=False)
    assert done == ["make_venv", "install_package", "install_system_parts"]
    run.set_up(for_tests=False)
    assert len(done) == 3
    (run.HOME / "constraints.txt").write_text("b")
    run.set_up(for_tests=False)
    assert len(done) == 6


def test_an_interrupted_set_up_is_not_taken_for_a_finished_one(run, done, monkeypatch):
    run.set_up(for_tests=False)
    (run.HOME / "constraints.txt").write_text("b")

    def interrupt(_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(run, "install_package", interrupt)
        with pytest.raises(KeyboardInterrupt):
            run.set_up(for_tests=False)
    assert not run.STAMP.exists()
    run.set_up(for_tests=False)
    assert run.STAMP.exists()


def test_what_cannot_be_installed_is_one_command(run, monkeypatch):
    check = {"name": "path tracer", "ok": False, "found": "no LLVM", "essential": True}
    report = {"ok": False, "packages": ["libllvm19"], "mend": "sudo apt-get install -y libllvm19", "checks": [check]}
    monkeypatch.setattr(run, "doctor", lambda: report)
    monkeypatch.setattr(run, "apt_install", lambda packages: False)
    with pytest.raises(run.Stop, match=r"path tracer: no LLVM\.\nRun: sudo apt-get install -y libllvm19$"):
        run.install_system_parts(for_tests=False)
