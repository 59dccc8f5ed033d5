"""Views of Radiance pictures: the options in a header's last VIEW line, or in the command line of its renderer."""

from __future__ import annotations

import shlex
from pathlib import Path

import numpy as np

from lambent.core.ceilings import PICTURE_BYTES
from lambent.core.errors import UserError
from lambent.core.inputs import read_bytes
from lambent.core.pictures import rgbe
from lambent.core.plain import is_number, triple
from lambent.core.views.camera import Camera
from lambent.core.views.projections import RADIANCE, View

_PROGRAMS = ("VIEW=", "rpict", "rview", "rvu", "rpiece", "pinterp")  # prefixes of header lines that hold a view
_COUNTS = {"p": 3, "d": 3, "u": 3, "h": 1, "v": 1, "o": 1, "a": 1, "s": 1, "l": 1}


def read_view(path: Path) -> View:
    """View of a Radiance picture.

    Raises
    ------
    UserError
        If the file is not a Radiance picture, states no view, or states one that Lambent does not support.
    """
    data = read_bytes(Path(path), PICTURE_BYTES)
    lines = rgbe.header_lines(data) if data.startswith(rgbe.MAGICS) else []
    said = [line for line in lines if line.startswith(_PROGRAMS) and " -v" in line]
    if not said:
        expected = "a Radiance picture (.hdr) with a VIEW line"
        raise UserError("picture has no view", file=path, expected=expected)
    return view_of(said[-1], path)


def view_of(line: str, file: Path) -> View:
    """View of a line of options; errors name `file`."""
    kinds = {letter: projection for projection, letter in RADIANCE.items()}
    kind, found = "v", {"p": [0.0] * 3, "d": [0.0, 1.0, 0.0], "u": [0.0, 0.0, 1.0], "h": [45.0], "v": [45.0]}
    try:
        words = shlex.split(line)
    except ValueError:
        words = line.split()
    for at, word in enumerate(words):
        if word.startswith("-vt"):
            kind = word[3:]
        elif word[:2] == "-v" and (count := _COUNTS.get(word[2:])):
            values = words[at + 1 : at + 1 + count]
            if len(values) < count or not all(map(is_number, values)):
                raise UserError(
                    "VIEW line is damaged", file=file, field=word, got=" ".join(values), expected=f"{count} numbers"
                )
            found[word[2:]] = [float(value) for value in values]
    if kind not in kinds:
        raise UserError(
            "unknown view type", file=file, got=f"-vt{kind}", expected=", ".join(map("-vt{}".format, kinds))
        )
    if any(found.get(shifted, [0.0]) != [0.0] for shifted in "sl"):
        raise UserError("shifted views are not supported", file=file, field="-vs, -vl", expected="0")
    if not (np.any(found["d"]) and np.all(np.isfinite([*found["p"], *found["d"], *found["u"]]))):
        raise UserError("view has no direction", file=file, field="-vd", got=" ".join(map(str, found["d"])))
    eye = np.array(found["p"])
    camera = Camera(
        "view", triple(eye), triple(eye + np.divide(found["d"], np.linalg.norm(found["d"]))), triple(found["u"])
    )
    view = View(camera, kinds[kind], found["h"][0], found["v"][0])
    view.check()
    return view
