// Distance impostor (Szirmay-Kalos et al. 2005): marches along a direction to the surface that the probe sees.

@group(2) @binding(3) var inverse_depth_cube: texture_cube<f32>;

// 1/max(|x|, |y|, |z|) of the surface that the probe sees in a direction, 1/m.
fn inverse_depth(w: vec3f) -> f32 {
    return textureSampleLevel(inverse_depth_cube, linear_sampler, w, 0.0).r;
}

// How far a ray from |x| = reach is behind the surface that the probe sees: < 0 in front. q = (1 - s) x/|x| + s w.
// Linear in s over planes, so hits on walls are exact.
fn behind(reach: f32, q: vec3f, w: vec3f, s: f32) -> f32 {
    let size = max_norm(q);
    return reach * size * inverse_depth(select(w, q, size > 0.0)) - (1.0 - s);
}

// Steps along the ray, equal in s as the probe sees it, until it first passes behind the seen surface; then secant
// steps. A ray that starts behind surfaces counts from where it comes out.
fn incident_look_up(x: vec3f, w: vec3f) -> LookUp {
    const STEPS = 16u;
    let reach = length(x);
    let start = x / max(reach, 1e-9);
    var near = 0.0;
    var f_near = 0.0;
    var far = 0.0;
    var f_far = behind(reach, start, w, 0.0);
    var met = false;
    for (var i = 0u; i < STEPS && !met; i++) {
        near = far;
        f_near = f_far;
        far = f32(i + 1u) / f32(STEPS);
        f_far = behind(reach, mix(start, w, far), w, far);
        met = f_near < 0.0 && f_far >= 0.0;
    }
    if (!met) { return LookUp(w, 1.0); }
    for (var i = 0u; i < 3u; i++) {
        let s = mix(near, far, clamp(f_near / min(f_near - f_far, -1e-9), 0.05, 0.95));
        let f = behind(reach, mix(start, w, s), w, s);
        if (f < 0.0) { near = s; f_near = f; } else { far = s; f_far = f; }
    }
    let s = mix(near, far, clamp(f_near / min(f_near - f_far, -1e-9), 0.0, 1.0));
    let t = max(reach * s / max(1.0 - s, 1e-6), 1e-4);
    return LookUp(x + t * w, t);
}

fn incident_bound(x: vec3f, w: vec3f) -> f32 {
    return 0.0;
}
