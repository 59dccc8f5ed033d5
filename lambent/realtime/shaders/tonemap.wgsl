// Exposure, view transform and sRGB encoding.

#include "screen.wgsl"
#include "display.wgsl"

@group(1) @binding(0) var radiance: texture_2d<f32>;
@group(1) @binding(1) var prior: texture_2d<f32>; // of few samples; `radiance` again where there is none

@fragment fn tonemap_main(screen: Screen) -> @location(0) vec4f {
    let at = vec2i(screen.position.xy);
    let seen = mix(textureLoad(radiance, at, 0).rgb, textureLoad(prior, at, 0).rgb, frame.prior);
    return vec4f(displayed(seen), 1.0);
}
