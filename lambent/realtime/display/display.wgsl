// Exposure, view transform and sRGB encoding of one radiance, as the frame says.

#include "frame.wgsl"
#include "colour.wgsl"
#include "false_colour.wgsl"

fn displayed(seen: vec3f) -> vec3f {
    if (frame.view_transform == 3u) { return false_colour(seen); }
    let light = frame.exposure * seen;
    var shown = light;
    if (frame.view_transform == 1u) { shown = neutral(light); }
    if (frame.view_transform == 2u) { shown = filmic(light); }
    return srgb_encode(clamp(shown, vec3f(0.0), vec3f(1.0)));
}
