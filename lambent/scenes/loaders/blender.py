"""Blender's files: Lambent's extension exports them, in Blender or in Python with the package bpy."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

from lambent.core.errors import UserError

BLEND = ".blend"
EXTENSION = "lambent_blender"
ANSWER = "lambent: "  # begins the line with the extension's answer
HINT = "install Blender 4.2 or newer as `blender`, or `pip install --no-deps bpy` in Python 3.11; or export glTF"


def exported(path: Path) -> tuple[Path, list[str]]:
    """Export a .blend into the folder NAME.lambent beside it.

    Returns
    -------
    scene, notes : Path, list of str
        The scene.toml, and a sentence for each thing that it does not carry.

    Raises
    ------
    UserError
        If there is no such file, no Blender, or nothing that it can export.
    """
    if not path.is_file():
        raise UserError("cannot be read (no such file)", file=path)
    command = [*_blender(path), str(path.resolve()), str(path.resolve().with_suffix(".lambent"))]
    # bpy loads libraries of its own: nothing of this process's Python may lead it to others
    done = subprocess.run(
        command, capture_output=True, text=True, errors="replace", env={**os.environ, "PYTHONWARNINGS": "ignore"}
    )
    answers = [line.removeprefix(ANSWER) for line in done.stdout.splitlines() if line.startswith(ANSWER)]
    if not answers:
        said = [line for line in (done.stdout + done.stderr).splitlines() if line.strip()]
        raise UserError(f"Blender ended with code {done.returncode}: {said[-1] if said else 'no message'}", file=path)
    answer = json.loads(answers[-1])
    if "error" in answer:
        raise UserError(answer["error"], file=path)
    return Path(answer["scene"]), answer["notes"]


def _blender(path: Path) -> list[str]:
    """The command of Blender, or of this Python with bpy, that runs the export."""
    extension, program = find_spec(EXTENSION), shutil.which("blender")
    if extension is None or extension.origin is None:
        raise UserError("needs the package lambent_blender", file=path, hint="install Lambent again")
    script = str(Path(extension.origin).with_name("headless.py"))
    if program is not None:
        return [program, "--background", "--factory-startup", "--disable-autoexec", "--python", script, "--"]
    if find_spec("bpy") is None:
        raise UserError("needs Blender to be read", file=path, hint=HINT)
    return [sys.executable, script]
