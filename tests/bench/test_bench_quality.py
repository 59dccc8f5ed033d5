"""The order of the integrators, and the form of the benches' JSON."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lambent.bench.pictures import quality, walk_cube
from lambent.bench.registry import run_bench
from lambent.bench.scenes.quality_inputs import MATERIALS, read_inputs
from lambent.core.errors import UserError
from lambent.core.pictures.images import write_image
from lambent.materials.document import Lobe, Material
from lambent.realtime.frame_state import FrameState
from lambent.realtime.objects.unbaked import CAMERA, unbaked_scene
from lambent.realtime.renderer import Renderer
from lambent.scenes.geometry import sphere
from lambent.scenes.sky.environments import dusk, studio

pytestmark = pytest.mark.usefixtures("adapter")


def check_form(report: dict) -> None:
    assert set(report) == {"bench", "machine", "inputs", "rows", "summary"}
    assert set(report["machine"]) == {"cpu", "cores", "adapter", "adapter_type", "driver", "variant"}
    assert report["rows"]
    assert len({frozenset(row) for row in report["rows"]}) == 1
    json.dumps(report, allow_nan=False)


@pytest.mark.long
def test_rings_stand_above_the_published_estimates(tmp_path: Path) -> None:
    """At n = 7: 3 dB above fis and 4 dB above lobe-4.25 in the mean, as the spec's experiment has it."""
    picture = np.full((16, 32, 3), 0.1, np.float32)
    picture[4:7, 10:14] = 20.0
    write_image(tmp_path / "lamp.hdr", picture)
    effort = replace(quality.QUICK, qmc_spp=1024, ns=(7,), materials=MATERIALS[::2], environments={"studio": studio})
    report = run_bench("quality", effort, inputs=[tmp_path / "lamp.hdr"])
    check_form(report)
    assert len(report["rows"]) == 2 * 5 * 6
    assert report["inputs"][0]["path"] == "lamp.hdr"
    above = report["summary"]["rings_above"]
    assert above["fis"]["7"] > 3
    assert above["lobe-4.25"]["7"] > 4
    assert above["lobe-4.24"]["7"] > 4
    assert above["lamps"]["7"] < -4  # both environments have lamps
    assert all(0 < row["flip_qmc"] < row["flip_qmc_worst_tile"] < 1 for row in report["rows"])


@pytest.mark.long
def test_the_callers_materials_stand_beside_ours(tmp_path: Path) -> None:
    """A document and a measured table are told from environments by their content, and only their lobes are shown."""
    lobe = Lobe(mx=0.2, my=0.2, r0=0.7)
    through = Lobe(mx=0.1, my=0.1, side="transmission")
    Material(name="any", kd=(0.5, 0.5, 0.5), lobes=(lobe, through)).save(tmp_path / "mine.json")
    Material(name="any", kd=(0.5, 0.5, 0.5)).save(tmp_path / "chalk.json")
    environments, materials = read_inputs([tmp_path / "mine.json"])
    assert (environments, [m.name for m in materials]) == ({}, ["mine"])
    assert materials[0].lobes == (lobe,)
    assert not any(materials[0].kd)
    with pytest.raises(UserError, match="specularly"):
        read_inputs([tmp_path / "chalk.json"])
    effort = replace(quality.QUICK, qmc_spp=256, ns=(7,), materials=MATERIALS[3:4], environments={"dusk": dusk})
    report = quality.run(effort, [tmp_path / "mine.json"])
    assert {row["material"] for row in report["rows"]} == {"matte .15", "mine"}


@pytest.mark.long
def test_the_path_tracer_sees_the_same_image() -> None:
    """A lone sphere has nothing to reflect but the environment: qmc and path tracing agree, the right way round."""
    from lambent.bench.scenes.specular_scene import path_traced
    from lambent.realtime.gpu.device import open_device

    material = MATERIALS[8]  # anisotropic: the brushing direction counts
    meshes = {"sphere": sphere(1.0)}
    truth = path_traced(meshes, material, dusk(64), CAMERA, 48, 256)
    renderer = Renderer(open_device(), unbaked_scene(meshes, material, dusk(64)))
    image = renderer.converged(FrameState(CAMERA, 48, 48, lookup="plain"), 1024)
    assert np.abs(image - truth).mean() < 0.02 * truth.mean()
    assert np.abs(image - truth).mean() < 0.1 * np.abs(image[:, ::-1] - truth).mean()


@pytest.mark.long
def test_frame_times_come_with_their_spread() -> None:
    report = run_bench("walk-cube", walk_cube.Effort(40, 25, ns=(3, 7), rounds=2))
    check_form(report)
    assert len(report["rows"]) == 2 * (2 + 3 * 2)
    for row in report["rows"]:
        assert row["wall_ms_spread"][0] <= row["wall_ms"] <= row["wall_ms_spread"][1]
