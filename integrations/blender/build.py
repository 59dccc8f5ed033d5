#!/usr/bin/env python3
"""Pack the extension for Blender's *Install from Disk*: `python3 integrations/blender/build.py [FOLDER]`."""

from __future__ import annotations

import sys
import tomllib
import zipfile
from pathlib import Path

HERE = Path(__file__).resolve().parent / "lambent_blender"


def main(folder: str = ".") -> None:
    manifest = tomllib.loads((HERE / "blender_manifest.toml").read_text("utf-8"))
    target = Path(folder) / f"{manifest['id']}-{manifest['version']}.zip"
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as packed:
        for file in sorted(one for one in HERE.iterdir() if one.suffix in (".py", ".toml")):
            packed.write(file, file.name)
    sys.stdout.write(f"{target}\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
