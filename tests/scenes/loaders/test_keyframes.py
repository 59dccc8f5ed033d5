"""Keyframes of films: what files say, and the states between keys."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.light.light_mix import GroupMix, LightMix
from lambent.core.pictures.images import write_shown
from lambent.materials.between import between
from lambent.materials.document import Lobe, Material
from lambent.scenes.loaders.keyframes import Keyframes, Known, read_keyframes
from lambent.scenes.looks.look_track import LookTrack
from lambent.scenes.scene import ImageTexture, Look, Variant

WALL, OAK = Material(name="wall", kd=0.8), Material(name="oak", kd=(0.4, 0.3, 0.2))
LOOKS = {"wall": Look(WALL), "oak": Look(OAK, "oak")}
BLUE = Look(WALL.model_copy(update={"kd": (0.0, 0.0, 0.4)}))
VARIANTS = (Variant("blue", {"wall": BLUE}, LightMix({"sun": GroupMix(on=False)})),)
KNOWN = Known(LOOKS, VARIANTS, {"dusk": LightMix({"sky": GroupMix(intensity=0.5)})})
HEAD = 'format = "lambent-keyframes"\nversion = 1\n'


def read(folder: Path, text: str) -> Keyframes:
    (folder / "k.toml").write_text(HEAD + text)
    return read_keyframes(folder / "k.toml", KNOWN)


def test_colours_and_light_change_evenly_between_keys(tmp_path: Path) -> None:
    found = read(tmp_path, """
[[keys]]
at = 1
materials.wall.kd = [0.8, 0.8, 0.8]
light.lamp = "off"
[[keys]]
at = 2.0
materials.oak.use = "wall"
[[keys]]
at = 5.0
materials.wall.kd = [0.0, 0.4, 0.8]
light = { lamp = 2, sky = "2700K" }
""")  # fmt: skip
    assert found.looks.looks_at(0.0)["wall"].material.kd == (0.8, 0.8, 0.8)
    assert found.looks.looks_at(3.0)["wall"].material.kd == pytest.approx((0.4, 0.6, 0.8))
    assert found.looks.looks_at(9.0)["wall"].material.kd == (0.0, 0.4, 0.8)
    assert found.looks.looks_at(0.0)["oak"] == LOOKS["wall"], "one key holds at all times"
    assert "lamp" not in found.light.factors_at(3.0), "as baked at this moment"
    assert found.light.factors_at(2.0)["lamp"] == pytest.approx((0.5, 0.5, 0.5))
    assert found.light.factors_at(0.0)["sky"] == found.light.factors_at(9.0)["sky"]


def test_variants_views_and_the_baked_state_are_whole_states(tmp_path: Path) -> None:
    found = read(tmp_path, """
