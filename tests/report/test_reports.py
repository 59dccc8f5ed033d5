"""Reports of all kinds of fits are complete and honest: one page that needs nothing but itself."""

from __future__ import annotations

import functools
import io
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from PIL import Image

from lambent.baking import engine as engine_module
from lambent.baking.reference import material_preview
from lambent.core.errors import UserError
from lambent.core.progress import Cancelled
from lambent.materials.document import Lobe, Material
from lambent.materials.fitting.account import evaluate, peak_share
from lambent.materials.fitting.fit import fit
from lambent.materials.fitting.shown.slices import slices
from lambent.materials.measured.inspecting.synthetic import ANISOTROPIC, ISOTROPIC, synthesise
from lambent.materials.measured.tables.half_vector_grid import GridShape
from lambent.report import fit_report, page
from lambent.report.fit_report import report

HOSTILE = "<script>alert('x')</script> & \"quoted\" --><b>"
VOID = {"meta", "img", "br"}


class Reader(HTMLParser):
    """Collects tags and attributes; fails where nesting is broken."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text: list[str] = []
        self._open: list[str] = []
        self.feed(text)
        self.close()
        assert not self._open

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self._open.append(tag)

    def handle_endtag(self, tag):
        assert self._open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)


def check(text: str) -> Reader:
    """What every page of ours has to be."""
    read = Reader(text)
    names = [tag for tag, _ in read.tags]
    assert not {"script", "link", "iframe", "object", "form", "base"} & set(names)
    assert "@import" not in text and "url(" not in text
    for tag, attributes in read.tags:
        assert not [name for name in attributes if name.startswith("on")]
        if tag == "img":
            assert attributes["src"].startswith("data:image/png;base64,")
            assert attributes["alt"] and int(attributes["width"]) > 0 and int(attributes["height"]) > 0
        elif tag == "th":
            assert attributes["scope"] in ("row", "col")
        assert "href" not in attributes
    assert names.count("h1") <= 1 and "title" in names and ("html", {"lang": "en"}) in read.tags
    return read


def png() -> bytes:
    stream = io.BytesIO()
    Image.fromarray(np.zeros((30, 60, 3), np.uint8)).save(stream, format="PNG")
    return stream.getvalue()


def test_nothing_a_user_wrote_becomes_markup():
    body = [
        page.heading(HOSTILE, 1),
        page.paragraph(HOSTILE, "soft"),
        page.note(HOSTILE, [HOSTILE]),
        page.facts([(HOSTILE, HOSTILE)]),
        page.table((HOSTILE, HOSTILE), [(HOSTILE, HOSTILE)], caption=HOSTILE, numbers=(1,), chosen=0),
        page.row([page.picture(png(), HOSTILE, HOSTILE)]),
        page.bullets([HOSTILE]),
        page.footer(HOSTILE),
    ]
    read = check(page.page(HOSTILE, body))
    assert sum(HOSTILE in text for text in read.text) >= 12


@pytest.mark.parametrize(("density", "size"), [({}, ("60", "30")), ({"density": 1.5}, ("40", "20"))])
def test_pictures_have_their_size(density, size):
    (image,) = [attributes for tag, attributes in Reader(page.picture(png(), "x", **density)).tags if tag == "img"]
    assert (image["width"], image["height"]) == size


FEW = {"step_deg": 9.0, "fine_deg": 4.5, "fine_reach_deg": 9.0}
PAINT = Material(name="<paint>", kd=(0.3, 0.2, 0.1), lobes=(Lobe(k=0.7, mx=0.15, my=0.15, r0=0.06, alpha=0.3),))
SHEET = Material(
    name="sheet",
    kd=0.3,
    kt_d=0.1,
    lobes=(Lobe(k=0.7, mx=0.1, my=0.25, r0=0.1), Lobe(side="transmission", k=0.5, mx=0.1, my=0.25, r0=0.0)),
)


@pytest.fixture(autouse=True)
def _coarse(monkeypatch):
    monkeypatch.setattr(fit_report, "DPI", 40)
    monkeypatch.setattr(fit_report, "slices", functools.partial(slices, steps=5))


@pytest.fixture
def no_engine(monkeypatch):
    def fails():
        raise UserError("no path tracing engine works here (llvm: too old)", hint="install LLVM")

    monkeypatch.setattr(engine_module, "engine", fails)


@pytest.fixture
def small_previews(mi, monkeypatch):
    small = GridShape(12, 1, 32, 16)
    monkeypatch.setattr(material_preview, "GRIDS", {True: small, False: replace(small, viewer_phi=8)})
    monkeypatch.setattr(material_preview, "preview", functools.partial(material_preview.preview, size_px=48, spp=4))


def made(material, setup, **options):
    table = synthesise(material, setup)
    samples = table.samples()
    return table, samples, fit(samples, whole=table, **options)


@pytest.mark.long
def test_without_an_engine_the_report_says_so(no_engine, tmp_path):
    table, samples, result = made(PAINT, replace(ISOTROPIC, **FEW))
    source = tmp_path / "measured.txt"
    source.write_text("what was measured")
    read = check(report(table, samples, result, source=source))
    text = " ".join(read.text)
    assert "No previews" in text and "too old" in text and "transmission" not in text
    total, lobe = len(samples) + samples.left_out.total, result.material.lobes[0]
    shares = {name: result.errors[name] / result.lambertian_errors[name] for name in result.errors}
    tilt = np.degrees(np.arctan(lobe.mx))
    for expected in (
        f"{len(samples):,} of {total:,} ({100 * len(samples) / total:.1f} %)",
        f"{samples.left_out.grazing:,}",
        f"metric is {shares['cuberoot']:.2f} of the best Lambertian surface's",
        *(f"{share:.3f}" for share in shares.values()),
        f"lobe 1: {tilt:.1f}° x {tilt:.1f}°",
        "<paint>",
        f"{len(samples):,} of",
        "grazing",
        "SHA-256",
        f"{result.material.lobes[0].mx:.4f}",
        f"{result.errors['log']:.4g}",
        f"{result.lambertian_errors['l1']:.4g}",
        f"{peak_share(samples, evaluate(result.material, samples)):.2f} of the measured peak",
        "undershoot peaks",
        "Albedo in reflection at worst",
        f"{result.albedos[0].fit[0].mean():.3f}",
    ):
        assert expected in text, expected
    assert [attributes.get("class") for tag, attributes in read.tags if tag == "tr"].count("chosen") == 1
    assert sum(tag == "img" for tag, _ in read.tags) == 4


@pytest.mark.long
def test_an_l2_fit_is_said_to_be_poor_to_the_eye(no_engine):
    table, samples, result = made(PAINT, replace(ISOTROPIC, **FEW), metric="l2_ngan")
    text = " ".join(check(report(table, samples, result)).text)
    assert "often poor by perceptual metrics" in text
    ratio = result.errors["cuberoot"] / result.lambertian_errors["cuberoot"]
    assert f"{ratio:.2f} under cuberoot" in text


@pytest.mark.long
def test_transmitting_anisotropic_grey_and_partial(small_previews):
    """All at once: a brushed sheet in grey, whose fit was stopped after its reflection."""
    setup = replace(ANISOTROPIC, theta_i_deg=(5, 35, 65), phi_i_deg=(0, 45, 90), **FEW)
    table = synthesise(SHEET, setup)
    samples = table.samples()
    grey = replace(samples, f=samples.f[:, :1], info=replace(samples.info, channels=1))

    def stop(done, total, what):
        if what.startswith("transmission"):
            raise Cancelled

    result = fit(grey, progress=stop)
    assert result.partial
    read = check(report(table, grey, result))
    text = " ".join(read.text)
    for expected in ("cancelled", "1, grey", "a lamp behind", "brushed along", "PSNR", "reflection and transmission"):
        assert expected in text, expected
    assert sum(tag == "img" for tag, _ in read.tags) >= 3 + 3 + 1


@pytest.mark.long
def test_readings_below_zero_are_counted_as_kept(no_engine):
    dark = Material(name="dark", kd=(0.3, 0.2, 0.0), lobes=PAINT.lobes)
    made_of = made(dark, replace(ISOTROPIC, **FEW, floor=0.02))
    html = report(*made_of)
    count = made_of[1].below_zero
    assert count > 0 and f"{count} of {len(made_of[1])} tuples" in html and "The fit keeps them" in html
