// Running mean of a progressive series: mean += (frame - mean)/(index + 1).

#include "screen.wgsl"

@group(0) @binding(0) var mean_before: texture_2d<f32>;
@group(0) @binding(1) var this_frame: texture_2d<f32>;
@group(0) @binding(2) var<uniform> weight: vec4f; // x: 1/(index + 1)

@fragment fn accumulate_main(screen: Screen) -> @location(0) vec4f {
    let at = vec2i(screen.position.xy);
    let now = textureLoad(this_frame, at, 0);
    if (weight.x >= 1.0) { return now; } // before the first frame the mean is undefined
    return mix(textureLoad(mean_before, at, 0), now, weight.x);
}
