// Distances to the first surfaces around a lamp, in the disc of store/lamps.py, from depths on the faces of a cube.

#include "screen.wgsl"

struct ShadowDisc {
    scale: f32,  // sin(reach/2)
    near_m: f32, // depths are near_m / z
    focal: f32,  // z over the half width of a face: a little less than 1, so that texels at edges have neighbours
    none: f32,
}

@group(0) @binding(0) var<uniform> disc: ShadowDisc;
@group(0) @binding(1) var depths: texture_depth_2d_array; // faces as of a cube map, in the lamp's axes

const LAMP_FAR = 65504.0;

// The difference of a plane's depths from texel to texel, which is constant: the smaller one belongs to one surface.
fn slope_of(before: f32, here: f32, after: f32) -> f32 {
    let a = here - before;
    let b = after - here;
    return select(b, a, abs(a) < abs(b));
}

fn distance_along(d: vec3f) -> f32 {
    let a = abs(d);
    var face = select(5, 4, d.z > 0.0);
    var place = vec2f(select(-d.x, d.x, d.z > 0.0), -d.y) / max(a.z, 1e-12);
    var major = a.z;
    if (a.x >= a.y && a.x >= a.z) {
        face = select(1, 0, d.x > 0.0);
        place = vec2f(select(d.z, -d.z, d.x > 0.0), -d.y) / a.x;
        major = a.x;
    } else if (a.y >= a.z) {
        face = select(3, 2, d.y > 0.0);
        place = vec2f(d.x, select(-d.z, d.z, d.y > 0.0)) / a.y;
        major = a.y;
    }
    let size = f32(textureDimensions(depths).x);
    let at = (place * disc.focal * 0.5 + 0.5) * size - 0.5;
    let base = vec2i(round(at));
    let f = at - round(at);
    let here = textureLoad(depths, base, face, 0);
    if (here <= 0.0) { return LAMP_FAR; }
    let left = textureLoad(depths, base - vec2i(1, 0), face, 0);
    let right = textureLoad(depths, base + vec2i(1, 0), face, 0);
    let above = textureLoad(depths, base - vec2i(0, 1), face, 0);
    let below = textureLoad(depths, base + vec2i(0, 1), face, 0);
    let depth = here + f.x * slope_of(left, here, right) + f.y * slope_of(above, here, below);
    return min(disc.near_m / (max(depth, 1e-12) * major), LAMP_FAR);
}

@fragment fn lamp_shadow_main(v: Screen) -> @location(0) vec4f {
    let q = vec2f(v.clip.x, -v.clip.y);
    let s = q * disc.scale;
    let square = dot(s, s);
    if (square >= 1.0) { return vec4f(LAMP_FAR); }
    return vec4f(distance_along(vec3f(2.0 * s * sqrt(1.0 - square), 1.0 - 2.0 * square)));
}
