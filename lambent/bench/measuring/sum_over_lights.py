"""Direct light of a stored view by the plain sum over its lights, with the material's formula and numpy alone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from lambent.core.arrays import Floats, Indices
from lambent.core.geometry.directions import normalize
from lambent.editing.session.session import Session
from lambent.materials.bsdf import components
from lambent.materials.factored.curve import END_RAD, Curve
from lambent.materials.factored.parametrisations import angle_of
from lambent.materials.factored.terms import Editable
from lambent.scenes.scene import Scene
from lambent.scenes.sky.triangle_lights import TriangleLights, surface_triangles
from lambent.store.contract import transport_lights, view_artefact_name
from lambent.store.store import Store

PIECE = 0.008  # longest edge, in unit directions, of the pieces that lights are cut into; with .02 the sum of a
# highlight of slope .045 errs by .3 % itself
WORDS = 32


def errors_of_sums(
    store: Store, session: Session, scene: Scene, material: str, image: Floats, count: int
) -> dict[str, float]:
    """Mean deviation of a picture from the sum over all lights, relative to the mean, at `count` points of a material.

    `sum_error` is against the sum with curves as in the transport, linear between nodes; `curve_error` against the sum
    with the exact curves.

    The light is an environment's; the material has no textures and reflects.
    """
    from lambent.baking.transport.view import View
    from lambent.baking.transport.view_tracer import ViewTracer

    view = session.document
    most = transport_lights(store, view.camera, *view.size)[-1]
    tracer = ViewTracer(scene)
    points, lights = tracer.points(View(view.camera, *view.size)), tracer.lights(most)
    assert not lights.near.any() and material not in scene.textures
    mine = np.flatnonzero(np.array([o.material == material for o in scene.objects])[points.object])
    chosen = np.random.default_rng(0).choice(mine, min(count, len(mine)), replace=False)
    words = store.read(view_artefact_name(view.camera, *view.size, "visibility", str(most)))[:, chosen]
    m = np.arange(len(lights))
    seen = words[m // WORDS] >> (m % WORDS)[:, None].astype(np.uint32) & 1
    some = points.where(chosen)
    frame = np.stack([some.t, some.b, some.n], axis=1).astype(float)
    found, errors = image.reshape(-1, 3)[some.pixel], {}
    said = store.artefact(view_artefact_name(view.camera, *view.size, "transport", f"{most}/terms")).meta["terms"]
    nodes = {name: n for term in said if term["material"] == material for name, n in term["curves"]}
    for name, counts in (("sum_error", nodes), ("curve_error", {})):
        expected = _sums(session.editable(material), counts, lights, frame, some.wo.astype(float), seen)
        errors[name] = float(f"{np.abs(found - expected).mean() / expected.mean():.2g}")
    return errors


def _sums(
    editable: Editable, nodes: Mapping[str, int], lights: TriangleLights, frame: Floats, wo: Floats, seen: Indices
) -> Floats:
    """(P, 3) radiance towards wo (P, 3), local, of lights where `seen` (M, P).

    Quotient and cosine are those of each light's centre, curves are means over its pieces (Ben-Artzi 2007, eq. 4.11).
    `nodes` are their numbers by curve.
    """
    total = np.zeros((len(wo), 3))
    without_curves = replace(editable, curves={name: Curve.constant() for name in editable.curves})
    for corners, centre, light, visible in zip(lights.corners, lights.centres, lights.light, seen, strict=True):
        here = np.flatnonzero(visible & (frame[:, 2] @ centre > 0))
        wi, pieces = frame[here] @ centre, np.einsum("pij,sj->psi", frame[here], _pieces(corners))
        pair = components(pieces), components(np.broadcast_to(wo[here, None], pieces.shape))
        for term in editable.terms:
            curves = np.ones(pieces.shape)
            for factor in term.factors:
                angle = angle_of(factor.over, *pair, factor.stretch)
                curves = curves * _at(editable.curves[factor.curve], angle, nodes.get(factor.curve), factor.polar)
            quotient = without_curves.eval_term(term, wi, wo[here])
            total[here] += light * quotient * wi[:, 2:] * curves.mean(axis=1)
    return total


def _at(curve: Curve, angle: Floats, nodes: int | None, polar: int) -> Floats:
    """(..., 3) values of a curve, or of its linear interpolation between `nodes` nodes."""
    if nodes is not None:
        curve = Curve.through((np.arange(nodes) + 0.5) * END_RAD / nodes, curve.node_values(nodes, polar))
    return np.asarray(curve.at(angle))


def _pieces(corners: Floats) -> Floats:
    """(S, 3) evenly spread directions within a light."""
    return np.asarray(normalize(surface_triangles(corners[None], np.ones((1, 3)), PIECE).centres))
