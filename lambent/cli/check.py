"""`lambent check`: is a material physical, and does its sampler draw what its density says."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from lambent.cli.console import Json, progress_bar, show, table

if TYPE_CHECKING:
    from lambent.materials.check import CheckReport


def command(
    material: Annotated[Path, typer.Argument(help="Material document (.json).")],
    seed: Annotated[int, typer.Option(min=0, help="The same seed gives the same report.")] = 0,
    json: Json = False,
) -> None:
    """Check reciprocity, energy, and the sampler by chi-square and hemisphere integrals.

    The exit code is 1 when the material fails.

    Example: lambent check brushed.json
    """
    from lambent.materials.check import check
    from lambent.materials.document import load_material

    subject = load_material(material)
    with progress_bar() as progress:
        report = check(subject, seed=seed, progress=progress)
    show(report.to_json(), describe(report), json)
    if not report.passed:
        raise typer.Exit(1)


def describe(report: CheckReport) -> str:
    """What was measured, then what is wrong with it, then the verdict."""
    albedo, theta_deg, phi_deg = report.furnace.highest
    rows = [
        ("reciprocity", f"largest relative change {report.reciprocity_error:.1e}"),
        ("mean albedo", " ".join(f"{value:.4f}" for value in report.furnace.mean_albedo)),
        ("highest albedo", f"{albedo:.4f} at theta {theta_deg:g} deg, phi {phi_deg:g} deg"),
    ]
    rows += [
        (f"sampler at {one.theta_deg:g} deg", f"chi-square p {one.p_value:.3f}, density integrates to "
         f"{one.pdf_integral:.4f}, albedo {one.albedo_sampled:.4f} (quadrature {one.albedo_quadrature:.4f})")
        for one in report.sampler
    ]  # fmt: skip
    lines = [table(rows), *(f"warning: {text}" for text in report.warnings), *(f"FAILED: {t}" for t in report.failures)]
    return "\n".join([*lines, "passed" if report.passed else "not passed"])
