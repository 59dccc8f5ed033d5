"""Photometric files written from any distribution of light."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

HEADS = {1986: "", 1991: "IESNA91\n", 1995: "IESNA:LM-63-1995\n", 2002: "IESNA:LM-63-2002\n"}


def ies(
    vertical: str = "0 45 90",
    horizontal: str = "0",
    candela: str = "1000 500 0",
    *,
    head: str = HEADS[2002],
    tilt: str = "TILT=NONE",
    numbers: str = "1 -1 1",
    kind: int = 1,
    units: int = 2,
    factors: str = "1 1 50",
) -> str:
    counts = f"{len(vertical.split())} {len(horizontal.split())}"
    return (
        f"{head}[TEST] by hand\n[MANUFAC] none\n{tilt}\n{numbers} {counts} {kind} {units} .5 .25 0\n{factors}\n"
        f"{vertical}\n{horizontal}\n{candela}\n"
    )


Light = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]  # candela by x (C0), y (C90), z (axis)


def lobe(exponent: float, most_cd: float = 1000.0) -> Light:
    """most_cd cos^n of the angle from the axis: 2 pi most_cd / (n + 1) lm."""
    return lambda x, y, z: most_cd * np.maximum(z, 0.0) ** exponent


def ldt(
    values: Sequence[Sequence[float]],
    *,
    symmetry: int = 1,
    c_deg: Sequence[float] = (0,),
    gamma_deg: Sequence[float] = (0, 90),
    area_mm: Sequence[float] = (0, 0, 0, 0, 0, 0),
    percent: Sequence[float] = (100, 100),
    factor: float = 1.0,
    tilt: float = 0.0,
    sets: Sequence[tuple[int, float]] = ((1, 1000),),
    name: str = "Dummy",
) -> str:
    """EULUMDAT text: intensities by the file's planes in cd/klm; `area_mm` is length, width, and four heights."""
    lines = ["Maker", 3, symmetry, len(c_deg), 0, len(gamma_deg), 0, "R 1", name, "N 1", "a.ldt", "2024", 100, 100, 50]
    lines += [*area_mm, *percent, factor, tilt, len(sets)]
    for count, lumens in sets:
        lines += [count, f"lamp of {lumens} lm", lumens, "3000 K", 80, 20]
    lines += [0.5] * 10 + [*c_deg, *gamma_deg, *(value for row in values for value in row)]
    return "\n".join(map(str, lines)) + "\n"


def ldt_of(light: Light, c_deg: Sequence[float], gamma_deg: Sequence[float], symmetry: int = 0) -> str:
    c, gamma = np.meshgrid(np.radians(c_deg), np.radians(gamma_deg), indexing="ij")
    values = light(np.sin(gamma) * np.cos(c), np.sin(gamma) * np.sin(c), np.cos(gamma))
    return ldt(values.tolist(), symmetry=symmetry, c_deg=c_deg, gamma_deg=gamma_deg)


def ies_of(light: Light, kind: str, horizontal_deg: Sequence[float], vertical_deg: Sequence[float]) -> str:
    """IES text of type "A", "B" or "C", by the rotations of LM-63: V turns the axis to C0, H to C270."""
    h, v = np.meshgrid(np.radians(horizontal_deg), np.radians(vertical_deg), indexing="ij")
    x, y, z = {
        "A": (np.sin(v), -np.cos(v) * np.sin(h), np.cos(v) * np.cos(h)),
        "B": (np.cos(h) * np.sin(v), -np.sin(h), np.cos(h) * np.cos(v)),
        "C": (np.sin(v) * np.cos(h), np.sin(v) * np.sin(h), np.cos(v)),
    }[kind]
    candela = "\n".join(" ".join(f"{cd:.9g}" for cd in row) for row in light(x, y, z))
    angles = (" ".join(f"{deg:g}" for deg in some) for some in (vertical_deg, horizontal_deg))
    return ies(*angles, candela, kind={"C": 1, "B": 2, "A": 3}[kind])
