// Directions drawn from the lamps of a probe, and their density at the surface, 1/sr. The table is aim.py's: row 0 (levels,
// prominence of the lamps), rows 1 and 2 the probabilities of the six faces, then those of the four
// quarters of each face, of each quarter and so on, faces one after the other, quarters in Morton order.
//
// A direction at the surface belongs to one of the probe by the look-up: itself, or the place on the bounding planes. All
// planes that a point is inside of bound a convex room, which it and the probe's centre see whole, once each: the
// mapping is one to one. The distance map's is not, and is not aimed through.

@group(2) @binding(4) var<storage, read> aim: array<vec4f>;

const AIM_NODES = 3u;
const BELOW_ONE = 0.99999994;

// Places of one direction: that in the probe, and the solid angle of the cube's square [-1, 1]^2 there, at the surface.
struct Aimed {
    direction: vec3f,
    density: f32, // area on the cube's faces per solid angle at the surface, 1/sr
}

fn aim_row(level: u32, face: u32, morton: u32) -> u32 {
    let faces = 1u << (2u * level);
    return AIM_NODES + 2u * (faces - 1u) + face * faces + morton;
}

// Every other bit of 16.
fn spread_bits(v: u32) -> u32 {
    var x = v;
    x = (x | (x << 4u)) & 0x0f0fu;
    x = (x | (x << 2u)) & 0x3333u;
    x = (x | (x << 1u)) & 0x5555u;
    return x;
}

// Probability per area of the cube's faces, each [-1, 1]^2, in the direction w.
fn aim_probability(w: vec3f) -> f32 {
    let a = abs(w);
    var face = select(4u, 5u, w.z < 0.0);
    var st = vec2f(select(w.x, -w.x, w.z < 0.0), -w.y) / a.z;
    if (a.x >= a.y && a.x >= a.z) {
        face = select(0u, 1u, w.x < 0.0);
        st = vec2f(select(-w.z, w.z, w.x < 0.0), -w.y) / a.x;
    } else if (a.y >= a.z) {
        face = select(2u, 3u, w.y < 0.0);
        st = vec2f(w.x, select(w.z, -w.z, w.y < 0.0)) / a.y;
    }
    let levels = u32(aim[0].x);
    let n = f32(1u << levels);
    let texel = vec2u(clamp((st + 1.0) * (0.5 * n), vec2f(0.0), vec2f(n - 1.0)));
    let morton = spread_bits(texel.x) | (spread_bits(texel.y) << 1u);
    return aim[aim_row(levels - 1u, face, morton >> 2u)][morton & 3u] * (0.25 * n * n);
}

// A direction of the probe (largest component 1) from u in [0, 1)^2: faces, then quarters, each time by what is left of u
// (McCool & Harwood 1997), which keeps an even sequence even. w: its probability as aim_probability gives it.
fn aim_draw(given: vec2f) -> vec4f {
    var u = given;
    var face = 0u;
    var share = 1.0;
    for (var i = 0u; i < 6u; i++) {
        let p = aim[1u + (i >> 2u)][i & 3u];
        if (p <= 0.0) { continue; }
        face = i;
        share = p;
        if (u.x < p) { break; }
        u.x -= p;
    }
    u.x = min(u.x / share, BELOW_ONE);
    let levels = u32(aim[0].x);
    var morton = 0u;
    var texel = vec2u(0u);
    var weight = share;
    for (var level = 0u; level < levels; level++) {
        let quarters = aim[aim_row(level, face, morton)];
        let column = quarters.xy + quarters.zw;
        let left = column.x / (column.x + column.y);
        let right = u.x >= left;
        u.x = min(select(u.x / left, (u.x - left) / (1.0 - left), right), BELOW_ONE);
        let half = select(quarters.xz, quarters.yw, right);
        let upper = half.x / (half.x + half.y);
        let lower = u.y >= upper;
        weight = select(half.x, half.y, lower);
        u.y = min(select(u.y / upper, (u.y - upper) / (1.0 - upper), lower), BELOW_ONE);
        let quarter = vec2u(select(0u, 1u, right), select(0u, 1u, lower));
        morton = 4u * morton + quarter.x + 2u * quarter.y;
        texel = 2u * texel + quarter;
    }
    let n = f32(1u << levels);
    let st = (vec2f(texel) + u) * (2.0 / n) - 1.0;
    let p = weight * (0.25 * n * n);
    let sign = select(1.0, -1.0, (face & 1u) == 1u);
    if (face < 2u) { return vec4f(sign, -st.y, -sign * st.x, p); }
    if (face < 4u) { return vec4f(st.x, sign, sign * st.y, p); }
    return vec4f(sign * st.x, -st.y, sign, p);
}

// Whether the probe's centre is inside of every plane that x is inside of.
fn aim_maps(x: vec3f) -> bool {
    for (var i = 0u; i < PLANES; i++) {
        if (dot(planes[i].xyz, x) + planes[i].w > PLANE_ACTIVE_M && planes[i].w <= PLANE_ACTIVE_M) { return false; }
    }
    return LOOKUP != 2u;
}

// planes_lookup, and how densely directions of the probe lie there. A piece of plane at the distance t, h above which x
// is, is seen under the solid angle h/t^3 per area; on the cube's faces it covers h_centre/max|p|^3 per area.
fn aimed_lookup(x: vec3f, w: vec3f) -> Aimed {
    var nearness = 0.0;
    var heights = 1.0;
    for (var i = 0u; i < PLANES; i++) {
        let height = dot(planes[i].xyz, x) + planes[i].w;
        let near = -dot(planes[i].xyz, w) * select(0.0, 1.0 / height, height > PLANE_ACTIVE_M);
        heights = select(heights, planes[i].w / height, near > nearness);
        nearness = max(nearness, near);
    }
    if (nearness < 1e-6) {
        let major = max_norm(w);
        return Aimed(w, 1.0 / (major * major * major));
    }
    let found = x + w / nearness;
    let major = max_norm(found) * nearness;
    return Aimed(found, heights / (major * major * major));
}

// Unit direction at x to what the probe sees in the direction q, and the density there as in aimed_lookup.
struct Towards {
    w: vec3f,
    density: f32,
}

fn aim_towards(x: vec3f, q: vec3f) -> Towards {
    var nearness = 0.0;
    var heights = 1.0;
    for (var i = 0u; i < PLANES; i++) {
        let height = dot(planes[i].xyz, x) + planes[i].w;
        let near = select(0.0, -dot(planes[i].xyz, q) / planes[i].w, height > PLANE_ACTIVE_M);
        heights = select(heights, planes[i].w / height, near > nearness);
        nearness = max(nearness, near);
    }
    let major = max_norm(q);
    if (nearness < 1e-6) {
        let w = normalize(q);
        return Towards(w, dot(q, w) * dot(q, w) * dot(q, w) / (major * major * major));
    }
    let to = q / nearness - x;
    let stretch = length(to) * nearness / major;
    return Towards(normalize(to), heights * stretch * stretch * stretch);
}
