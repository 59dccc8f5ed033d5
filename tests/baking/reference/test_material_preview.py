"""A ball that wears a table looks like one that wears the material it was synthesised from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lambent.baking.reference import material_preview
from lambent.baking.reference.material_preview import FOV_DEG, preview
from lambent.core.pictures.images import write_image
from lambent.materials.document import Lobe, Material
from lambent.materials.measured.inspecting.synthetic import ANISOTROPIC, ISOTROPIC, synthesise
from lambent.materials.measured.tables.half_vector_grid import GridShape
from lambent.scenes.scene import ImageEnvironment

SMALL = {"size_px": 48, "spp": 16}
CLEAN = {"noise": 0.0, "floor": 0.0, "sector_deg": 0.0, "step_deg": 7.5, "fine_deg": 3.75}
BRUSHED = Material(name="brushed", kd=0.02, lobes=(Lobe(k=0.9, mx=0.07, my=0.3, r0=0.8, alpha=0.4),))


@pytest.fixture(autouse=True)
def _small(mi, monkeypatch):
    monkeypatch.setattr(material_preview, "GRIDS", {True: GridShape(16, 1, 64, 16), False: GridShape(12, 12, 64, 32)})


def test_a_lambertian_table_is_a_lambertian_ball():
    material = Material(name="plaster", kd=(0.6, 0.3, 0.2))
    seen = preview(synthesise(material, replace(ISOTROPIC, **CLEAN)), material, **SMALL)
    assert seen.figures["psnr_db"] > 38 and seen.figures["flip_mean"] < 0.03
    assert not seen.lamp
    radius = np.tan(np.arcsin(1 / 6)) / np.tan(np.radians(FOV_DEG / 2))  # of the silhouette, in half pictures
    assert seen.ball.mean() == pytest.approx(np.pi / 4 * radius**2, abs=0.06)
    assert (seen.measured[~seen.ball] == 0).all()
    assert seen.measured[seen.ball].mean() == pytest.approx(0.3, abs=0.01)


@pytest.mark.long
def test_brushed_the_right_way():
    table = synthesise(BRUSHED, replace(ANISOTROPIC, phi_i_deg=(0, 30, 60, 90), **CLEAN))
    right = preview(table, BRUSHED, **SMALL).figures["flip_mean"]
    lobe = BRUSHED.lobes[0].model_copy(update={"mx": 0.3, "my": 0.07})
    wrong = preview(table, BRUSHED.model_copy(update={"lobes": (lobe,)}), **SMALL).figures["flip_mean"]
    assert right < 0.12 and wrong > 1.5 * right


@pytest.mark.long
def test_a_lamp_shines_through():
    material = Material(name="paper", kd=0.3, lobes=(Lobe(side="transmission", k=0.6, mx=0.15, my=0.15, r0=0.0),))
    seen = preview(synthesise(material, replace(ISOTROPIC, **CLEAN)), material, **SMALL)
    assert seen.lamp
    row, column = np.unravel_index(seen.model.sum(axis=-1).argmax(), seen.ball.shape)
    assert row > 24 and column > 24  # below and to the right of the middle, where it hangs
    assert seen.figures["psnr_db"] > 25


@pytest.mark.long
def test_the_lamp_is_as_bright_as_the_environment_is_scaled(tmp_path):
    """One exposure serves lamp and environment: a scale of the environment that the lamp ignored would be seen."""
    rows = np.linspace(2.0, 0.2, 16)[:, None, None] * np.ones((1, 32, 3))
    write_image(tmp_path / "sky.exr", rows.astype(np.float32))
    material = Material(name="paper", kd=0.3, kt_d=0.3)
    table = synthesise(material, replace(ISOTROPIC, **CLEAN))
    dim, bright = (
        preview(table, material, ImageEnvironment(tmp_path / "sky.exr", scale), **SMALL) for scale in (1, 50)
    )
    red, _, blue = dim.model[dim.ball].mean(axis=0)
    assert dim.lamp and red > 1.1 * blue, "the lamp, which is warmer than the sky, is seen"
    np.testing.assert_allclose(bright.model, dim.model, atol=2e-3)
    np.testing.assert_allclose(bright.measured, dim.measured, atol=2e-3)
