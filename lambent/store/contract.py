"""Names and layouts of the arrays that bakes write and the interactive side reads.

    geometry/positions, normals, tangents  (V, 3) float32, world space
    geometry/uv, uv2                       (V, 2) float32; uv2 in [0, 1] is the light map's
    geometry/faces                         (T, 3) uint32, sorted by object; ObjectRecord has the range of each
    light_map/irradiance                   (H, W, 3) float16, W/m^2 on the normal's side; the centre of texel (row,
                                           column) is at uv2 = ((column + 1/2)/W, (row + 1/2)/H): no flip.
                                           meta["sun"], optional: the SunRecord whose direct light is left out, for
                                           a shadow map to add; its light from other surfaces is in the map
    light_map/irradiance_back              same, on the other side; zero except for two-sided objects; optional
    light_map/noise, noise_back            (H, W) float16, relative standard error before denoising; optional
    light_map/groups, groups_back          (n, H, W, 3) float16, irradiance by light group, in order of meta["groups"],
                                           store.light_groups; irradiance, irradiance_back are the sums; optional
    light_map/direct, direct_back          (n, H, W, 3) float16, the part straight from the group's emitters and, with
                                           final gathering, through lobes alone; n = 1 without groups. Photon maps
                                           have none
    light_map/lean                         (H, W, 3) float16, dominant light direction, world space: mean direction of
                                           the incident light, weighted by its irradiance; 0 without a normal map
    light_map/probe_share                  (H, W, 4) float16, a and b for meta["objects"]: store.occlusion; optional
    light_map/sunlit                       (H, W) uint8, 0 where no sunlight arrives: store.sunlit; optional
    light_map/lamps, lamps_back, lamps_reach, lamps/...  lamps that are drawn by pixel: store.lamps; optional
    environment/radiance                   (6, N, N, 3) float16, cube map (core.cubemap) of radiance, sun disc included,
                                           in units of meta["unit"] W/(sr m^2): a power of two, 1 if absent
    probe/OBJECT/radiance                  (6, N, N, 3) float16, cube map seen from meta["centre"] in meta["unit"] as
                                           above, without OBJECT if meta["object_left_out"]. meta["seen_irradiance"],
                                           optional: luminance of the irradiance it would give, coefficients of
                                           1, x, y, z, xy, yz, 3zz - 1, xz, xx - yy of the normal. Renderers scale the
                                           probe by the light map's share of it: store.occlusion. Objects in the
                                           document SHARED_PROBES show another object's probe
    probe/OBJECT/distance                  (6, N, N) float32, metres along the unit direction; FAR if nothing is hit
    probe/OBJECT/groups                    (n, 6, N, N, 3) float16, its radiance by light group, units as above; only
                                           with light_map/groups
    probe/OBJECT/planes                    (P, 4) float32, bounding planes (n, d): n.x + d = 0, n towards the centre
    answer/...                             from which indirect light follows edits of materials: store.answer
    light_field/OBJECT/points, normals     (P, 3) float32, see core.light_field
    light_field/OBJECT/blocks              (P, B, B, 4) uint32: octahedral maps (core.octahedral) of radiance in BC6H
                                           (core.light_field_blocks), units as above, without the disc of meta["sun"]
                                           of light_map/irradiance
    light_field/OBJECT/distances           (P, R, B, 2) uint32: inverse distances, 1/m, 0 if nothing is hit, and cover
                                           (core.distance_blocks). meta["texels"]: [E] along a side of the maps
    light_field/OBJECT/sample_map          (h, w, 4) uint16; written last. meta["corner"] and meta["grid"] place it on
                                           the light map's uv2, meta["offset_m"] is the points' distance off the
                                           surface. meta["volume"]: points fill OBJECT's bounding box, maps leave it out
    light_field/OBJECT/exits               (h, w, 4) float16, optional, glass only: the faces behind the sample map's
                                           texels, core.light_field.Glass; written before it. meta["glass"]: index of
                                           refraction, RGB transmittance of a face, exponent of its cosine
    texture/MATERIAL/PART                  (H, W, C) float16, of MaterialTextures; row 0 is the top
    view/KEY/KIND/PART                     arrays of one camera, such as transport vectors per pixel. KEY is `view_key`
                                           of the camera's values and, if the array depends on it, the image's size:
                                           a renamed camera keeps its arrays, a moved one loses them. meta["view"] is
                                           the ViewRecord; `baked_views` lists them

For editing the materials of a view; KEY includes the image's size:

    view/KEY/view_points/pixel             (P,) uint32, row * width + column of pixels that show a surface, ascending
    view/KEY/view_points/object            (P,) uint32, its object: meta["objects"][i] is [name, material]
    view/KEY/view_points/theta_o           (P,) float32, angle between the viewer and the shading normal, radians
    view/KEY/view_points/backdrop          (height, width, 3) float16, W/(sr m^2), radiance without reflection: the
                                           environment, and emission of surfaces
    view/KEY/visibility/LIGHTS             (ceil(M / 32), P) uint32, bit m % 32 of word m // 32: whether light m is
                                           visible. LIGHTS is the requested number of lights, meta["lights"] the actual
                                           one, M. Lights behind the shading normal count as hidden unless a term
                                           transmits
    view/KEY/transport/LIGHTS/MATERIAL/TERM/rows    (J, 3, Q) float16: direct light of one term of a material by wavelet
                                           (core.wavelets) of its curve, at the Q points of the material in their order.
                                           TERM is the term's number in its Editable
    .../steps, values, spans               for a term with two curves instead: (Q, 2) uint32 spans, first and past-last
                                           entry of each point; (N,) uint32 light by pairs of nodes j, k, RGB9E5
                                           (core.shared_exponent); (N,) uint8 steps from one entry's pair to the next.
                                           Pairs are numbered j K + k; each point begins at -1. Black pairs are
                                           omitted unless a step would exceed 255
    view/KEY/transport/LIGHTS/terms        (T,) uint32, Q of each term; written last. meta["terms"] has for each
                                           "material", "term", "fixed": its quotient and angles (Term.fixed), "curves":
                                           names and numbers of nodes, "scale", and "basis": TRANSPORT_BASIS.
                                           meta["environment"] is None, or has "sha256", "scale" and "rotation_deg" of
                                           the image that lights the view instead of the scene's environment

Radiance of a term at a point, W/(sr m^2): scale f_q f_o(theta_o) times the sum over wavelets, or pairs, of the array
times the curves' coefficients. Coefficients of pairs are the curves' values at nodes (Curve.node_values), the
centres of equal bands from 0 to 90 degrees, with linear interpolation; those of rows are the curves' wavelets; f_q and
f_o are the term's. Textures are included in the array. The first set of LIGHTS is small and ready early;
`transport_lights` lists the complete sets, the best last.

For relighting a view with its materials unchanged; KEY includes the image's size, and the N triangles subdivide the
icosahedron repeatedly into four, in the order of scenes.triangle_wavelets:

    view/KEY/relighting/spans              (B, N + 1) uint32, first entry of each wavelet in each block of meta["block"]
                                           points, and the one past the last; B blocks of the points of view_points
    view/KEY/relighting/points, values     (E, 1) uint16, each entry's point within its block, and (E, 3) float16, light
                                           by wavelet of radiance: sums to W/(sr m^2) with TriangleTree.of_radiance
    view/KEY/relighting/errors             (B, 2) float32: squared sums of the omitted or rounded part, and of all
    view/KEY/relighting/lamps              (P, 3) float32, W/(sr m^2), direct light of all emitters but the environment
    view/KEY/relighting/light              (16 N, 3) float32, W/(sr m^2), the scene's environment in the N triangles,
                                           subdivided twice more

Indirect light at the same points:

    view/KEY/interreflection/tails         (Z,) uint32, surfaces on the path of each tail; meta["tails"] is the document
                                           of `baked.transport.tails`, which numbers them, meta["series"] that of the
                                           bands, meta["environment"] the image that lit it instead of the scene's own
    view/KEY/interreflection/MATERIAL/TERM/TILE    uint32, the TILE-th 4096 points of a material, P: number of entries
                                           of each point (P,), then of all entries tail * bands + band (N,), ascending,
                                           and their light (N,), RGB9E5 times meta["unit"] W/(sr m^2). meta["points"] is
                                           P, meta["samples"] the number of traced paths; "fixed" and "curves" as above.
                                           Bands of two curves are numbered first curve first. An uneditable material
                                           has one band, TERM 0, with all its light
    view/KEY/interreflection/samples       (1,) uint32, paths that every tile has; written last

Radiance of a term by interreflections: scale f_q f_o(theta_o) times the sum over entries of light, the coefficient of
the band, and the factor of the tail. Coefficients of bands are `Curve.band_means`, with the angle's `polar`. Surfaces
of a tail scatter as in the bake, divided by their albedos at the bake.

The scene record (cameras, materials, objects...) is the document "scene"; a store of edited views alone has no objects
in it. Times are the documents "timings", "processor_timings" and "last_run". Every array is absent, partial or complete
(`Store.availability`); `Store.read_partial` returns the written part.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from typing import Any

import numpy as np
from pydantic import Field, ValidationError

from lambent.core.errors import UserError, invalid
from lambent.core.light.colour import MOST_UNIT
from lambent.core.plain import Triple, as_folder, triple
from lambent.core.strict import Strict
from lambent.core.views.camera import Camera, CameraPath
from lambent.materials.document import Material
from lambent.scenes.scene import Border, Variant
from lambent.store.consistency import check_record, numbers_of
from lambent.store.store import MANIFEST, Store

FAR = 1.0e4  # metres: distance if nothing is hit
SCENE = "scene"
CUTS = "cuts"  # document: objects whose triangles the bake has cut, and the viewers it cut them for
TIMINGS, PROCESSOR_TIMINGS = "timings", "processor_timings"  # of each step, seconds of wall and processor time
LAST_RUN = "last_run"  # times of the last bake alone, and "other"
SHARED_PROBES = "shared_probes"  # document: its key, and "owners": probe owner by object that shows another's probe
LIGHT_FIELD_CHOICE = "light_field_choice"  # document: light fields that the bake chose, and the key of their inputs
TRANSPORT_BASIS = "hats"  # basis of transport; earlier stores, which state none, use steps
SIDES = ("irradiance", "irradiance_back")  # of the light map
DOMINANT_DIRECTION = "light_map/lean"  # kept for compatibility with existing stores
VIEW = "view"


MOST_BORDERS = 2  # borders of a part with other parts of its object


class ObjectRecord(Strict):
    """One object: its faces are geometry/faces[first_face : first_face + face_count].

    At x, a part has the share product of smoothstep(0, 1, 1/2 + n.x + d) over its borders (n, d), n in 1/m, of its
    whole object's light. The shares of all parts sum to 1.
    """

    name: str
    material: str
    first_face: int
    face_count: int
    emission: Triple = (0.0, 0.0, 0.0)
    luminaire: int | None = None  # number of the light whose opening it is; `emission` is its mean radiance
    bounds: tuple[Triple, Triple]
    probe: bool = False  # needs probe/NAME/*, its own or a shared one
    part_of: str = ""  # the object that the bake cut this part from, for probes
    borders: tuple[Border, ...] = Field(default=(), max_length=MOST_BORDERS)  # of a part with the others

    def with_part(self, other: ObjectRecord) -> ObjectRecord:
        """Merge this part and the next into one object."""
        low, high = np.minimum(self.bounds[0], other.bounds[0]), np.maximum(self.bounds[1], other.bounds[1])
        changes = {
            "face_count": self.face_count + other.face_count,
            "bounds": (triple(low), triple(high)),
            "borders": (),
        }
        return self.model_copy(update={**changes, "name": self.part_of})


def whole_objects(objects: Iterable[ObjectRecord]) -> tuple[ObjectRecord, ...]:
    """Objects as in the scene: consecutive parts of one object are merged."""
    found: list[ObjectRecord] = []
    for one in objects:
        before = found[-1] if found else None
        follows = before is not None and before.first_face + before.face_count == one.first_face
        if before is not None and follows and one.part_of and one.part_of == before.part_of:
            found[-1] = before.with_part(one)
        else:
            found.append(one)
    return tuple(found)


class SunRecord(Strict):
    """A sun disc: unit direction towards it, irradiance in W/m^2 at normal incidence, angular radius.

    Clear glass of the materials `panes` (materials.clear) transmits its direct light; all other surfaces block it.
    """

    direction: Triple
    irradiance: Triple
    radius_rad: float = Field(ge=0, le=0.2)
    panes: tuple[str, ...] = Field(default=(), exclude_if=lambda panes: not panes)


class TexturesRecord(Strict):
    """See scenes.scene.MaterialTextures. Maps PART to its uv transform; the texels are arrays."""

    parts: dict[str, tuple[Triple, Triple]]
    cutoff: float = 0.5


class ReflectorPart(Strict):
    """One object's share of a planar reflector. `faces` are indices within the object's range of geometry/faces."""

    object: str
    faces: tuple[int, ...]
    area_m2: float


class PlanRecord(Strict):
    """See scenes.floor_plan.FloorPlan: a grid of signed distances, compressed into `packed` by store.plans."""

    corner: Triple
    across: Triple
    along: Triple
    cell_m: float = Field(gt=0)
    rows: int = Field(ge=1, le=8192)
    columns: int = Field(ge=1, le=8192)
    packed: str


class ReflectorRecord(Strict):
    """A planar reflector, see scenes.reflectors.Reflector: plane (n, d) with n.x + d = 0, and a convex outline in it.

    `plan` has the walls along its true edges, or is None. Older stores have `walled` instead, which is ignored.
    """

    plane: tuple[float, float, float, float]
    outline: tuple[Triple, ...]
    deviation_m: float = 0.0
    two_sided: bool = False
    walled: tuple[bool, ...] = ()
    plan: PlanRecord | None = None
    parts: tuple[ReflectorPart, ...]


class SceneRecord(Strict):
    """Everything about a scene that the interactive side needs besides its arrays."""

    name: str
    objects: tuple[ObjectRecord, ...]
    materials: dict[str, Material]
    cameras: tuple[Camera, ...]
    paths: tuple[CameraPath, ...] = ()
    reflectors: tuple[ReflectorRecord, ...] = ()
    exposure_ev: float | None = 0.0  # None: metered from the first picture (core.exposure)
    bounds: tuple[Triple, Triple]
    warnings: tuple[str, ...] = ()
    textures: dict[str, TexturesRecord] = Field(default_factory=dict)  # by the material's name
    variants: tuple[Variant, ...] = Field(default=(), exclude_if=lambda variants: not variants)
    caption: str = Field(default="", exclude_if=lambda text: not text)
    credit: str = Field(default="", exclude_if=lambda text: not text)


class ViewRecord(Strict):
    """A view that owns arrays: its camera, as named then, and the image's size if the arrays depend on it."""

    camera: Camera
    width: int = 0
    height: int = 0


