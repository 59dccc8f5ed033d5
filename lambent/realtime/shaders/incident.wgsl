// Results of look-ups of incident light (lambent/realtime/incident), and results for distant light.

#include "directions.wgsl"

// Direction in the probe (not unit), and distance from the surface to the point seen there; 1 for distant light.
struct LookUp {
    direction: vec3f,
    t: f32,
}

// A look-up, and the density of the probe's directions there: area on the faces of the cube [-1, 1]^3 per solid angle
// at the surface, 1/sr.
struct Aimed {
    direction: vec3f,
    density: f32,
}

// Unit direction at the surface to the point that the probe sees in a given direction, and the density there.
struct Towards {
    w: vec3f,
    density: f32,
}

fn aimed_afar(w: vec3f) -> Aimed {
    let major = max_norm(w);
    return Aimed(w, 1.0 / (major * major * major));
}

fn towards_afar(q: vec3f) -> Towards {
    let major = max_norm(q);
    let w = normalize(q);
    return Towards(w, dot(q, w) * dot(q, w) * dot(q, w) / (major * major * major));
}
