// Exposure, view transform and sRGB encoding.

#include "frame.wgsl"
#include "screen.wgsl"
#include "colour.wgsl"
#include "false_colour.wgsl"

@group(1) @binding(0) var radiance: texture_2d<f32>;
@group(1) @binding(1) var prior: texture_2d<f32>; // of few samples; `radiance` again where there is none

@fragment fn tonemap_main(screen: Screen) -> @location(0) vec4f {
    let at = vec2i(screen.position.xy);
    let seen = mix(textureLoad(radiance, at, 0).rgb, textureLoad(prior, at, 0).rgb, frame.prior);
    if (frame.view_transform == 3u) { return vec4f(false_colour(seen), 1.0); }
    let light = frame.exposure * seen;
    var shown = light;
    if (frame.view_transform == 1u) { shown = neutral(light); }
    if (frame.view_transform == 2u) { shown = filmic(light); }
    return vec4f(srgb_encode(clamp(shown, vec3f(0.0), vec3f(1.0))), 1.0);
}
