"""The CIE observer and D65 against an independent library, and known integrals."""

import numpy as np
import pytest

from lambent.core.light.observer import observer


def test_the_observer_is_that_of_another_library():
    colour = pytest.importorskip("colour")
    cmfs, d65 = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"], colour.SDS_ILLUMINANTS["D65"]
    ours = observer()
    assert np.array_equal(ours.wavelengths_nm, cmfs.wavelengths) and np.allclose(ours.matching, cmfs.values, rtol=1e-8)
    until_780 = ours.wavelengths_nm <= 780
    expected = np.interp(ours.wavelengths_nm[until_780], d65.wavelengths, d65.values)
    assert np.allclose(ours.d65[until_780], expected, rtol=1e-6)


def test_white_under_d65_has_the_chromaticity_of_rec709():
    xyz = observer().d65 @ observer().matching
    assert np.allclose(xyz[:2] / xyz.sum(), (0.3127, 0.3290), atol=1e-4)
    assert observer().matching[:, 1].sum() == pytest.approx(106.857, abs=1e-3)
