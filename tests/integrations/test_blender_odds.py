"""Things that exporters trip over, exported from Blender and read back."""

from __future__ import annotations

import re

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.scenes.loaders.load import load_scene

WILD = {"q\"uo\nte' [x]?", "#hash", "a" * 60}


@pytest.fixture(scope="module")
def odds(blender, tmp_path_factory):
    folder = tmp_path_factory.mktemp("odds")
    return blender("odds", folder), load_scene(folder / "odds.blend"), folder


def box_of(o):
    return np.array([o.mesh.positions.min(axis=0), o.mesh.positions.max(axis=0)])


def test_each_thing_is_there_once_where_blender_has_it(odds):
    truth, scene, _ = odds
    names = [o.name for o in scene.objects]
    assert set(names) == {
        *WILD, "text", "bent", "mirrored", "scatter", "scatter_2", "scatter_3", "scatter_4", "hidden in the viewport",
        "noisy", "glow", 'sh y "lamp"',
    }  # fmt: skip
    for name in ("mirrored", "hidden in the viewport", "noisy", *WILD):
        ((low, high),) = truth["boxes"][name]
        upright = np.sort([[x, z, -y] for x, y, z in (low, high)], axis=0)
        assert box_of(scene.object(name)) == pytest.approx(upright, abs=1e-5), name


def test_a_mirrored_object_is_not_inside_out(odds):
    mesh = odds[1].object("mirrored").mesh
    a, b, c = (mesh.positions[mesh.faces[:, i]] for i in range(3))
    assert (np.cross(b - a, c - a) * ((a + b + c) / 3 - mesh.positions.mean(axis=0))).sum(axis=1).min() > 0


def test_a_lamp_hidden_in_the_viewport_follows_its_parent(odds):
    face = odds[1].object('sh y "lamp"')
    assert box_of(face)[:, 1] == pytest.approx([9, 9]) and np.array(face.emission) == pytest.approx(40 / np.pi)


def test_photometry_inside_the_blend_stays_in_the_folder(odds):
    _, scene, folder = odds
    (luminaire,) = (light for light in scene.lights if light.name == "inside")
    assert luminaire.photometry.table.max() == 50 and not (folder / "out.ies").exists()
    assert (folder / "odds.lambent/luminaires/out.ies").is_file()


def test_wild_names_keep_their_settings_and_groups(odds):
    _, scene, _ = odds
    assert set(scene.light_fields) == {*WILD, "text"}
    (group,) = scene.light_groups
    assert group.name == "all that glows" and len(group.members) == 2
    assert scene.object("glow").emission == (7, 7, 7)


def test_lost_things_are_said(odds):
    said = "\n".join(odds[1].warnings)
    assert "volume objects are left out: smoke" in said
    assert "light thief: left out, it takes light away" in said and "light off: left out, it gives no light" in said
    assert "material noisy: the nodes of its colour are not carried" in said


@pytest.mark.parametrize(("content", "said"), [(b"hello", "File format is not supported"), (b"", "not supported")])
def test_a_file_that_is_no_blend_is_one_line(blender, tmp_path, content, said):
    (tmp_path / "no.blend").write_bytes(content)
    with pytest.raises(UserError, match=said) as caught:
        load_scene(tmp_path / "no.blend")
    assert "\n" not in str(caught.value)


@pytest.mark.long
def test_a_cut_blend_and_a_folder_of_the_users_own_are_one_line(odds, tmp_path):
    whole = odds[2] / "odds.blend"
    cut = tmp_path / "cut.blend"
    cut.write_bytes(whole.read_bytes()[:20_000])
    with pytest.raises(UserError, match=r"cut\.blend: .*(Missing|fail|truncat|Unable)"):
        load_scene(cut)
    own = tmp_path / "own.blend"
    own.write_bytes(whole.read_bytes())
    (tmp_path / "own.lambent").mkdir()
    (tmp_path / "own.lambent/scene.toml").write_text("mine")
    with pytest.raises(UserError, match=re.escape("is not an export of Blender: choose another folder, or move it")):
        load_scene(own)
    assert (tmp_path / "own.lambent/scene.toml").read_text() == "mine"
