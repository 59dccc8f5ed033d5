"""`lambent bake --light-fields`: what is asked, and the table of what was made."""

from __future__ import annotations

from pathlib import Path


def test_a_name_that_fits_nothing_is_one_line(lambent, tmp_path: Path):
    outcome = lambent("bake", "builtin:box", "-o", tmp_path / "s", "--light-fields", "sphre")
    assert outcome.code == 2
    assert "--light-fields: matches no object; found sphre" in outcome.err and "did you mean 'sphere'?" in outcome.err
    assert not (tmp_path / "s").exists(), "nothing is begun"
