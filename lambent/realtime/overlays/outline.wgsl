// A smooth line around the visible part of an object, from a mask of whole pixels.

#include "screen.wgsl"

const COLOUR = vec3f(1.0, 0.72, 0.2);
const REACH = 2;    // pixels; as `outline.REACH_PX`
const SPREAD = 1.0; // standard deviation of the bell, pixels

@group(0) @binding(0) var seen: texture_2d<f32>;

// The silhouette, blurred by the bell, rises from 0 to 1 across its border: the line is drawn in between.
@fragment fn outline_main(screen: Screen) -> @location(0) vec4f {
    let last = vec2i(textureDimensions(seen)) - 1;
    let at = vec2i(screen.position.xy);
    var share = 0.0;
    var weight = 0.0;
    for (var y = -REACH; y <= REACH; y++) {
        for (var x = -REACH; x <= REACH; x++) {
            let bell = exp(-0.5 * f32(x * x + y * y) / (SPREAD * SPREAD));
            let place = clamp(at + vec2i(x, y), vec2i(0), last); // clamped, so that the picture's edge draws no line
            share += bell * textureLoad(seen, place, 0).r;
            weight += bell;
        }
    }
    share /= weight;
    return vec4f(COLOUR, smoothstep(0.06, 0.3, share) * smoothstep(0.06, 0.3, 1.0 - share));
}
