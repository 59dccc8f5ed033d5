"""Where the disks of the polar matrix stand: as large as the room allows, measured and model beside each other."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from lambent.viewer.editor.readings import Incident

HEAD_PX = 17.0  # a line of text above a row or a block
LARGEST_PX = 170.0


@dataclass(frozen=True)
class Matrix:
    """Places in pixels from the upper left corner.

    Attributes
    ----------
    step : float
        Width and height of a disk.
    tiles : dict of (kind, incident, side) to (x, y)
        Indices of the kind and the incident direction; side 1 is the far one.
    titles : tuple of (x, y, text)
        What is written: of columns and rows, angles; of blocks, "kind 0", "kind 1" and so on; "far side" of rows.
    """

    step: float
    tiles: dict[tuple[int, int, int], tuple[float, float]]
    titles: tuple[tuple[float, float, str], ...]


def matrix(incidents: Sequence[Incident], kinds: int, sides: int, width: float, height: float) -> Matrix:
    """With one phi_i (isotropic tables): lines of theta_i, the kinds below each other. Else a block of theta_i x phi_i
    per kind, beside or below each other."""
    phis = sorted({i.phi_deg for i in incidents})
    if len(phis) == 1:
        options = [_lines(incidents, kinds, sides, width, height, lines) for lines in range(1, len(incidents) + 1)]
    else:
        options = [_blocks(incidents, kinds, sides, width, height, across) for across in range(1, kinds + 1)]
    return max(options, key=lambda option: option.step)


def _lines(incidents: Sequence[Incident], kinds: int, sides: int, width: float, height: float, lines: int) -> Matrix:
    label = 62.0
    columns = math.ceil(len(incidents) / lines)
    step = min((width - label) / columns, (height / lines - HEAD_PX) / (kinds * sides), LARGEST_PX)
    step = max(step, 1.0)
    tiles, titles = {}, []
    for index, incident in enumerate(incidents):
        line, column = divmod(index, columns)
        x, y = label + column * step, line * (HEAD_PX + kinds * sides * step)
        titles.append((x + 2, y, f"{incident.theta_deg:g}°"))
        for kind in range(kinds):
            top = y + HEAD_PX + kind * sides * step
            if column == 0:
                titles.append((0.0, top + step / 2 - 8, f"kind {kind}"))
                if sides == 2:
                    titles.append((0.0, top + 1.5 * step - 8, "far side"))
            for side in range(sides):
                tiles[kind, index, side] = (x, top + side * step)
    return Matrix(step, tiles, tuple(titles))


def _blocks(incidents: Sequence[Incident], kinds: int, sides: int, width: float, height: float, across: int) -> Matrix:
    label = 30.0
    thetas, phis = sorted({i.theta_deg for i in incidents}), sorted({i.phi_deg for i in incidents})
    down = math.ceil(kinds / across)
    step = min((width / across - label) / len(phis), (height / down - 2 * HEAD_PX) / (len(thetas) * sides), LARGEST_PX)
    step = max(step, 1.0)
    tiles, titles = {}, []
    for kind in range(kinds):
        left = kind % across * (label + len(phis) * step)
        top = kind // across * (2 * HEAD_PX + len(thetas) * sides * step)
        titles.append((left + label, top, f"kind {kind}"))
        titles += [(left + label + c * step + 1, top + HEAD_PX, f"{phi:g}°") for c, phi in enumerate(phis)]
        titles += [
            (left, top + 2 * HEAD_PX + r * sides * step + sides * step / 2 - 8, f"{theta:g}°")
            for r, theta in enumerate(thetas)
        ]
        for index, incident in enumerate(incidents):
            row, column = thetas.index(incident.theta_deg), phis.index(incident.phi_deg)
            for side in range(sides):
                place = (left + label + column * step, top + 2 * HEAD_PX + (row * sides + side) * step)
                tiles[kind, index, side] = place
    return Matrix(step, tiles, tuple(titles))
