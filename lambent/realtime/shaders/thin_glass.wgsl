// Light through a thin piece of glass, refracted at entry and exit: see core/thin_glass.py.

const LEAST_COSINE = 0.1;

struct Through {
    offset: vec3f, // from the surface to the ray's exit from the glass
    w: vec3f,      // its direction there
    cosine: f32,   // to the second face's normal
    share: f32,    // of light that the faces beyond transmit
}

// Share of light that the second face and the faces beyond reflect, and so do not transmit.
fn mirrored_back(cosine: f32, share: f32, eta: f32, tint: vec3f) -> f32 {
    let r = (eta - 1.0) / (eta + 1.0);
    let mean = max(dot(tint, vec3f(1.0 / 3.0)), 1e-6);
    let colourless = min(log(1.0 - r * r) / min(log(mean), -1e-6), 1.0);
    return 1.0 - (1.0 - r * r) * lambent_under_fresnel(cosine) * pow(max(share, 1e-6), colourless);
}

// The ray w refracted at a face of normal n; mirrored under total reflection.
fn refracted_at(w: vec3f, n: vec3f, ratio: f32) -> vec3f {
    let cosine = -dot(w, n);
    let square = 1.0 - ratio * ratio * (1.0 - cosine * cosine);
    let through = ratio * w + (ratio * cosine - sqrt(max(square, 0.0))) * n;
    return select(w + 2.0 * cosine * n, through, square >= 0.0);
}

// `exit`: the second face's normal times the share, and its distance, which is below 0 for a sheet.
fn through_glass(w: vec3f, n: vec3f, exit: vec4f, eta: f32) -> Through {
    if (exit.w < 0.0) { return Through(vec3f(0.0), w, 1.0, 1.0); }
    let share = length(exit.xyz);
    let out = exit.xyz / max(share, 1e-6);
    let inside = refracted_at(w, n, 1.0 / eta);
    let away = max(-exit.w * dot(n, out) / max(dot(inside, out), LEAST_COSINE), 0.0);
    let leaving = refracted_at(inside, -out, eta);
    return Through(away * inside, leaving, abs(dot(leaving, out)), share);
}
