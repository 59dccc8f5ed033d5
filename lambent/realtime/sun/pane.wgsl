// One layer of clear glass as seen from the sun (realtime/sun/panes.py): depth and transmittance.

#include "vertex.wgsl"
#include "material.wgsl"
#include "lobes.wgsl"
#include "clear.wgsl"

@group(2) @binding(0) var<uniform> terms: array<vec4f, LAMBENT_CLEAR_TERMS>;
@group(2) @binding(1) var solid: texture_depth_2d_array;  // opaque depths, in texels of half the size
@group(2) @binding(2) var before: texture_depth_2d_array; // of the previous layer

override FIRST: bool = true;   // no previous layer
override MASKED: bool = false; // the glass has holes

// `frame.forward` is the direction to the sun, `frame.first_sample` the square.
@fragment fn pane_main(v: Varyings) -> @location(0) vec4f {
    let texel = vec2i(v.position.xy);
    var hidden = MASKED && is_hole(v.uv);
    let tint = painted(v.uv).specular;
    var deepest = 1.0;
    for (var k = 0; k < 4; k++) {
        deepest = min(deepest, textureLoad(solid, 2 * texel + vec2i(k & 1, k >> 1u), frame.first_sample, 0));
    }
    hidden |= v.position.z <= deepest;
    if (!FIRST) { hidden |= v.position.z >= textureLoad(before, texel, frame.first_sample, 0); }
    if (hidden) { discard; }
    let cosine = abs(dot(v.n_world, frame.forward.xyz)) * inverseSqrt(max(dot(v.n_world, v.n_world), 1e-12));
    return vec4f(min(lambent_clear(cosine, terms) * tint, vec3f(LAMBENT_CLEAR_MOST)), 1.0);
}
