// An edited picture for the display, plus a share of the fading difference, which may be negative.

#include "screen.wgsl"
#include "display.wgsl"

@group(1) @binding(0) var radiance: texture_2d<f32>;
@group(1) @binding(1) var fading: texture_2d<f32>;

@fragment fn edited_display_main(screen: Screen) -> @location(0) vec4f {
    let at = vec2i(screen.position.xy);
    var seen = textureLoad(radiance, at, 0).rgb;
    if (frame.fading > 0.0) { seen += frame.fading * textureLoad(fading, at, 0).rgb; }
    return vec4f(displayed(max(seen, vec3f(0.0))), 1.0);
}
