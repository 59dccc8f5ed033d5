"""A view of two materials and its transport, written into a store by hand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from lambent.baked.shared_exponent import packed_rgb
from lambent.baked.transport.wavelets import transformed
from lambent.core.views.camera import Camera
from lambent.materials.factored.terms import Term
from lambent.store.contract import TRANSPORT_BASIS, view_artefact_name, view_meta
from lambent.store.store import Store

SIZE, UNIT, SHINES = (8, 6), 0.25, 0.125  # pixels, radiance of transport 1, radiance of the backdrop
SHOWN = {"tray": np.arange(3, 20), "wall": np.arange(20, 41)}  # pixels by material
OBJECTS = {"plate": "tray", "back": "wall"}
Light = tuple[Term, np.ndarray]  # of a term with one curve (J, 3, P), with two (J, K, 3, P)


def write_view(
    store: Store, camera: Camera, lights: int, light: Mapping[str, Sequence[Light]], key: str, merged: Mapping[str, str]
) -> None:
    """Write the points of the view, and the transport of the terms of each material."""
    meta, said = view_meta(camera, *SIZE), []

    def put(kind: str, part: str, array: np.ndarray, **more: object) -> None:
        store.put(view_artefact_name(camera, *SIZE, kind, part), kind, array, key=key, meta={**meta, **more})

    owner = np.concatenate([np.full(len(pixel), k) for k, pixel in enumerate(SHOWN.values())])
    objects = [[name, merged.get(own, own)] for name, own in OBJECTS.items()]
    put("view_points", "pixel", np.concatenate(list(SHOWN.values())).astype(np.uint32))
    put("view_points", "object", owner.astype(np.uint32), objects=objects)
    put("view_points", "theta_o", np.zeros(len(owner), np.float32))
    put("view_points", "backdrop", np.full((SIZE[1], SIZE[0], 3), SHINES, np.float16))
    for name, terms in light.items():
        for k, (term, array) in enumerate(terms):
            part, (*counts, _, points) = f"{lights}/{name}/{k}", array.shape
            curves = [[factor.curve, count] for factor, count in zip(term.factors, counts, strict=True)]
            said.append({"material": name, "term": k, "fixed": term.fixed, "scale": UNIT, "curves": curves})
            if len(counts) == 1:
                put("transport", f"{part}/rows", transformed(array.astype(np.float32)).astype(np.float16))
                continue
            pairs = counts[0] * counts[1]
            begin = np.arange(points) * pairs
            put("transport", f"{part}/spans", np.stack([begin, begin + pairs], axis=1).astype(np.uint32))
            put("transport", f"{part}/steps", np.ones(pairs * points, np.uint8))  # all pairs in turn
            put("transport", f"{part}/values", packed_rgb(np.moveaxis(array, 3, 0).reshape(-1, 3)))
    terms_said = [{**one, "basis": TRANSPORT_BASIS} for one in said]
    put("transport", f"{lights}/terms", np.ones(len(said), np.uint32), terms=terms_said)
