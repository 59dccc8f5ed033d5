"""Sound small files of every reader, from which the tests of `tests/reliability` make broken ones."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from lambent.core.geometry.directions import angles, direction
from lambent.materials.measured.inspecting.synthetic import Setup, synthesise
from lambent.materials.measured.parts.gonio_text import write_gonio
from tests.materials.measured.lbnl_files import angle_basis, lbnl_xml, random_tree, words
from tests.materials.measured.measured_files import (
    GLOSSY,
    alta_text,
    beam,
    cornell_rows,
    cornell_text,
    ddr,
    fred_text,
    lighttools,
    merl_bytes,
    rgl_fields,
    tensor_bytes,
    zemax_text,
)


def seeds() -> dict[str, list[bytes]]:
    """Sound small files by the name of their reader."""
    coarse = Setup((0.0, 40.0), step_deg=30, fine_deg=15, fine_reach_deg=15)
    turned = Setup((0.0, 40.0), (0.0, 90.0), "quadrant", 30, 15, 15)
    grid = np.array([(t, p) for t in (0, 25, 50, 75) for p in (0, 60, 120, 180)], float)
    block = grid, 0.1 + grid[:, 0] / 100
    rows = [(a, 0, b, c, 0.2) for a in (0, 30) for b in (0, 20, 40) for c in (0, 90, 180, 270)]
    scan = b"theta_i theta_o brdf\n" + b"".join(b"30 %d .1\n" % theta for theta in range(-70, 71, 10))
    columns = "theta_in,phi_in,theta_out,phi_out,brdf\n" + "\n".join(",".join(map(str, row)) for row in rows) + "\n"
    random = np.random.default_rng(0)
    wi, wo = (direction(random.uniform(0, 1.3, 40), random.uniform(0, 6.2, 40)) for _ in range(2))
    tuples = np.column_stack([*angles(wi), *angles(wo), np.full((40, 3), 0.2)])
    astm = "SAMPLE_NAME x\nNUM_POINTS 40\nVARS theta_i,phi_i,theta_s,phi_s,R,G,B\n"
    basis = angle_basis("mine", [(0, 30, 1), (30, 60, 4), (60, 90, 4)])
    matrix = [
        ("Visible", d, words(0.1 + random.random((9, 9)) * 0.2)) for d in ("Reflection Back", "Transmission Front")
    ]
    tree = "{" + " ".join(random_tree(random, 3, 1) for _ in range(8)) + "}"
    half = np.stack([np.radians(grid[:, 0]) / 2, np.radians(grid[:, 0]) / 2, np.radians(grid[:, 1])], axis=-1)
    return {
        "ALTA text": [
            alta_text("RUSIN_TH_TD_PD", half, np.full((len(half), 4), 0.2), "RGB_COLOR", vs="1").encode(),
            alta_text("COS_TH_TD", np.cos(half[:, :2]), np.full(len(half), 0.2)).encode(),
            alta_text("CARTESIAN", np.column_stack([wo, wi]), np.full(len(wi), 0.2)).encode(),
        ],
        "pab-opto text": [
            "".join(beam(t, p, step=(20, 40)) for t in (0, 30) for p in (0, 60, 120)).encode(),
            beam(150, 0, far=True, kind="BSDF", step=(20, 40)).encode(),
        ],
        "Integra DDR/DDT text": [
            ddr(phi=(0, 90, 180), model="RGB", tint=(1.0, 0.5, 0.2)).encode(),
            ddr(phi=(0, 90, 180, 270), kind="Intensity Relative", psi=(0, 90), sigmat=(0, 20, 40, 60)).encode(),
            ddr(phi=(0, 180), model="spectral 3", tint=(1.0, 0.5, 0.2)).encode(),
        ],
        "LightTools BSDF text": [
            lighttools(kinds=("BRDF", "BTDF")).encode(),
            lighttools(channels=((0, "TrisX"), (0, "TrisY"), (0, "TrisZ")), xyz=True).encode(),
        ],
        "MERL binary": [merl_bytes(np.full((6, 5, 4, 3), 0.25))],
        "RGL tensor file": [tensor_bytes(rgl_fields(p)) for p in (np.zeros(1), np.linspace(-np.pi, -np.pi / 2, 3))],
        "Cornell / pbrt-v2 text": [cornell_text(cornell_rows(count=20), np.linspace(400, 700, 5)).encode()],
        "gonio text": [_gonio(coarse), _gonio(turned), columns.encode(), scan],
        "Zemax BSDF text": [
            zemax_text(lambda wi, wo: 0.1 + 0 * wo[..., :1], "PlaneSymmetrical").encode(),
            zemax_text(lambda wi, wo: 0.1 + 0 * wo, "Asymmetrical", "BTDF").encode(),
        ],
        "FRED BSDF text": [fred_text({(10, 0): block, (40, 0): block}).encode()],
        "ASTM E1392": [(astm + "\n".join(",".join(f"{v:.6g}" for v in row) for row in tuples) + "\n").encode()],
        "LBNL BSDF XML": [
            lbnl_xml("Columns", matrix, basis, "mine").encode(),
            lbnl_xml("TensorTree3", [("Visible", "Transmission Back", tree)]).encode(),
        ],
    }


def _gonio(setup: Setup) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a"
        write_gonio(path, synthesise(GLOSSY, setup))
        return path.read_bytes()
