// What is nearest in each cell of a mirror picture, for searches: cells of NEAR_PX pixels a side from the planes seen,
// and each further level from 2 x 2 cells of the one before. A texel: the normal's octahedral form, N.q and 1/depth.

#include "screen.wgsl"
#include "planar_mirror.wgsl"

@group(0) @binding(0) var<uniform> mirror: Mirror;
@group(0) @binding(1) var finer: texture_2d<f32>;

fn octahedral(n: vec3f) -> vec2f {
    let p = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
    let folded = (1.0 - abs(p.yx)) * select(vec2f(-1.0), vec2f(1.0), p >= vec2f(0.0));
    return select(folded, p, n.z >= 0.0);
}

@fragment fn near_first_main(screen: Screen) -> @location(0) vec4f {
    let corner = vec2i(screen.position.xy) * NEAR_PX;
    var found = vec4f(0.0, 0.0, 1.0, -1e4);
    var nearest = 0.0; // 1/depth
    for (var i = 0; i < NEAR_PX * NEAR_PX; i++) {
        let at = corner + vec2i(i % NEAR_PX, i / NEAR_PX);
        let plane = textureLoad(finer, at, 0);
        let clip = (vec2f(at) + 0.5) / mirror.size * vec2f(2.0, -2.0) + vec2f(-1.0, 1.0);
        let w = mirror.forward.xyz + clip.x * mirror.across.xyz + clip.y * mirror.up.xyz;
        let here = dot(plane.xyz, w) / min(plane.w, -1e-6);
        found = select(found, plane, here > nearest);
        nearest = max(nearest, here);
    }
    return vec4f(octahedral(found.xyz), found.w, nearest);
}

@fragment fn near_main(screen: Screen) -> @location(0) vec4f {
    let last = vec2i(textureDimensions(finer)) - 1;
    let corner = vec2i(screen.position.xy) * 2;
    var found = vec4f(0.0);
    for (var i = 0; i < 4; i++) {
        let other = textureLoad(finer, min(corner + vec2i(i & 1, i >> 1u), last), 0);
        found = select(found, other, other.w > found.w);
    }
    return found;
}
