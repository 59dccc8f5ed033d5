// Luminance in false colour; the colours are copied from core.false_colour.

#include "frame.wgsl"
#include "colour.wgsl"

const STOPS = array<vec3f, 9>(
    vec3f(0.11, 0.07, 0.28), vec3f(0.16, 0.27, 0.62), vec3f(0.12, 0.52, 0.78), vec3f(0.09, 0.70, 0.64),
    vec3f(0.30, 0.76, 0.35), vec3f(0.71, 0.80, 0.20), vec3f(0.96, 0.75, 0.13), vec3f(0.94, 0.45, 0.12),
    vec3f(0.78, 0.12, 0.12),
);

// Encoded colour of a radiance (or irradiance); frame.scale is (low, high, logarithmic, lm/W).
fn false_colour(light: vec3f) -> vec3f {
    let y = frame.scale.w * luminance(light);
    let low = frame.scale.x;
    let high = frame.scale.y;
    var share = (y - low) / (high - low);
    if (frame.scale.z > 0.5) { share = log(max(y, 1e-12) / low) / log(high / low); }
    if (share < 0.0) { return vec3f(0.0); }
    if (share > 1.0) { return vec3f(1.0); }
    let at = min(share * 8.0, 7.9999);
    var stops = STOPS;
    let i = u32(at);
    return mix(stops[i], stops[i + 1u], at - f32(i));
}
