"""`lambent bake --light-fields`: what is asked, and the table of what was made."""

from __future__ import annotations

from pathlib import Path


def test_a_name_that_fits_nothing_is_one_line(lambent, tmp_path: Path):
    outcome = lambent("bake", "builtin:box", "-o", tmp_path / "s", "--light-fields", "sphre")
    assert outcome.code == 2
    assert "--light-fields: matches no object; found sphre" in outcome.err and "did you mean 'sphere'?" in outcome.err
    assert not (tmp_path / "s").exists(), "nothing is begun"


def test_the_table_says_object_points_memory_seconds_and_errors():
    from lambent.cli.bake import _light_fields_in_words

    chosen = {"object": "bowl", "points": 64, "megabytes": 1.96, "seconds": 3.21, "probe_error": 0.388, "error": 0.114}
    asked = {"object": "teapot", "points": 9, "megabytes": 0.1, "seconds": 0.2}
    head, first, second = _light_fields_in_words([chosen, asked]).splitlines()
    assert " ".join(head.split()) == "light field of points MB seconds error with probe with light field"
    assert first.split() == ["bowl", "64", "2.0", "3.2", "0.388", "0.114"] and second.split()[:2] == ["teapot", "9"]
