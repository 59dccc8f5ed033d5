// The share of an object's light that a part contributes at a point. Near borders, the parts' probes are mixed: each
// part is drawn with its share, and added to its neighbours within its reach.

override PART: u32 = 0u; // 0: a whole object; 1: a part; 2: a part, added to its neighbours

const LEAST_SHARE = 1.0 / 4096.0;

fn part_share(x: vec3f) -> f32 {
    if (PART == 0u) { return 1.0; }
    var share = 1.0;
    for (var i = 0u; i < 2u; i++) {
        share *= smoothstep(0.0, 1.0, 0.5 + dot(object.borders[i], vec4f(x, 1.0)));
    }
    if (PART == 2u && share < LEAST_SHARE) { discard; }
    return share;
}
