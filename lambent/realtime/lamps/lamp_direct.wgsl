// Direct light of lamps at points, pixel by pixel, with shadow maps of distances: the light map holds it by texel, and
// gives it back. A loop for each branch: adapters in software skip loops of no turns alone.

#include "lamp_record.wgsl"
#include "lamp_light.wgsl"

override LAMPS: u32 = 0u;

@group(3) @binding(3) var<uniform> point_lamps: array<PointLamp, 64>;
@group(3) @binding(4) var<storage, read> lamp_profiles: array<f32>; // rows of radii, azimuth after azimuth
@group(3) @binding(5) var<storage, read> lamps_reach: array<vec2u>; // by texel of the light map, bits of lamps
@group(3) @binding(6) var lamp_distances: texture_2d_array<f32>;

const FRONT_OF_LAMPS = 4u; // layers of the light map
const BACK_OF_LAMPS = 5u;
const LAMP_RADII = 513u;
override LAMP_AZIMUTHS: u32 = 1u;
const LAMP_BIAS = 1e-3; // of a distance: half floats, and facets beside the tangent plane
const LAMP_NEAR = 1.5;  // texels: what is nearer to a surface is that surface

// Sums over lamps: irradiance on the viewer's side of the mesh, on the other, and by the normal of a normal map; and
// light through lobes.
struct OfLamps {
    here: vec3f,
    beyond: vec3f,
    bent: vec3f,
    specular: vec3f,
}

// Place in the unit disc, times sin(reach/2), of a direction in the lamp's axes.
fn in_disc(d: vec3f) -> vec2f {
    return d.xy * inverseSqrt(max(2.0 + 2.0 * d.z, 1e-12));
}

fn from_disc(s: vec2f) -> vec3f {
    let square = min(dot(s, s), 1.0);
    return vec3f(2.0 * s * sqrt(1.0 - square), 1.0 - 2.0 * square);
}

// Intensity over the largest one at q in the unit disc; 0 outside.
fn lamp_profile(number: u32, q: vec2f) -> f32 {
    let radius = length(q);
    let at = min(radius, 1.0) * f32(LAMP_RADII - 1u);
    let i = min(u32(at), LAMP_RADII - 2u);
    let f = at - f32(i);
    let rows = f32(LAMP_AZIMUTHS - 1u);
    let turn = (atan2(q.y, q.x) / (2.0 * LAMBENT_PI));
    let around = (turn - floor(turn)) * rows;
    let j = min(u32(around), max(LAMP_AZIMUTHS, 2u) - 2u);
    let first = (number * LAMP_AZIMUTHS + j) * LAMP_RADII + i;
    var found = mix(lamp_profiles[first], lamp_profiles[first + 1u], f);
    if (LAMP_AZIMUTHS > 1u) {
        let next = first + LAMP_RADII;
        found = mix(found, mix(lamp_profiles[next], lamp_profiles[next + 1u], f), around - f32(j));
    }
    return select(0.0, found, radius <= 1.0);
}

// Share of a lamp that is seen from a point at a distance along d, on a surface of normal n, both in the lamp's axes.
// The surface is compared where each texel's ray meets its tangent plane, and texels are weighted bilinearly.
fn lamp_visibility(lamp: u32, scale: f32, d: vec3f, distance_m: f32, n: vec3f) -> f32 {
    let size = vec2f(textureDimensions(lamp_distances));
    let place = (in_disc(d) / scale * 0.5 + 0.5) * size - 0.5;
    let base = floor(place);
    let f = place - base;
    let plane_m = dot(n, d) * distance_m;
    let near_m = LAMP_NEAR * 4.0 * scale / size.x * distance_m;
    var lit = vec4f(0.0);
    for (var k = 0u; k < 4u; k++) {
        let texel = clamp(base + vec2f(f32(k & 1u), f32(k >> 1u)), vec2f(0.0), size - 1.0);
        let towards = from_disc(((2.0 * texel + 1.0) / size - 1.0) * scale);
        let facing = dot(n, towards);
        let expected_m = select(distance_m, min(plane_m / facing, 2.0 * distance_m), facing * plane_m > 0.0);
        let found_m = textureLoad(lamp_distances, vec2i(texel), lamp, 0).r;
        lit[k] = select(0.0, 1.0, found_m >= min(expected_m * (1.0 - LAMP_BIAS), distance_m - near_m));
    }
    return mix(mix(lit.x, lit.y, f.x), mix(lit.z, lit.w, f.x), f.y);
}

// n: the mesh's normal on the viewer's side, flat: the triangle's, bent: by a normal map, all world space.
fn light_of_lamps(p_world: vec3f, uv2: vec2f, n: vec3f, flat_normal: vec3f, bent: vec3f, wo: vec3f, s: Surface) -> OfLamps {
    var sum = OfLamps(vec3f(0.0), vec3f(0.0), vec3f(0.0), vec3f(0.0));
    if (LAMPS == 0u) { return sum; }
    let size = vec2f(textureDimensions(light_maps));
    let texel = vec2u(clamp(uv2 * size, vec2f(0.0), size - 1.0));
    let reach = lamps_reach[texel.y * u32(size.x) + texel.x];
    for (var lamp = 0u; lamp < LAMPS; lamp++) {
        if (((reach[lamp >> 5u] >> (lamp & 31u)) & 1u) == 0u) { continue; }
        let it = point_lamps[lamp];
        let away = p_world - it.place.xyz;
        let square = max(dot(away, away), 1e-12);
        let distance_m = sqrt(square);
        let to_axes = transpose(mat3x3f(it.across.xyz, it.down.xyz, it.along.xyz));
        let d = to_axes * (away / distance_m);
        let profile = lamp_profile(u32(it.along.w), in_disc(d) / it.place.w);
        if (profile == 0.0) { continue; }
        let seen = lamp_visibility(lamp, it.place.w, d, distance_m, to_axes * flat_normal);
        if (seen == 0.0) { continue; }
        let light = seen * profile / square * it.intensity.rgb;
        let w = -away / distance_m;
        let facing = dot(n, w);
        sum.here += max(facing, 0.0) * light;
        sum.beyond += max(-facing, 0.0) * light;
        sum.bent += select(0.0, max(dot(bent, w), 0.0), facing > 0.0) * light;
        let wi = vec3f(dot(w, s.t), dot(w, s.b), dot(w, s.n));
        for (var i = 0u; i < LOBES; i++) {
            let lobe = lobe_here(i, s).lobe;
            if (!lobe_adds(lobe)) { continue; }
            sum.specular += light * lambent_lamp_response(lobe, wo, on_side(lobe, wi), vec3f(0.0), vec3f(0.0));
        }
    }
    return sum;
}
