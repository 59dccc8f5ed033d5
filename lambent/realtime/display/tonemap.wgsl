// Exposure, view transform and sRGB encoding.

#include "screen.wgsl"
#include "display.wgsl"

@group(1) @binding(0) var radiance: texture_2d<f32>;

override MARKED: bool = false; // alpha marks means over surfaces for smooth.wgsl; it is never shown

@fragment fn tonemap_main(screen: Screen) -> @location(0) vec4f {
    let at = vec2i(screen.position.xy);
    let seen = textureLoad(radiance, at, 0);
    return vec4f(displayed(seen.rgb), select(1.0, seen.a, MARKED));
}
