"""Where photometry comes from: recognised by content, in scene.toml and glTF, with a tilt file beside it."""

from __future__ import annotations

import base64
from pathlib import Path

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.light.photometry import photometric
from lambent.scenes.loaders.load import load_scene
from lambent.scenes.photometry.files import is_luminaire, read_luminaire
from lambent.scenes.scene import IesLight
from tests.scenes.loaders.gltf.test_gltf_luminaires import lit, node
from tests.scenes.loaders.test_toml import MATERIALS, written
from tests.scenes.photometry.written_files import ies, ldt, ldt_of, lobe

LAMP = '[[lights]]\nkind = "ies"\nposition = [0.0, 2.0, 0.0]\n'
TWO_SETS = ldt([(200, 0)], sets=((1, 500), (2, 1200)))


def lights_of(folder: Path, *sections: str) -> list[IesLight]:
    scene = load_scene(written(folder, MATERIALS + "".join(LAMP + section + "\n" for section in sections)))
    assert all(isinstance(one, IesLight) for one in scene.lights)
    assert all(any(source.name == name for source in scene.sources) for name in _files_in(sections))
    return list(scene.lights)  # type: ignore[arg-type]


def _files_in(sections: tuple[str, ...]) -> set[str]:
    return {section.split('"')[1] for section in sections}


def peak_cd(light: IesLight) -> float:
    return float(np.max(light.photometry.candela) * photometric(np.array(light.scale)))


def test_content_decides_and_not_the_name(tmp_path: Path) -> None:
    (tmp_path / "a.ies").write_text(TWO_SETS)
    (tmp_path / "b.ldt").write_text(ies())
    (tmp_path / "c.txt").write_text(TWO_SETS.replace("\n", "\r\n"))
    assert [read_luminaire(tmp_path / name).format for name in ("a.ies", "b.ldt", "c.txt")] == [
        "EULUMDAT", "IESNA:LM-63-2002, type C", "EULUMDAT",
    ]  # fmt: skip
    for name, content in (("a", TWO_SETS.encode()), ("b", ies().encode()), ("c.ldt", b""), ("d.IES", b"")):
        assert is_luminaire(Path(name), content), name
    columns = "".join(f"{k} {k * k} 0.1\n" for k in range(60)).encode()
    whole = "".join(f"{k}\n" for k in range(60)).encode()
    assert not any(is_luminaire(Path("a.txt"), content) for content in (b"", columns, whole, b"\x00" * 999))


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.gldf", b"PK\x03\x04" + b"\x00" * 100),
        ("a.xml", b'\xef\xbb\xbf<?xml version="1.0"?>\n<IESTM33-22 xmlns="iesna"/>'),
        ("a", b"<IESTM33-18></IESTM33-18>"),
    ],
)
def test_other_formats_are_refused_with_what_to_ask_for(tmp_path: Path, name: str, content: bytes) -> None:
    (tmp_path / name).write_bytes(content)
    assert is_luminaire(tmp_path / name, content)
    with pytest.raises(UserError, match=r"GLDF and IES TM-33 are not read; ask its maker for an \.ies or \.ldt file"):
        read_luminaire(tmp_path / name)


def test_lamp_sets_and_flux_in_a_scene(tmp_path: Path) -> None:
    (tmp_path / "lamp.ldt").write_text(TWO_SETS)
    (tmp_path / "open.ldt").write_text(ldt([(200, 0)], sets=((1, 0),)))
    file = 'file = "lamp.ldt"\n'
    unrated = 'file = "open.ldt"\n'
    made = lights_of(tmp_path, file, file + "lamp_set = 1", file + "lumens = 100.0", unrated + "lumens = 100.0")
    flux_per_cd = made[0].photometry.lumens / np.max(made[0].photometry.candela)
    assert [peak_cd(one) for one in made] == pytest.approx([100, 240, 100 / flux_per_cd, 100 / flux_per_cd])
    for section, word in (
        (file + "lamp_set = 2", "lamp_set: has no such lamp set; found 2; expected 0 to 1"),
        (file + "lamp_set = -1", "found -1"),
        (unrated, "lamp_set: has no luminous flux; found 0; write it into the file, or give the light's lumens"),
    ):
        with pytest.raises(UserError, match=word):
            lights_of(tmp_path, section)


def test_the_same_luminaire_in_both_formats_lights_alike(tmp_path: Path) -> None:
    """C0 is horizontal angle 0: of an uneven distribution, not only of the flux."""
    c, gamma = range(0, 360, 30), range(0, 91, 10)

    def uneven(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        return 500 + 300 * x - 100 * y + 50 * z

    h, v = np.meshgrid(np.radians([*c, 360]), np.radians(gamma), indexing="ij")
    candela = uneven(np.sin(v) * np.cos(h), np.sin(v) * np.sin(h), np.cos(v))
    words = [" ".join(map(str, angles)) for angles in (gamma, [*c, 360])]
    (tmp_path / "a.ies").write_text(ies(*words, "\n".join(" ".join(map(str, row)) for row in candela)))
    (tmp_path / "a.ldt").write_text(ldt_of(uneven, c, gamma))
    one, other = lights_of(tmp_path, 'file = "a.ies"', 'file = "a.ldt"')
    np.testing.assert_allclose(one.photometry.candela, other.photometry.candela, rtol=1e-9)
    assert one.photometry.lumens == pytest.approx(other.photometry.lumens)


def test_gltf_may_embed_either(tmp_path: Path) -> None:
    profiles = [
        {"uri": "data:;base64," + base64.b64encode(text.encode()).decode()}
        for text in (TWO_SETS, ldt_of(lobe(1), [0], [0, 45, 90], 1), ldt([(1, 0)], sets=((1, 0),)))
    ]
    scene = lit(tmp_path, profiles, node(), node(1), node(2))
    assert [peak_cd(one) for one in scene.lights if isinstance(one, IesLight)] == pytest.approx([100, 1000])
    assert any("luminaire left out, lamp_set: has no luminous flux" in one for one in scene.warnings)


def test_a_tilt_file_beside_it(tmp_path: Path) -> None:
    """Factors as with TILT=INCLUDE; a scene watches that file too, and its name may be spelt differently."""
    (tmp_path / "lamps").mkdir()
    (tmp_path / "lamps" / "LAMP.TLT").write_text("1\n3\n0 45 90\n1 .9 .8\n")
    (tmp_path / "lamps" / "a.ies").write_text(ies(tilt="TILT=lamp.tlt"))
    alone = read_luminaire(tmp_path / "lamps" / "a.ies").photometry()
    assert [alone.tilted(deg) for deg in (0.0, 45.0, 90.0)] == pytest.approx([1, 0.9, 0.8])
    assert alone.at(np.array(0.0), np.array(0.0)) == 1000
    path = written(tmp_path, MATERIALS + LAMP + 'file = "lamps/a.ies"\ndirection = [1.0, 0.0, 0.0]\n')
    scene = load_scene(path)
    assert tmp_path / "lamps" / "LAMP.TLT" in scene.sources
    (light,) = scene.lights
    assert isinstance(light, IesLight) and peak_cd(light) == pytest.approx(800, rel=1e-5)
    (tmp_path / "lamps" / "LAMP.TLT").write_text("1\n3\n0 45\n")
    with pytest.raises(UserError, match="tilt angles: file is truncated"):
        load_scene(path)
