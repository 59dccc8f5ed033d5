// What look-ups of incident light return (lambent/realtime/incident), and the answers for light from afar.

#include "directions.wgsl"

// Where to look in the probe (not unit), and the distance from the surface to what is seen there; 1 for light from afar.
struct LookUp {
    direction: vec3f,
    t: f32,
}

// A look-up, and how densely directions of the probe lie there: area on the faces of the cube [-1, 1]^3 per solid angle at
// the surface, 1/sr.
struct Aimed {
    direction: vec3f,
    density: f32,
}

// Unit direction at the surface to what the probe sees in a given direction, and the density there.
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
