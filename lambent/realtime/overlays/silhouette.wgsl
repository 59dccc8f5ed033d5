// Mask of an object's visible pixels: drawn at the depths of the depth pass.

#include "vertex.wgsl"

@fragment fn silhouette_main(v: Varyings) -> @location(0) f32 { return 1.0; }