[[keys]]
at = 0
as_baked = true
[[keys]]
at = 2
variant = "blue"
[[keys]]
at = 4
view = "dusk"
""")  # fmt: skip
    assert found.looks.looks_at(0.0)["wall"] == LOOKS["wall"] and not found.light.factors_at(0.0)
    assert found.looks.looks_at(1.0)["wall"].material.kd == pytest.approx((0.4, 0.4, 0.6))
    assert found.light.factors_at(1.0)["sun"] == pytest.approx((0.5, 0.5, 0.5))
    assert found.looks.looks_at(4.0)["wall"] == BLUE, "a view has no materials"
    assert found.light.factors_at(4.0) == {"sky": pytest.approx((0.5, 0.5, 0.5))}
    assert found.light.factors_at(3.0)["sky"] == pytest.approx((0.75, 0.75, 0.75))


WRONG = {
    "": r"keys: is missing",
    "[[keys]]\nat = 1\n[[keys]]\nat = 1": r"keys.at: times do not increase; found 1, 1",
    "[[keys]]\nat = -1": r"keys.0.at.*greater than or equal to 0",
    "[[keys]]\nat = 0\nmaterials.wal.kd = 1": r"keys.0.materials.wal: unknown material; found wal; did you mean 'wall'",
    "[[keys]]\nat = 0\nmaterials.wall.colour = 'red'": r"keys.0.materials.wall.colour: not a colour; found red",
    "[[keys]]\nat = 0\nvariant = 'blu'": r"keys.0.variant: unknown variant; found blu; .*did you mean 'blue'",
    "[[keys]]\nat = 0\nvariant = 'blue'\nas_baked = true": r"keys.0: sets both as_baked and a variant",
    "[[keys]]\nat = 0\nview = 'dsk'": r"keys.0.view: unknown saved view; found dsk; .*did you mean 'dusk'",
    "[[keys]]\nat = 0\nlights.sun = 1": r"keys.0.lights: unknown key; did you mean 'light'",
    "= 3": r"not a TOML document",
}


@pytest.mark.parametrize("text", WRONG)
def test_what_is_wrong_is_one_line_that_names_file_and_field(tmp_path: Path, text: str) -> None:
    with pytest.raises(UserError, match=rf"k.toml: .*{WRONG[text]}") as caught:
        read(tmp_path, text)
    assert "\n" not in str(caught.value)


def test_without_saved_mixes_a_view_is_refused(tmp_path: Path) -> None:
    (tmp_path / "k.toml").write_text(f'{HEAD}[[keys]]\nat = 0\nview = "dusk"\n')
    with pytest.raises(UserError, match=r"keys.0.view: no saved view has a light mix"):
        read_keyframes(tmp_path / "k.toml", Known(LOOKS))


def test_lobes_change_evenly_where_they_are_alike_and_else_stay_until_the_next() -> None:
    rough = Material(kd=0.0, lobes=(Lobe(mx=0.1, my=0.3, r0=0.2),))
    shiny = Material(kd=0.2, lobes=(Lobe(mx=0.2, my=0.1, r0=0.6, k=0.5),))
    (middle,) = between(rough, shiny, 0.5).lobes
    assert (middle.mx, middle.my) == pytest.approx((0.15, 0.2))
    assert (middle.r0[0], middle.k[0]) == pytest.approx((0.4, 0.75))
    assert between(rough, WALL, 0.25).lobes == rough.lobes and between(rough, WALL, 0.25).kd[0] == pytest.approx(0.2)
    assert between(rough, WALL, 0.0) is rough and between(rough, WALL, 1.0) is WALL


def test_textures_are_those_of_the_earlier_key() -> None:
    track = LookTrack({"oak": ((0.0, LOOKS["oak"]), (2.0, LOOKS["wall"]))})
    assert track.looks_at(1.9)["oak"].textures == "oak" and track.looks_at(2.0)["oak"].textures == ""
    with pytest.raises(UserError, match="times do not increase"):
        LookTrack({"oak": ((1.0, BLUE), (1.0, BLUE))})


def test_a_key_shows_a_texture(tmp_path: Path) -> None:
    """Colours change evenly towards the mean of the texture, which follows at the time of its key."""
    write_shown(tmp_path / "a.png", np.full((2, 2, 3), 255, np.uint8))
    given = Known(LOOKS, VARIANTS, coloured={"oak": True})
    (tmp_path / "k.toml").write_text(HEAD + """
[[keys]]
at = 0
as_baked = true
[[keys]]
at = 2
materials.wall.texture = "oak"
materials.oak.texture = "a.png,2"
[[keys]]
at = 4
materials.oak.texture = "none"
""")  # fmt: skip
    looks = read_keyframes(tmp_path / "k.toml", given).looks
    assert looks.looks_at(1.0)["wall"].material.kd == pytest.approx((0.6, 0.55, 0.5))
    assert looks.looks_at(1.0)["wall"].textures == "" and looks.looks_at(1.0)["oak"].textures == "oak"
    assert looks.looks_at(2.0)["wall"].textures == "oak" and looks.looks_at(2.0)["wall"].material.kd == OAK.kd
    assert looks.looks_at(3.0)["oak"].textures == ImageTexture(str((tmp_path / "a.png").resolve()), 2.0)
    assert looks.looks_at(4.0)["oak"] == Look(OAK)


def test_a_wrong_texture_of_a_key_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"k.toml: keys.0.materials.wall.texture: is neither a material.*b.png"):
        read(tmp_path, '[[keys]]\nat = 0\nmaterials.wall.texture = "b.png"')
