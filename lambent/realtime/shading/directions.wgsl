// Directions: maximum norm, perpendiculars, octahedral coordinates.

fn max_norm(v: vec3f) -> f32 {
    let a = abs(v);
    return max(a.x, max(a.y, a.z));
}

// The part of v that is perpendicular to the unit vector n.
fn rejection(v: vec3f, n: vec3f) -> vec3f {
    return v - n * dot(n, v);
}

// A vector perpendicular to the unit vector n, at least .7 long.
fn perpendicular(n: vec3f) -> vec3f {
    return cross(n, select(vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), abs(n.x) > 0.7));
}

// Octahedral coordinates in [-1, 1]^2 of a unit vector (Cigolle et al. 2014).
fn octahedral(n: vec3f) -> vec2f {
    let p = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
    let folded = (1.0 - abs(p.yx)) * select(vec2f(-1.0), vec2f(1.0), p >= vec2f(0.0));
    return select(folded, p, n.z >= 0.0);
}