def view_key(camera: Camera, width: int = 0, height: int = 0) -> str:
    """16 hex digits that identify the camera's exact values and the image's size, but not the camera's name."""
    values = np.array([*camera.position, *camera.target, *camera.up, camera.fov_y_deg], "<f8") + 0.0  # -0 is 0
    return hashlib.sha256(values.tobytes() + f"{width}x{height}".encode("ascii")).hexdigest()[:16]


def view_artefact_name(camera: Camera, width: int, height: int, kind: str, part: str) -> str:
    """Name of an array of one view; `width` and `height` are 0 if the array does not depend on the image's size."""
    return f"{VIEW}/{view_key(camera, width, height)}/{kind}/{part}"


def view_meta(camera: Camera, width: int = 0, height: int = 0) -> dict[str, Any]:
    """Required meta of an array of one view."""
    return {VIEW: ViewRecord(camera=camera, width=width, height=height).model_dump(mode="json")}


def baked_views(store: Store) -> dict[str, ViewRecord]:
    """The views with arrays in a store, finished or not, by key; `UserError` if a record is invalid."""
    mine = [artefact for artefact in store.artefacts() if artefact.name.startswith(f"{VIEW}/")]
    try:
        return {a.name.split("/")[1]: ViewRecord.model_validate(a.meta.get(VIEW)) for a in mine}
    except ValidationError as error:
        raise store.broken("view", got=error) from error


