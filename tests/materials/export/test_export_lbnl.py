"""Written BSDF XML: energy, reciprocity, colour and both sides, by our reader and by Radiance."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.geometry.directions import Floats, direction
from lambent.core.geometry.sequences import r2
from lambent.core.light.colour import luminance
from lambent.core.progress import Cancelled
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material
from lambent.materials.export.lbnl_xml import write
from lambent.materials.export.resampling import patch_mean
from lambent.materials.measured import load
from lambent.materials.measured.inspecting.metrics import METRICS
from lambent.materials.measured.lbnl_xml import LbnlTable, read
from lambent.materials.measured.merl import directions_of
from lambent.materials.measured.parts.klems import KLEMS_FULL
from lambent.materials.measured.parts.spectral import equal_energy_of_rgb
from tests.materials.measured.lbnl_files import angles_away_from_borders, ask_radiance, lbnl_xml, needs_radiance, words
from tests.materials.measured.measured_files import merl_bytes

GREY = (0.4, 0.4, 0.4)
MIRROR = Material(name="mirror", lobes=(Lobe(k=(0.98,) * 3, mx=0.0068, my=0.0297, r0=0.84, alpha=0.49),))
FOIL = Material(
    name="a foil, red & <thin>",
    kd=(0.3, 0.2, 0.1),
    kt_d=(0.05, 0.1, 0.15),
    lobes=(
        Lobe(k=(0.5, 0.5, 0.5), mx=0.5, my=0.25, r0=0.3),
        Lobe(side="transmission", k=(0.3, 0.3, 0.2), mx=0.6, my=0.3, r0=0.0, distribution="ggx"),
    ),
)
BACK = np.array((-1, -1, 1))


@pytest.fixture
def hasty(monkeypatch: pytest.MonkeyPatch) -> None:
    """Few directions, for results that are exact with any number of them."""
    monkeypatch.setattr(patch_mean, "LOBES_LOG2", 5)


@pytest.fixture(scope="module")
def foil(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, LbnlTable]:
    path = tmp_path_factory.mktemp("foil") / "foil.xml"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(patch_mean, "LOBES_LOG2", 11)  # its lobes are wide
        write(FOIL, path)
    return path, read(path)


@pytest.fixture(scope="module")
def mirror(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, LbnlTable]:
    """The cost reports that ten-degree patches cannot hold a one-degree lobe."""
    path = tmp_path_factory.mktemp("mirror") / "mirror.xml"
    cost = write(MIRROR, path)
    assert any("highlight" in lost for lost in cost.lost) and cost.share["l2_ngan"] > 0.5
    return path, read(path)


def patch_albedo(material: Material, patch: int, n: int = 128) -> tuple[Floats, Floats]:
    """r and t (3,) over a patch of incident light, by the material's sampler instead of the writer's quadrature."""
    wi = KLEMS_FULL.points(np.full(n, patch), r2(n)) * BACK
    bsdf, u = MaterialBSDF(material), np.random.default_rng(patch).random((n, 256, 3))
    every = np.broadcast_to(wi[:, None], u.shape)
    wo = bsdf.sample(every, u)
    pdf = bsdf.pdf(wo, every)
    share = np.divide(np.abs(wo[..., 2]), pdf, out=np.zeros_like(pdf), where=pdf > 0)[..., None] * bsdf.eval(every, wo)
    far = wo[..., 2:] < 0
    return np.where(far, 0, share).mean(axis=(0, 1)), np.where(far, share, 0).mean(axis=(0, 1))


@pytest.mark.parametrize("patch", [0, 4, 50, 100, 130, 140])
def test_energy_is_kept(foil, mirror, patch: int) -> None:
    """The mirror's lobe is a degree wide and the patches ten: values at their middles would be a hundred times off."""
    wi = KLEMS_FULL.centres[patch] * BACK
    r, t = patch_albedo(FOIL, patch)
    np.testing.assert_allclose(foil[1].reflectivity(wi), r, rtol=0.015)
    np.testing.assert_allclose(foil[1].transmissivity(wi), t, rtol=0.015)
    r, _ = patch_albedo(MIRROR, patch)
    np.testing.assert_allclose(mirror[1].reflectivity(wi), r[:1], rtol=0.01)


