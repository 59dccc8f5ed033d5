// Bounding planes: a direction ends at the nearest of the planes around the object (thesis M, 4.4.1).

@group(2) @binding(3) var<storage, read> planes: array<vec4f>; // n and n.c + d, about the probe's centre c

override PLANES: u32 = 0u;
const PLANE_ACTIVE_M = 1e-6; // planes nearer to a point than this, or in front of it, are ignored

// 1 over the distance of a ray from x to the nearest of the planes that x is inside of, the largest approach/height; 0
// without a hit. The reciprocal heights are the same for all samples of a pixel, so the compiler hoists them.
fn incident_bound(x: vec3f, w: vec3f) -> f32 {
    var nearness = 0.0;
    for (var i = 0u; i < PLANES; i++) {
        let plane = planes[i];
        let height = dot(plane.xyz, x) + plane.w;
        nearness = max(nearness, -dot(plane.xyz, w) * select(0.0, 1.0 / height, height > PLANE_ACTIVE_M));
    }
    return nearness;
}

fn incident_look_up(x: vec3f, w: vec3f) -> LookUp {
    let nearness = incident_bound(x, w);
    if (nearness < 1e-6) { return LookUp(w, 1.0); }
    return LookUp(x + w / nearness, 1.0 / nearness);
}
