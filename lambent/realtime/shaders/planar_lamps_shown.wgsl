// What each pixel of a mirrored view shows of emitting objects that are drawn there without their light: a channel for each.

#include "vertex.wgsl"

override CHANNEL: u32 = 0u;

@fragment fn planar_lamps_shown_main(v: Varyings, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    var shown = vec4f(0.0);
    shown[CHANNEL] = select(0.0, 1.0, front);
    return shown;
}
