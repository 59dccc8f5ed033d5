// Directions drawn from the lamps of a probe, and their density at the surface, 1/sr. The table is made by aim.py: row
// 0 (levels, prominence of the lamps), rows 1 and 2 the probabilities of the six faces, then the probabilities of the
// four quarters of each face, of the quarters of each quarter, and so on, face by face, quarters in Morton order.
//
// The look-up in use maps directions at the surface to directions of the probe (aimed_look_up).

@group(2) @binding(2) var<storage, read> aim: array<vec4f>;

const AIM_NODES = 3u;
const BELOW_ONE = 0.99999994;

// Sixteenths of a lobe's samples that should aim, by the prominence of the lamps and mx my: aimed_share of aim.py.
fn wanted_sixteenths(prominence: f32, slopes: f32) -> f32 {
    return clamp(prominence * (8.0 + 1.25 * log2(100.0 * slopes)), 0.0, 12.0);
}

fn aim_row(level: u32, face: u32, morton: u32) -> u32 {
    let faces = 1u << (2u * level);
    return AIM_NODES + 2u * (faces - 1u) + face * faces + morton;
}

// Spreads 8 bits to every other bit of 16.
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

// A direction of the probe (largest component 1) from u in [0, 1)^2: chooses a face, then quarters, and rescales u at
// each choice (McCool & Harwood 1997), which keeps an even sequence even. w: its probability, as from aim_probability.
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