def transport_lights(store: Store, camera: Camera, width: int, height: int) -> list[int]:
    """Numbers of lights, ascending, for which a store has the complete transport of a view."""
    start = f"{VIEW}/{view_key(camera, width, height)}/transport/"
    names = [
        a.name.removeprefix(start) for a in store.artefacts("transport") if a.name.startswith(start) and a.complete
    ]
    return sorted(int(name.removesuffix("/terms")) for name in names if name.endswith("/terms"))


def probe_name(object_name: str, part: str) -> str:
    """Name of a probe's array; `part` is radiance, groups, distance or planes."""
    return f"probe/{as_folder(object_name)}/{part}"


def light_field_name(object_name: str, part: str) -> str:
    """Name of an array of an object's light field; see above for `part`."""
    return f"light_field/{as_folder(object_name)}/{part}"


def probe_irradiance(store: Store, object_name: str) -> tuple[float, ...]:
    """`seen_irradiance` of a probe, if the light map is to scale its light; else empty."""
    name = probe_name(object_name, "radiance")
    return numbers_of(store, name, "seen_irradiance", 9) if store.artefact(name).meta.get("seen_irradiance") else ()


def radiance_unit(store: Store, name: str) -> float:
    """Unit in W/(sr m^2), from 1 to MOST_UNIT, of the cube map `name`; `UserError` if it is invalid."""
    unit = store.artefact(name).meta.get("unit", 1.0)
    if not (isinstance(unit, int | float) and 1 <= unit <= MOST_UNIT):
        raise store.broken(f"{name}: unit", got=unit, expected=f"a number from 1 to {MOST_UNIT:g}")
    return float(unit)


