// Depth of surfaces with holes.

#include "vertex.wgsl"
#include "material.wgsl"

@fragment fn mask_main(v: Varyings) {
    if (is_hole(v.uv)) { discard; }
}
