// Exposure, view transform and sRGB encoding.

#include "screen.wgsl"
#include "display.wgsl"

@group(1) @binding(0) var radiance: texture_2d<f32>;
@group(1) @binding(1) var prior: texture_2d<f32>; // of few samples; `radiance` itself without a prior

override MARKED: bool = false; // alpha marks means over surfaces for smooth.wgsl; it is never shown

@fragment fn tonemap_main(screen: Screen) -> @location(0) vec4f {
    let at = vec2i(screen.position.xy);
    let seen = mix(textureLoad(radiance, at, 0), textureLoad(prior, at, 0), frame.prior);
    return vec4f(displayed(seen.rgb), select(1.0, seen.a, MARKED));
}
