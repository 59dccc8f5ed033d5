"""The polar matrix: disks as large as space allows, measurement and model side by side."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from lambent.viewer.editor.readings import Incident

HEAD_PX = 17.0  # height of the title above a row or a block
LARGEST_PX = 170.0


@dataclass
class Matrix:
    """Positions (x, y) of disks and of their titles, in pixels from the upper left corner."""

    step: float  # width and height of a disk
    tiles: dict[tuple[int, int, bool], tuple[float, float]] = field(default_factory=dict)  # by (kind, incident, far)
    titles: list[tuple[float, float, str | int]] = field(default_factory=list)  # a number names a kind


def matrix(incidents: Sequence[Incident], kinds: int, sides: int, width: float, height: float) -> Matrix:
    """Lay out the disks: rows of theta_i with one phi_i (isotropic tables), else theta_i x phi_i blocks per kind."""
    if len({i.phi_deg for i in incidents}) == 1:
        options = [_lines(incidents, kinds, sides, width, height, lines) for lines in range(1, len(incidents) + 1)]
    else:
        options = [_blocks(incidents, kinds, sides, width, height, across) for across in range(1, kinds + 1)]
    return max(options, key=lambda option: option.step)


def _lines(incidents: Sequence[Incident], kinds: int, sides: int, width: float, height: float, lines: int) -> Matrix:
    label = 62.0
    columns = math.ceil(len(incidents) / lines)
    step = min((width - label) / columns, (height / lines - HEAD_PX) / (kinds * sides), LARGEST_PX)
    laid = Matrix(step := max(step, 1.0))
    for index, incident in enumerate(incidents):
        line, column = divmod(index, columns)
        x, y = label + column * step, line * (HEAD_PX + kinds * sides * step)
        laid.titles.append((x + 2, y, f"{incident.theta_deg:g}°"))
        for kind in range(kinds):
            top = y + HEAD_PX + kind * sides * step
            words = (kind, "far side")[:sides] if column == 0 else ()
            laid.titles += [(0.0, top + (side + 0.5) * step - 8, text) for side, text in enumerate(words)]
            laid.tiles |= {(kind, index, bool(side)): (x, top + side * step) for side in range(sides)}
    return laid


def _blocks(incidents: Sequence[Incident], kinds: int, sides: int, width: float, height: float, across: int) -> Matrix:
    label = 30.0
    thetas, phis = sorted({i.theta_deg for i in incidents}), sorted({i.phi_deg for i in incidents})
    down = math.ceil(kinds / across)
    step = min((width / across - label) / len(phis), (height / down - 2 * HEAD_PX) / (len(thetas) * sides), LARGEST_PX)
    laid = Matrix(step := max(step, 1.0))
    for kind in range(kinds):
        left = kind % across * (label + len(phis) * step)
        top = kind // across * (2 * HEAD_PX + len(thetas) * sides * step)
        first = top + 2 * HEAD_PX
        laid.titles.append((left + label, top, kind))
        laid.titles += [(left + label + c * step + 1, top + HEAD_PX, f"{phi:g}°") for c, phi in enumerate(phis)]
        laid.titles += [(left, first + (r + 0.5) * sides * step - 8, f"{theta:g}°") for r, theta in enumerate(thetas)]
        for index, incident in enumerate(incidents):
            row, column = thetas.index(incident.theta_deg), phis.index(incident.phi_deg)
            for side in range(sides):
                place = (left + label + column * step, first + (row * sides + side) * step)
                laid.tiles[kind, index, bool(side)] = place
    return laid