@needs_radiance
def test_radiance_reads_it(foil, tmp_path: Path) -> None:
    """Luminance and integrals as from our reader; colour to the precision Radiance keeps."""
    path, table = foil
    asked = angles_away_from_borders(600)
    answers = ask_radiance(path, tmp_path, asked, asked[:100, :2])
    wi, wo = (direction(*np.radians(asked[:, k : k + 2].T)) for k in (0, 2))
    f = table.eval(wi, wo)
    np.testing.assert_allclose(luminance(f), answers["xyz"][:, 1], rtol=5e-4, atol=1e-9)
    hemi = luminance(np.stack([table.reflectivity(wi[:100]), table.transmissivity(wi[:100])], axis=1))
    np.testing.assert_allclose(hemi, answers["hemi"], rtol=4e-4)
    x, _, z = np.moveaxis(equal_energy_of_rgb(f), -1, 0)
    assert np.corrcoef(x - z, answers["xyz"][:, 0] - answers["xyz"][:, 2])[0, 1] > 0.99


def test_materials_stay_reciprocal(foil, mirror) -> None:
    random = angles_away_from_borders(2000, seed=4)
    wi, wo = (direction(*np.radians(random[:, k : k + 2].T)) for k in (0, 2))
    for _, table in (foil, mirror):
        np.testing.assert_allclose(table.eval(wi, wo), table.eval(wo, wi), rtol=2e-6)


def test_a_matrix_is_written_as_it_was_read(tmp_path: Path, hasty: None) -> None:
    """A matrix is constant over patches, so its means are its values, on both sides."""
    random = np.random.default_rng(1)
    blocks = [
        ("Visible", d, words(random.random((145, 145)) * 0.2))
        for d in ("Transmission Front", "Transmission Back", "Reflection Front", "Reflection Back")
    ]
    source = tmp_path / "a.xml"
    source.write_text(lbnl_xml("Columns", blocks))
    table = read(source)
    cost = write(table, tmp_path / "b.xml")
    again = read(tmp_path / "b.xml")
    for where, part in table.parts.items():
        np.testing.assert_allclose(again.parts[where].values, part.values, rtol=2e-6)
    assert max(cost.share.values()) < 1e-5
    assert not any("behind" in lost for lost in cost.lost)


def test_a_measured_table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Grey and glossy, known from one side alone; the cost has every metric and names the missing back."""
    glossy = Material(name="glossy", kd=GREY, lobes=(Lobe(k=(0.5, 0.5, 0.5), mx=0.2, my=0.2, r0=0.3),))
    theta_h, theta_d, phi_d = np.meshgrid(*((np.arange(n) + 0.5) / n * np.pi / 2 for n in (40, 40, 40)), indexing="ij")
    wi, wo = directions_of(theta_h**2 * 2 / np.pi, theta_d, 2 * phi_d)
    f = np.where((wi[..., 2:] > 0) & (wo[..., 2:] > 0), MaterialBSDF(glossy).eval(wi, wo), np.nan)
    (tmp_path / "g.binary").write_bytes(merl_bytes(f))
    table = load(tmp_path / "g.binary")
    monkeypatch.setattr(patch_mean, "LOBES_LOG2", 11)
    cost = write(table, tmp_path / "g.xml")
    written = read(tmp_path / "g.xml")
    for patch in (0, 20, 80):
        u = r2(16)
        wi = KLEMS_FULL.points(np.full(16, patch), u) * BACK
        np.testing.assert_allclose(written.reflectivity(wi[:1])[0], table.reflectivity(wi).mean(axis=0), rtol=0.02)
    assert set(cost.share) == set(METRICS) and 0 < cost.share["l1"] < 0.3
    assert any("behind" in lost for lost in cost.lost)


def test_nothing_to_write(tmp_path: Path, hasty: None) -> None:
    with pytest.raises(UserError, match="no light"):
        write(Material(name="hole"), tmp_path / "h.xml")
    assert not list(tmp_path.iterdir())


def test_an_interrupted_write_leaves_no_file(tmp_path: Path) -> None:
    def stop(done: float, total: float, what: str) -> None:
        if done > 3:
            raise Cancelled

    with pytest.raises(Cancelled):
        write(FOIL, tmp_path / "f.xml", stop)
    assert not list(tmp_path.iterdir())
