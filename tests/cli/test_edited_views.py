"""Edited views from the command line: their bake, their stills, and the command that an error names."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import numpy as np

from lambent.core.pictures.images import read_image, write_image
from lambent.editing.session.document import Surroundings
from lambent.materials.models import model_named
from lambent.store.store import Store
from tests.cli.edited_floor import SIZE, saved, write_floor


def test_an_error_names_the_command_that_bakes_what_is_missing(lambent, refused, tmp_path):
    scene, store, picture = write_floor(tmp_path), tmp_path / "a store", tmp_path / "a.exr"

    def drawn_after(session: Path, fault: str) -> np.ndarray:
        error = refused("render", store, "--edit", session, "-o", picture)
        assert fault in error
        command = re.search("run `(.*)`", error)
        assert command is not None
        program, *arguments = shlex.split(command[1])
        assert program == "lambent"
        baked = lambent(*arguments)
        assert baked.code == 0, baked
        outcome = lambent("render", store, "--edit", session, "-o", picture, "--force", "--json")
        assert outcome.code == 0, outcome
        assert (outcome.json["width"], outcome.json["height"]) == SIZE
        return read_image(picture)[6:10, 8:16].mean(axis=(0, 1))

    assert lambent("bake", scene, "-o", store, "--only", "transport", "--view", "above:8x8").code == 0
    plain = drawn_after(saved(scene, "plain.json"), "no transport for camera above, 24 x 16")
    np.testing.assert_allclose(plain, [0.5, 0.5, 0.25], rtol=0.01)
    write_image(tmp_path / "sky.exr", np.full((8, 16, 3), 2.0, np.float32))
    sky = Surroundings(file=str(tmp_path / "sky.exr"), scale=3.0)
    lit = drawn_after(saved(scene, "sky.json", environment=sky), "another environment")
    np.testing.assert_allclose(lit, 6 * plain, rtol=0.01)
    other = model_named("oren-nayar")()
    changed = drawn_after(saved(scene, "other.json", environment=sky, start=other), "other terms")
    assert changed.min() > 0
    again = drawn_after(saved(scene, "plain.json"), "another environment")
    np.testing.assert_allclose(again, plain, rtol=1e-6)
    png = tmp_path / "a.png"
    for ev, options in ((1.0, ()), (1.0, ("--exposure", "1")), (-3.0, ("--exposure", "-3"))):
        command = ("render", store, "--edit", tmp_path / "plain.json", "-o", png, "--force", "--view", "linear")
        assert lambent(*command, *options).code == 0
        shown = read_image(png)[6:10, 8:16].mean(axis=(0, 1))
        np.testing.assert_allclose(shown, np.minimum(plain * 2**ev, 1), rtol=0.03)


BOUNCED = "--only", "interreflection", "--view", "above:12x8", "--series", "4,1", "--samples", "4"


def test_interreflections_are_proposed_and_baked_as_the_user_wants(lambent, tmp_path):
    scene = write_floor(tmp_path)
    asked = lambent("bake", scene, "--view", "above:12x8", "--series", "4,1", "--samples", "4", "--propose")
    assert asked.code == 0 and "paint " in asked.out and "on disk" in asked.out and not list(tmp_path.glob("*.store"))
    said = lambent("bake", scene, *BOUNCED[2:], "--propose", "--fixed", "paint", "--json").json["proposals"][0]
    assert said["bounces"] == {"series": [4, 1], "samples": 4, "fixed": ["paint"]} and said["seconds"] > 0
    store = tmp_path / "a.store"
    first = lambent("bake", scene, "-o", store, *BOUNCED, "--editable", "chrome")
    assert first.code == 0 and re.search("chrome +edited", first.err) and "samples/s" in first.err, first.err

    def edited() -> set[str]:
        found = (a for a in Store.open(store).artefacts("interreflection") if a.name.endswith("/tails"))
        return {name for a in found for name, _ in a.meta["tails"]["slots"]} - {""}

    chosen = edited()
    assert "chrome" in chosen
    more = lambent("bake", scene, "-o", store, *BOUNCED[:-1], "8")
    assert more.code == 0 and edited() == chosen and "that the store has: chrome" in more.err, more.err
    assert lambent("bake", scene, "-o", store, *BOUNCED, "--fixed", "chrome").code == 0 and edited() == {"paint"}