def sun_left_out(store: Store) -> SunRecord | None:
    """The sun whose direct light the light map leaves out; None if it has all light. `UserError` if it is invalid."""
    name = f"light_map/{SIDES[0]}"
    said = store.artefact(name).meta.get("sun") if name in store else None
    if said is None:
        return None
    try:
        sun = SunRecord.model_validate(said)
    except ValidationError as error:
        raise invalid(error, store.folder / MANIFEST) from error
    numbers = np.array([*sun.direction, *sun.irradiance, sun.radius_rad])
    if not np.isfinite(numbers).all() or abs(np.linalg.norm(sun.direction) - 1) > 1e-3:
        raise store.broken(f"{name}: sun", got=said)
    return sun


def shared_probes(store: Store) -> dict[str, str]:
    """Owner of the shown probe, by object without its own; empty for earlier stores. `UserError` if invalid."""
    said = store.documents.get(SHARED_PROBES, {})
    found = said.get("owners", {}) if isinstance(said, dict) else None
    if not isinstance(found, dict) or not all(isinstance(owner, str) for owner in found.values()):
        raise store.broken(SHARED_PROBES, got=said)
    return found


def noise_name(side: str) -> str:
    """Name of the array of the relative standard error of a side of the light map."""
    return f"light_map/{side.replace('irradiance', 'noise')}"


def texture_name(material_name: str, part: str) -> str:
    """Name of a texture's array; `part` is a field of scenes.scene.MaterialTextures."""
    return f"texture/{as_folder(material_name)}/{part}"


def needs_probe(material: Material) -> bool:
    """Whether a material has a directional lobe, which shows a probe."""
    return any(max(lobe.k) > 0 for lobe in material.lobes)


def is_two_sided(material: Material, *, masked: bool = False) -> bool:
    """Whether both sides need irradiance: light passes through, or both sides are visible, as with cut-out leaves."""
    return material.transmits or masked


def scene_record(store: Store) -> SceneRecord:
    """The scene record of a baked store; `UserError` if it is damaged, or contradicts the arrays or itself."""
    if SCENE not in store.documents:
        raise UserError("store has no scene record", file=store.folder, field=SCENE, hint="bake it first")
    try:
        record = SceneRecord.model_validate(store.documents[SCENE])
    except ValidationError as error:
        raise invalid(error, store.folder / MANIFEST) from error
    check_record(store, record)
    return record


def write_scene_record(store: Store, record: SceneRecord) -> None:
    store.set_document(SCENE, record.model_dump(mode="json"))
