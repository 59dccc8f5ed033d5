// The nearest surface in each cell of a planar reflection buffer, for searches: cells of CELL_PX pixels a side from the planes seen,
// and each further level from 2 x 2 cells of the one before. A texel: the normal's octahedral form, N.q and 1/depth.

#include "screen.wgsl"
#include "directions.wgsl"
#include "planar_view.wgsl"

@group(0) @binding(0) var<uniform> mirrored: MirroredView;
@group(0) @binding(1) var finer: texture_2d<f32>;

@fragment fn first_cells_main(screen: Screen) -> @location(0) vec4f {
    let corner = vec2i(screen.position.xy) * CELL_PX;
    var found = vec4f(0.0, 0.0, 1.0, -1e4);
    var nearest = 0.0; // 1/depth
    for (var i = 0; i < CELL_PX * CELL_PX; i++) {
        let at = corner + vec2i(i % CELL_PX, i / CELL_PX);
        let plane = textureLoad(finer, at, 0);
        let here = dot(plane.xyz, mirrored_ray(vec2f(at) + 0.5)) / min(plane.w, -1e-6);
        found = select(found, plane, here > nearest);
        nearest = max(nearest, here);
    }
    return vec4f(octahedral(found.xyz), found.w, nearest);
}

@fragment fn cells_main(screen: Screen) -> @location(0) vec4f {
    let last = vec2i(textureDimensions(finer)) - 1;
    let corner = vec2i(screen.position.xy) * 2;
    var found = vec4f(0.0);
    for (var i = 0; i < 4; i++) {
        let other = textureLoad(finer, min(corner + vec2i(i & 1, i >> 1u), last), 0);
        found = select(found, other, other.w > found.w);
    }
    return found;
}
