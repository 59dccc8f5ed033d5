// Depth alone, at bit-identical positions to vertex.wgsl.

#include "frame.wgsl"

@vertex fn vertex_main(@location(0) position: vec3f) -> @invariant @builtin(position) vec4f {
    return frame.clip_from_world * vec4f(position, 1.0);
}
