"""Small BSDF files, and Radiance's answers about any of them."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

needs_radiance = pytest.mark.skipif(
    importlib.util.find_spec("pyradiance") is None, reason="pyradiance is not installed: Radiance cannot be asked"
)
# In a process of its own: pyradiance 1.3.1 crashes when a file that was loaded is let go.
_ASK = """
import sys
import numpy as np
import pyradiance.bsdf as radiance
path, inputs, outputs = sys.argv[1:]
data = radiance.load_file(path)
asked = np.load(inputs)
xyz = np.array([radiance.query(data, *a) for a in asked["angles"]]).reshape(-1, 3)
ways = 8 + 4 + 1, 8 + 4 + 2  # diffuse, specular, and reflection or transmission
hemi = np.array([[radiance.direct_hemi(data, *a, way) for way in ways] for a in asked["incident"]]).reshape(-1, 2)
np.savez(outputs, xyz=xyz, hemi=hemi)
"""


def ask_radiance(path: Path, folder: Path, angles_deg: np.ndarray, incident_deg: np.ndarray) -> dict[str, np.ndarray]:
    """Radiance's values for a file, by pyradiance; its tests are marked `needs_radiance`.

    Parameters
    ----------
    angles_deg : (N, 4)
        theta_i phi_i theta_o phi_o; theta over 90 is below the sheet.
    incident_deg : (M, 2)

    Returns
    -------
    dict
        xyz (N, 3), f as equal-energy XYZ; hemi (M, 2), reflection and transmission.
    """
    inputs, outputs = folder / "asked.npz", folder / "answered.npz"
    np.savez(inputs, angles=angles_deg, incident=incident_deg)
    done = subprocess.run([sys.executable, "-c", _ASK, str(path), str(inputs), str(outputs)], capture_output=True)
    # It may crash on the way out; what counts is that it wrote its answers whole.
    assert outputs.exists(), done.stderr.decode()
    with np.load(outputs) as answers:
        found = dict(answers)
    outputs.unlink()
    return found


def lbnl_xml(
    structure: str, blocks: Sequence[tuple[str, str, str]], bases: str = "", column: str = "", row: str = ""
) -> str:
    """A file of blocks (wavelength, direction, numbers); on Klems full or trees where no basis is named."""
    tree = structure.startswith("Tensor")
    if tree:
        angles = "<AngleBasis>LBNL/Shirley-Chiu</AngleBasis>"
    else:
        names = column or "LBNL/Klems Full", row or column or "LBNL/Klems Full"
        angles = "<ColumnAngleBasis>{}</ColumnAngleBasis><RowAngleBasis>{}</RowAngleBasis>".format(*names)
    data = "\n".join(
        f'<WavelengthData><LayerNumber>System</LayerNumber><Wavelength unit="Integral">{wavelength}</Wavelength>'
        f"<WavelengthDataBlock><WavelengthDataDirection>{direction}</WavelengthDataDirection>{angles}"
        f"<ScatteringDataType>BTDF</ScatteringDataType><ScatteringData>{numbers}</ScatteringData>"
        "</WavelengthDataBlock></WavelengthData>"
        for wavelength, direction, numbers in blocks
    )
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n<WindowElement xmlns="http://windows.lbl.gov">\n'
        "<WindowElementType>System</WindowElementType><FileType>BSDF</FileType><Optical><Layer>\n"
        "<Material><Name>made up</Name><Manufacturer>nobody</Manufacturer></Material>\n"
        f"<DataDefinition><IncidentDataStructure>{structure}</IncidentDataStructure>{bases}</DataDefinition>\n"
        f"{data}\n</Layer></Optical></WindowElement>\n"
    )


def angle_basis(name: str, rings: Sequence[tuple[float, float, int]]) -> str:
    """An AngleBasis element of rings (lower, upper, patches)."""
    blocks = "".join(
        f"<AngleBasisBlock><Theta>{(a + b) / 2}</Theta><nPhis>{n}</nPhis><ThetaBounds><LowerTheta>{a}</LowerTheta>"
        f"<UpperTheta>{b}</UpperTheta></ThetaBounds></AngleBasisBlock>"
        for a, b, n in rings
    )
    return f"<AngleBasis><AngleBasisName>{name}</AngleBasisName>{blocks}</AngleBasis>"


def words(values: np.ndarray) -> str:
    """Numbers of an array, row by row."""
    return "\n".join(", ".join(f"{v:.7g}" for v in row) for row in np.atleast_2d(values))


def random_tree(random: np.random.Generator, rank: int, depth: int, scale: float = 0.1) -> str:
    """A tree that is cut at random, with leaves and grids of leaves at every depth."""
    if depth and random.random() < 0.6:
        below = " ".join(random_tree(random, rank, depth - 1, scale) for _ in range(1 << rank))
        return f"{{ {below} }}"
    count = 1 << rank * int(random.random() < 0.3)
    return "{ " + " ".join(f"{v:.6g}" for v in scale * random.random(count)) + " }"


def angles_away_from_borders(n: int, seed: int = 0) -> np.ndarray:
    """(n, 4) theta_i phi_i theta_o phi_o in degrees, on all sides, half near the mirrored or straight one.

    Closer than 0.6 degrees to the horizon Radiance has no answers, and the normal is a corner of trees.
    """
    random = np.random.default_rng(seed)
    theta = np.degrees(np.arccos(random.uniform(-1, 1, (n, 2))))
    phi = random.uniform(0, 360, (n, 2))
    near = np.arange(n) % 2 == 0
    through = random.random(n) < 0.5
    theta[near, 1] = np.where(through, 180 - theta[:, 0], theta[:, 0])[near] + random.uniform(-9, 9, near.sum())
    phi[near, 1] = phi[near, 0] + 180 + random.uniform(-20, 20, near.sum())
    theta = theta.clip(1, 179)
    theta = np.where(np.abs(theta - 90) < 0.6, 80, theta)
    return np.column_stack([theta[:, 0], phi[:, 0], theta[:, 1], phi[:, 1] % 360])
