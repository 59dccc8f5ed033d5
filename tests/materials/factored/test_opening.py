"""One entry for documents, models and tables, with the error of each."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.materials.document import Lobe, Material
from lambent.materials.factored.opening import editable_of
from lambent.materials.factored.tabulated import Grid
from lambent.materials.fitting import factors
from lambent.materials.measured.merl import SCALES, MerlTable, bin_centres, directions_of
from lambent.materials.models import model_named
from lambent.materials.models.model import Model

KURT = Material(name="silk", kd=0.2, lobes=(Lobe(mx=0.1, my=0.3, r0=0.1, k=0.5, alpha=0.2),))
SHEET = Material(kd=0.2, kt_d=0.1, lobes=(Lobe(mx=0.3, my=0.3, r0=0.1, k=0.8, side="transmission"),))


@pytest.mark.parametrize("subject", [KURT, SHEET, model_named("cook-torrance")(m=0.2), model_named("lambert")()])
def test_documents_and_models_have_curves_of_their_own(subject: Material | Model) -> None:
    opened = editable_of(subject)
    assert opened.editable.curves
    assert 0 <= max(opened.errors.values()) < 1e-4
    assert not opened.without_quotient


def test_a_document_s_path_opens_as_its_curves(tmp_path: Path) -> None:
    KURT.save(tmp_path / "silk.json")
    opened = editable_of(tmp_path / "silk.json")
    assert set(opened.editable.curves) == {"diffuse", "highlight along", "highlight across"}


def test_a_merl_file_s_own_bins_are_exact(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A small table of MERL's layout that no product is."""
    monkeypatch.setattr(factors, "FITTED", Grid(45, 24, 12, turns_d=2))
    shape = (20, 12, 16)
    theta_h, theta_d, phi_d = np.broadcast_arrays(*bin_centres(shape))
    wi, wo = directions_of(theta_h, theta_d, phi_d)
    f = 0.05 + 2 * np.exp(-((theta_h / 0.3) ** 2)) * (0.1 + theta_d**2) * (1 + 0.3 * np.cos(2 * phi_d))
    f = np.where((wi[..., 2] > 0) & (wo[..., 2] > 0), f, -1.0)
    planes = f / SCALES[:, None, None, None]
    (tmp_path / "small.binary").write_bytes(np.array(shape, "<i4").tobytes() + planes.astype("<f8").tobytes())
    opened = editable_of(tmp_path / "small.binary")
    assert opened.errors["l1"] < 1e-5 < 0.01 < opened.without_quotient["l1"]
    table = MerlTable(planes, tmp_path / "small.binary")
    chosen = np.random.default_rng(0).permutation(wi[..., 0].size)[:500]
    i, o = (w.reshape(-1, 3)[chosen] for w in (wi, wo))
    steep = (i[:, 2] > 0.1) & (o[:, 2] > 0.1)
    assert np.allclose(opened.editable.eval(i[steep], o[steep]), table.eval(i[steep], o[steep]), rtol=1e-4)


def test_files_of_no_kind_are_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="cannot be read"):
        editable_of(tmp_path / "missing.bsdf")
    (tmp_path / "broken.json").write_text('{"kd": ')
    with pytest.raises(UserError, match="JSON cannot be read"):
        editable_of(tmp_path / "broken.json")
    (tmp_path / "notes.txt").write_text("some notes\n")
    with pytest.raises(UserError, match="unknown format of measured material"):
        editable_of(tmp_path / "notes.txt")


class Unknown(Model):
    name, title, source, parameters = "unknown", "Unknown", "", ()

    def eval(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        return np.zeros(wi.shape)

    def pdf(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        return np.zeros(wi.shape[:-1])

    def sample(self, wo: np.ndarray, u: np.ndarray) -> np.ndarray:
        return wo


def test_a_model_without_curves_says_so() -> None:
    with pytest.raises(UserError, match="no curves to edit"):
        editable_of(Unknown())
