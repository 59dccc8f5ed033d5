"""Makes the files that the tutorials begin with, for readers who have none of their own.

.venv/bin/python docs/tutorials/samples.py

`office.obj` is what a modeller exports: boxes in metres, y up, each object named. `downlight.ies` is a luminaire.
`anodised.csv` is a table as an instrument's program writes it, of a surface that no single lobe describes.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from lambent.core.geometry.directions import angles
from lambent.materials.document import Lobe, Material
from lambent.materials.measured.inspecting.synthetic import Setup, synthesise

FILES = Path(__file__).parent / "files"
Corner = tuple[float, float, float]
WIDE, HIGH, DEEP, SILL, LINTEL = 5.0, 2.7, 4.0, 0.9, 2.3  # metres


def office() -> str:
    """Room with a window to the south, two desks, chairs, a cabinet."""
    x, z = WIDE / 2, DEEP / 2
    boxes: list[tuple[str, Corner, Corner]] = [
        ("floor", (-x, -0.1, -z), (x, 0, z)),
        ("ceiling", (-x, HIGH, -z), (x, HIGH + 0.1, z)),
        ("wall_west", (-x - 0.1, 0, -z), (-x, HIGH, z)),
        ("wall_east", (x, 0, -z), (x + 0.1, HIGH, z)),
        ("wall_north", (-x, 0, -z - 0.1), (x, HIGH, -z)),
        ("wall_sill", (-x, 0, z), (x, SILL, z + 0.2)),
        ("wall_lintel", (-x, LINTEL, z), (x, HIGH, z + 0.2)),
        ("wall_pier_west", (-x, SILL, z), (-x + 0.6, LINTEL, z + 0.2)),
        ("wall_pier_east", (x - 0.6, SILL, z), (x, LINTEL, z + 0.2)),
        ("frame_middle", (-0.04, SILL, z + 0.06), (0.04, LINTEL, z + 0.14)),
        ("cabinet", (-x, 0, -1.6), (-x + 0.45, 1.3, 0.2)),
        ("door", (1.1, 0, -z), (2.0, 2.05, -z + 0.03)),
    ]
    for number, left in enumerate((-1.3, 0.7), 1):
        boxes.append((f"desk_{number}", (left, 0.7, -0.2), (left + 1.6, 0.74, 0.6)))
        for leg, at in (("a", left + 0.05), ("b", left + 1.5)):
            boxes.append((f"leg_{number}{leg}", (at, 0, -0.15), (at + 0.05, 0.7, 0.55)))
        seat = left + 0.55
        boxes.append((f"chair_{number}", (seat, 0.42, -0.85), (seat + 0.5, 0.48, -0.35)))
        boxes.append((f"chair_back_{number}", (seat, 0.55, -0.9), (seat + 0.5, 0.95, -0.86)))
        boxes.append((f"chair_foot_{number}", (seat + 0.21, 0, -0.64), (seat + 0.29, 0.42, -0.56)))
    return obj(boxes)


def obj(boxes: list[tuple[str, Corner, Corner]]) -> str:
    """OBJ text of boxes by name, between two corners."""
    lines = ["# metres, y up"]
    sides = ("1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4")  # outside is counter-clockwise
    for number, (name, low, high) in enumerate(boxes):
        corners = [(a, b, c) for a in (low[0], high[0]) for b in (low[1], high[1]) for c in (low[2], high[2])]
        lines += [f"o {name}", *("v {:g} {:g} {:g}".format(*corner) for corner in corners)]
        lines += ["f " + " ".join(str(8 * number + int(one)) for one in side.split()) for side in sides]
    return "\n".join(lines) + "\n"


def downlight() -> str:
    """IES LM-63 text: 2000 lm within 2 x 40 degrees, from a disc of 0.18 m."""
    theta = np.arange(0, 91, 5.0)
    shape = np.exp(-((theta / 38) ** 4)) * np.cos(np.radians(theta)).clip(0)
    middle = (theta[1:] + theta[:-1]) / 2
    flux = 2 * np.pi * np.sum(np.sin(np.radians(middle)) * np.radians(5) * (shape[1:] + shape[:-1]) / 2)
    candela = 2000 / flux * shape
    head = "IESNA:LM-63-2002\n[TEST] made by docs/tutorials/samples.py\n[MANUFAC] none\n[LUMINAIRE] downlight 18 W\n"
    numbers = f"1 -1 1 {len(theta)} 1 1 2 -0.18 0 0\n1 1 18\n"
    rows = [" ".join(f"{one:g}" for one in row) for row in (theta, [0.0], candela.round(1))]
    return f"{head}TILT=NONE\n{numbers}" + "\n".join(rows) + "\n"


def anodised() -> str:
    """Comma-separated columns: an isotropic grey metal with a sharp lobe, a wide one, and noise."""
    sharp = Lobe(k=0.4, mx=0.07, my=0.07, r0=0.75, alpha=0.5, distribution="ggx")
    wide = Lobe(k=0.35, mx=0.28, my=0.28, r0=0.65, alpha=0.4)
    metal = Material(name="anodised", kd=0.05, lobes=(sharp, wide))
    setup = Setup((0.0, 15.0, 30.0, 45.0, 60.0), step_deg=15, fine_deg=3, fine_reach_deg=12, noise=0.02, floor=1e-3)
    table = synthesise(metal, setup).samples()
    (theta_i, phi_i), (theta_o, phi_o) = (np.degrees(angles(w)) for w in (table.wi, table.wo))
    columns = (theta_i, phi_i, theta_o, phi_o % 360, table.f.mean(axis=1))
    rows = [",".join(f"{one:.5g}" for one in row) for row in np.column_stack(columns)]
    return "theta_in,phi_in,theta_out,phi_out,brdf\n" + "\n".join(rows) + "\n"


if __name__ == "__main__":
    FILES.mkdir(exist_ok=True)
    for name, make in (("office.obj", office), ("downlight.ies", downlight), ("anodised.csv", anodised)):
        (FILES / name).write_text(make(), "utf-8")
