// Light through a thin piece of glass, refracted at entry and exit: see baked/light_fields/thin_glass.py.

const LEAST_COSINE = 0.1;
const SAME_FACE = 0.7;

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

// The face behind a place of the surface that is `step` away, as an exit of the first place; `exit` itself if that is
// another face.
fn exit_beside(exit: vec4f, beside: vec4f, step: vec3f, n: vec3f) -> vec4f {
    let along = dot(n, beside.xyz);
    let same = dot(exit.xyz, beside.xyz) > SAME_FACE * length(exit.xyz) * length(beside.xyz);
    if (!same || min(exit.w, beside.w) < 0.0 || along >= 0.0) { return exit; }
    return vec4f(beside.xyz, max(beside.w - dot(step, beside.xyz) / along, 0.0));
}

// The exit of a texel of the sample map, in the lower half of its texture.
fn exit_of(texel: vec2i) -> vec4f {
    let size = map_size();
    let bits = textureLoad(sample_map, clamp(texel, vec2i(0), size - 1) + vec2i(0, size.y), 0);
    return vec4f(unpack2x16float(bits.x | (bits.y << 16u)), unpack2x16float(bits.z | (bits.w << 16u)));
}

// The back face behind a point of the surface, interpolated between the four nearest texels; the nearest texel alone if
// one of them has none.
fn exit_at(uv2: vec2f) -> vec4f {
    let at = uv2 * field.grid - field.corner - 0.5;
    let low = vec2i(floor(at));
    let share = fract(at);
    let a = exit_of(low);
    let b = exit_of(low + vec2i(1, 0));
    let c = exit_of(low + vec2i(0, 1));
    let d = exit_of(low + 1);
    let between = mix(mix(a, b, share.x), mix(c, d, share.x), share.y);
    let nearest = exit_of(vec2i(floor(at + 0.5)));
    return select(nearest, between, min(min(a.w, b.w), min(c.w, d.w)) >= 0.0);
}

// The back face that a ray along `r` meets: behind the place above the exit that the face behind this place gives. A
// sheet where viewers see the surface from behind.
fn exit_near(place: OnMap, r: vec3f, n: vec3f, front: bool) -> vec4f {
    if (!GLASS) { return vec4f(0.0); }
    let exit = exit_at(place.uv2);
    let offset = through_glass(r, n, exit, field.eta).offset;
    let step = offset - dot(offset, n) * n;
    let beside = exit_at(place.uv2 + vec2f(dot(place.u, step), dot(place.v, step)));
    return select(vec4f(0.0, 0.0, 0.0, -1.0), exit_beside(exit, beside, step, n), front);
}
