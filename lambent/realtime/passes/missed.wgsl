// Sets the nearest depth at places with known light, so that only missed surfaces are drawn.

#include "screen.wgsl"
#include "places.wgsl"

@group(1) @binding(0) var steps: texture_2d<u32>;

override PLACE: u32;

@fragment fn missed_main(screen: Screen) -> @builtin(frag_depth) f32 {
    if (step_at(textureLoad(steps, vec2i(screen.position.xy), 0).r, PLACE) == MISSED) { discard; }
    return 1.0;
}
