"""EXT_lights_ies: where profiles come from, how nodes turn, tint and scale them, and what cannot be used."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.core.light.photometry import photometric
from lambent.scenes.scene import IesLight, PointLight, Scene
from tests.scenes.loaders.gltf.test_gltf import document, loaded
from tests.scenes.photometry.written_files import ies

UNEVEN = ies("0 45 90", "0 90 180 270 360", "100 80 0 100 60 0 100 40 0 100 20 0 100 80 0")
DATA = "data:application/x-ies-lm-63;base64," + base64.b64encode(UNEVEN.encode()).decode()


def lit(folder: Path, profiles: list[dict[str, Any]], *nodes: dict[str, Any], **more: Any) -> Scene:
    """One triangle, and nodes with luminaires."""
    listed = [{"mesh": 0}, *nodes]
    content = document(nodes=listed, scenes=[{"nodes": list(range(len(listed)))}], **more)
    content["extensions"] = {"EXT_lights_ies": {"lights": profiles}, **content.get("extensions", {})}
    return loaded(folder, content)


def node(light: int = 0, **more: Any) -> dict[str, Any]:
    place = {name: more.pop(name) for name in ("translation", "rotation", "scale") if name in more}
    return {**place, "extensions": {"EXT_lights_ies": {"light": light, **more}}}


def candela(light: IesLight, towards: tuple[float, float, float]) -> float:
    x, y, z = light.axes @ towards / np.linalg.norm(towards)
    cd = light.photometry.at(np.degrees(np.arccos(z)), np.degrees(np.arctan2(y, x)))
    return float(cd) * float(photometric(np.array(light.scale)))


def test_an_untransformed_luminaire_points_down_minus_z_with_its_angle_0_to_x(tmp_path: Path) -> None:
    (light,) = lit(tmp_path, [{"uri": DATA}], node(translation=[1, 2, 3], scale=[2, 2, 2])).lights
    assert isinstance(light, IesLight) and light.position == (1, 2, 3)
    seen = [candela(light, w) for w in ((0, 0, -1), (1, 0, -1), (0, 1, -1), (-1, 0, -1), (0, -1, -1), (0, 0, 1))]
    assert seen == pytest.approx([100, 80, 60, 40, 20, 0], abs=1e-3)


def test_nodes_turn_tint_and_scale_it(tmp_path: Path) -> None:
    half = np.sqrt(0.5)
    down, spun = [-half, 0, 0, half], [0, 0, half, half]  # -z to -y; x to y about z
    first, second = lit(
        tmp_path, [{"uri": DATA}], node(rotation=down), node(rotation=spun, multiplier=3.0, color=[1.0, 0.5, 7.0])
    ).lights  # fmt: skip
    assert isinstance(first, IesLight) and isinstance(second, IesLight)
    seen = [candela(first, w) for w in ((0, -1, 0), (1, -1, 0), (0, -1, -1), (-1, -1, 0), (0, -1, 1))]
    assert seen == pytest.approx([100, 80, 60, 40, 20], abs=1e-3)
    white = np.array(first.scale)
    assert second.scale == pytest.approx(3 * white * (1, 0.5, 1)), "colours are clamped to 1"
    plain = IesLight(second.position, second.photometry, first.scale, second.aim, second.rotation_deg)
    assert [candela(plain, w) for w in ((0, 1, -1), (-1, 0, -1))] == pytest.approx([80, 60], abs=1e-3)


def test_profiles_come_from_files_and_buffers_too(tmp_path: Path) -> None:
    (tmp_path / "Lamp.ies").write_text(UNEVEN)
    views, buffers = document()["bufferViews"], document()["buffers"]
    profiles = [{"uri": "lamp.ies"}, {"bufferView": 4, "mimeType": "application/x-ies-lm-63"}]
    scene = lit(
        tmp_path, profiles, node(), node(1),
        bufferViews=[*views, {"buffer": 1, "byteLength": len(UNEVEN)}],
        buffers=[*buffers, {"byteLength": len(UNEVEN), "uri": DATA}], extensionsRequired=["EXT_lights_ies"],
    )  # fmt: skip
    one, other = scene.lights
    assert isinstance(one, IesLight) and isinstance(other, IesLight) and one.photometry == other.photometry
    assert any(source.name == "Lamp.ies" for source in scene.sources)


def test_a_light_for_other_programs_beside_it_is_not_added(tmp_path: Path) -> None:
    both = node()
    both["extensions"]["KHR_lights_punctual"] = {"light": 0}
    more = {"extensions": {"KHR_lights_punctual": {"lights": [{"type": "point"}]}}}
    assert [type(one) for one in lit(tmp_path, [{"uri": DATA}], both, **more).lights] == [IesLight]
    plain = {"extensions": {"KHR_lights_punctual": {"light": 0}}}
    assert [type(one) for one in lit(tmp_path, [{"uri": DATA}], plain, **more).lights] == [PointLight]


@pytest.mark.parametrize(
    ("profile", "told"),
    [
        ({"uri": "gone.ies", "name": "spot"}, "spot: luminaire left out, gone.ies is missing"),
        ({"uri": "data:;base64,AAAA"}, "EXT_lights_ies.lights.0: luminaire left out, is not an IES or EULUMDAT file"),
        ({"uri": "data:;base64,!"}, "base64 data is damaged"),
        ({"uri": "http://lamps.example/a.ies"}, "is on the network"),
        ({"uri": "../../a.ies"}, "path leaves its folder"),
        ({}, "neither a uri nor a buffer view"),
        ({"bufferView": 0}, "is not an IES or EULUMDAT file"),
        ({"bufferView": 99}, "index out of range"),
        ({"uri": "data:;base64," + base64.b64encode(ies(kind=4).encode()).decode()}, "photometric type: is unknown"),
    ],
)
def test_a_profile_that_cannot_be_used_leaves_its_luminaire_out(
    tmp_path: Path, profile: dict[str, Any], told: str
) -> None:
    scene = lit(tmp_path, [profile], node(), node())
    assert not any(isinstance(one, IesLight) for one in scene.lights)
    assert sum(told in warning for warning in scene.warnings) == 1, scene.warnings
