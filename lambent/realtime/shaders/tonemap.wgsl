// Exposure, view transform and sRGB encoding.

#include "frame.wgsl"
#include "screen.wgsl"
#include "false_colour.wgsl"

@group(1) @binding(0) var radiance: texture_2d<f32>;
@group(1) @binding(1) var prior: texture_2d<f32>; // of few samples; `radiance` again where there is none

// Filmic curve of core.colour.filmic (Narkowicz 2015, a fit of the ACES reference transform).
fn filmic(c: vec3f) -> vec3f {
    let x = min(c, vec3f(1e4));
    return (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14);
}

// Khronos PBR Neutral (2024): colours below .76 are kept, highlights roll off and lose saturation.
fn neutral(c: vec3f) -> vec3f {
    let start = 0.76;
    let low = min(c.r, min(c.g, c.b));
    let offset = select(0.04, low - 6.25 * low * low, low < 0.08);
    let x = c - offset;
    let peak = max(x.r, max(x.g, x.b));
    if (peak < start) { return x; }
    let d = 1.0 - start;
    let new_peak = 1.0 - d * d / (peak + d - start);
    let g = 1.0 - 1.0 / (0.15 * (peak - new_peak) + 1.0);
    return mix(x * new_peak / peak, vec3f(new_peak), g);
}

fn srgb(c: vec3f) -> vec3f {
    return select(1.055 * pow(c, vec3f(1.0 / 2.4)) - 0.055, 12.92 * c, c <= vec3f(0.0031308));
}

@fragment fn tonemap_main(screen: Screen) -> @location(0) vec4f {
    let at = vec2i(screen.position.xy);
    let seen = mix(textureLoad(radiance, at, 0).rgb, textureLoad(prior, at, 0).rgb, frame.prior);
    if (frame.view_transform == 3u) { return vec4f(false_colour(seen), 1.0); }
    let light = frame.exposure * seen;
    var shown = light;
    if (frame.view_transform == 1u) { shown = neutral(light); }
    if (frame.view_transform == 2u) { shown = filmic(light); }
    return vec4f(srgb(clamp(shown, vec3f(0.0), vec3f(1.0))), 1.0);
}
