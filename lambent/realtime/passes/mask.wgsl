// Depth of surfaces with holes.

#include "vertex.wgsl"
#include "material.wgsl"

@fragment fn mask_main(v: Varyings) {
    if (is_hole(v.uv)) { discard; }
}

// Partly covered pixels are drawn later, by fringe.wgsl.
@fragment fn solid_main(v: Varyings) {
    if (coverage(v.uv) < SOLID) { discard; }
}
