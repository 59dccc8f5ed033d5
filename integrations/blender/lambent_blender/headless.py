"""Export a .blend without a window: `blender -b --python headless.py -- FILE FOLDER`, or by Python with bpy.

The last line on stdout is `lambent: ` and a JSON object: `scene` and `notes`, or `error`.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from lambent_blender import properties
from lambent_blender.export import export_scene


def main(file, folder):
    """Export; the answer as a dictionary."""
    properties.register()
    try:
        bpy.ops.wm.open_mainfile(filepath=file, load_ui=False, use_scripts=False)
        exported = export_scene(folder, Path(file).stem)
    except RuntimeError as error:
        return {"error": " ".join(str(error).split()).removeprefix("Error: ")}
    return {"scene": str(exported.scene), "notes": exported.notes}


if __name__ == "__main__":
    words = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]
    print(f"\nlambent: {json.dumps(main(*words))}", flush=True)  # noqa: T201
