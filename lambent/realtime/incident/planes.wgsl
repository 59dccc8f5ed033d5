// Bounding planes: a direction ends at the nearest of the planes around the object (thesis M, 4.4.1).

@group(2) @binding(3) var<storage, read> planes: array<vec4f>; // n and n.c + d, about the probe's centre c

override PLANES: u32 = 0u;
const PLANE_ACTIVE_M = 1e-6; // planes nearer to a point than this, or in front of it, are ignored

// First hit of a ray among the planes that x is inside of.
struct PlaneMet {
    nearness: f32, // 1 over the distance, 0 without a hit
    heights: f32,  // height of the probe's centre over the plane, relative to the height of x
}

// The ray leaves `origin` (x or the probe's centre) along w. 1/t is the largest approach/height over the planes. If
// `origin` is x, the reciprocal heights are the same for all samples of a pixel, so the compiler hoists them.
fn first_plane(origin: vec3f, w: vec3f, x: vec3f) -> PlaneMet {
    var met = PlaneMet(0.0, 1.0);
    for (var i = 0u; i < PLANES; i++) {
        let plane = planes[i];
        let height = dot(plane.xyz, x) + plane.w;
        let origin_height = dot(plane.xyz, origin) + plane.w;
        let nearness = -dot(plane.xyz, w) * select(0.0, 1.0 / origin_height, height > PLANE_ACTIVE_M);
        met.heights = select(met.heights, plane.w / height, nearness > met.nearness);
        met.nearness = max(met.nearness, nearness);
    }
    return met;
}

fn incident_look_up(x: vec3f, w: vec3f) -> LookUp {
    let nearness = first_plane(x, w, x).nearness;
    if (nearness < 1e-6) { return LookUp(w, 1.0); }
    return LookUp(x + w / nearness, 1.0 / nearness);
}

fn incident_bound(x: vec3f, w: vec3f) -> f32 {
    return first_plane(x, w, x).nearness;
}

// The planes that a point is inside of bound a convex room. The mapping is one to one if the probe's centre is inside
// of all of them: then both see every point of the walls exactly once.
fn aim_maps(x: vec3f) -> bool {
    for (var i = 0u; i < PLANES; i++) {
        if (dot(planes[i].xyz, x) + planes[i].w > PLANE_ACTIVE_M && planes[i].w <= PLANE_ACTIVE_M) { return false; }
    }
    return true;
}

// A plane element at distance t, with x at height h over the plane, has the solid angle h/t^3 per area; on the cube's
// faces it covers h_centre/max|p|^3 per area.
fn aimed_look_up(x: vec3f, w: vec3f) -> Aimed {
    let met = first_plane(x, w, x);
    if (met.nearness < 1e-6) { return aimed_afar(w); }
    let found = x + w / met.nearness;
    let major = max_norm(found) * met.nearness;
    return Aimed(found, met.heights / (major * major * major));
}

fn aim_towards(x: vec3f, q: vec3f) -> Towards {
    let met = first_plane(vec3f(0.0), q, x);
    if (met.nearness < 1e-6) { return towards_afar(q); }
    let to = q / met.nearness - x;
    let stretch = length(to) * met.nearness / max_norm(q);
    return Towards(normalize(to), met.heights * stretch * stretch * stretch);
}
