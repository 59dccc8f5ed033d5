// Distance impostor (Szirmay-Kalos et al. 2005): marches along a direction to the surface that the probe sees.

@group(2) @binding(3) var inverse_depth_cube: texture_cube<f32>;

// 1/max(|x|, |y|, |z|) of the surface that the probe sees in a direction, 1/m.
fn inverse_depth(w: vec3f) -> f32 {
    return textureSampleLevel(inverse_depth_cube, linear_sampler, w, 0.0).r;
}

// Depth of the point relative to the surface that the probe sees in its direction: < 1 in front, > 1 behind.
fn relative_depth(p: vec3f) -> f32 {
    return max_norm(p) * inverse_depth(p);
}

// Growing steps along the ray until it is behind the seen surface, then secant steps. 1/depth is linear over planes, so
// hits on walls are exact.
fn incident_look_up(x: vec3f, w: vec3f) -> LookUp {
    const STEPS = 12u;
    var near = 0.0;
    var f_near = -1.0; // the start counts as in front of the seen surface
    let reach = 1.0 / max(inverse_depth(w), 1e-4);
    var far = max(length(x), 0.05 * reach);
    var f_far = -1.0;
    for (var i = 0u; i < STEPS; i++) {
        f_far = relative_depth(x + far * w) - 1.0;
        if (f_far >= 0.0) { break; }
        near = far;
        f_near = f_far;
        far *= 1.6;
    }
    if (f_far < 0.0) { return LookUp(w, 1.0); }
    for (var i = 0u; i < 3u; i++) {
        let t = mix(near, far, clamp(f_near / min(f_near - f_far, -1e-9), 0.05, 0.95));
        let f = relative_depth(x + t * w) - 1.0;
        if (f < 0.0) { near = t; f_near = f; } else { far = t; f_far = f; }
    }
    let t = mix(near, far, clamp(f_near / min(f_near - f_far, -1e-9), 0.0, 1.0));
    return LookUp(x + t * w, max(t, 1e-4));
}

fn incident_bound(x: vec3f, w: vec3f) -> f32 {
    return 0.0;
}
