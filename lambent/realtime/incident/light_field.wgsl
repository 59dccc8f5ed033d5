// Offset surface light fields: the points nearest to a pixel, by the sample map, each with a map of light and inverse
// distance, through which rays march, as in baked/light_fields/lookup.py. Positions are in world space.

#include "frame.wgsl"
#include "light_field_record.wgsl"
#include "thin_glass.wgsl"
#include "light_field_maps.wgsl"

@group(2) @binding(3) var<uniform> field: LightFieldRecord;
// Positions of points, and their maps' places in the atlas. Software adapters read textures faster than buffers.
@group(2) @binding(4) var points: texture_2d<f32>;
@group(2) @binding(5) var atlas: texture_2d_array<f32>;
@group(2) @binding(6) var distances: texture_2d_array<u32>;
@group(2) @binding(7) var sample_map: texture_2d<u32>;
@group(2) @binding(8) var sky_cube: texture_cube<f32>;

override CHOICE: bool = false; // shows which points are used
override STEPS: u32 = 8u; // see March of light_field_lookup.py
override SECANTS: u32 = 3u;
override FIRST: f32 = 0.15;
override LAST: f32 = 1.0;
override TOLERANCE: f32 = 0.15;
override ALIKE: f32 = 0.15;
override STEEPNESS: f32 = 3.0;
override HAS_SKY: bool = true; // a separate sky; else the maps hold the sky

override RELIT: bool = false; // the cube map holds the ratio of the light to the light in the maps
override GLASS: bool = false; // transmitted light is refracted; the lower half of the sample map holds the exits

const NO_POINT = 0xffffu;

fn points_near(uv2: vec2f) -> vec4u {
    let texel = vec2i(floor(uv2 * field.grid - field.corner));
    return textureLoad(sample_map, clamp(texel, vec2i(0), map_size() - 1), 0);
}

fn map_size() -> vec2i {
    let size = vec2i(textureDimensions(sample_map));
    return select(size, vec2i(size.x, size.y / 2), GLASS);
}

fn place_of_point(point: u32) -> vec3f {
    return textureLoad(points, vec2u(point & 255u, point >> 8u), 0).xyz;
}

fn light_of_sky(w: vec3f, half_log2_omega: f32) -> vec3f {
    let level = max(half_log2_omega - 1.5 * log2(max_norm(w)) + field.sky_texels, 0.0);
    return textureSampleLevel(sky_cube, linear_sampler, w, level).rgb;
}

const BLUR_TEXELS = 9.0; // about how far linear look-ups in a map, and errors of a march, spread light

// Ratio of the light from distance 1/u along r to the baked light, as the probe sees it there. It is averaged as far as
// the map spreads light: next to a lamp that is now off, the map holds some of the lamp's light.
fn change_along(s: Surface, r: vec3f, u: f32, half_log2_omega: f32) -> vec3f {
    if (!RELIT) { return vec3f(1.0); }
    let q = r + u * s.x;
    let major = max_norm(q);
    let stretch = length(q) / (major * major * major);
    let spread = 0.5 * log2(4.0 * LAMBENT_PI * BLUR_TEXELS) - log2(f32(field.side));
    let finest = 0.5 * log2(max(stretch, 1e-20)) + object.centre.w;
    let here = textureSampleLevel(radiance_cube, linear_sampler, q, max(half_log2_omega + finest, 0.0)).rgb;
    let around = textureSampleLevel(radiance_cube, linear_sampler, q, max(max(half_log2_omega, spread) + finest, 0.0)).rgb;
    return min(here, around);
}

// Cosine between the normal and the direction from x to a point; -2 without a point.
fn cosine_to(point: u32, n: vec3f, x: vec3f) -> f32 {
    let to = place_of_point(min(point, NO_POINT - 1u)) - x;
    return select(dot(n, to) * inverseSqrt(max(dot(to, to), 1e-30)), -2.0, point == NO_POINT);
}

fn largest_of(v: vec4f) -> f32 {
    return max(max(v.x, v.y), max(v.z, v.w));
}

// Weights B_n (4.9) of the points: the fourth power of the cosines between the directions to them and the normal,
// relative to the largest; equal if all points are behind. Written out, like all code for four points: software adapters
// are slow at arrays.
fn point_weights(s: Surface) -> vec4f {
    let x = s.x + object.centre.xyz;
    let p = s.points;
    let cosines = max(
        vec4f(cosine_to(p.x, s.n, x), cosine_to(p.y, s.n, x), cosine_to(p.z, s.n, x), cosine_to(p.w, s.n, x)), vec4f(0.0)
    );
    let largest = largest_of(cosines);
    if (largest <= 0.0) { return select(vec4f(1.0), vec4f(0.0), p == vec4u(NO_POINT)); }
    let relative = cosines / largest;
    return relative * relative * relative * relative;
}

// 1 for the first largest of four scores, 0 for the others.
fn first_largest(scores: vec4f) -> vec4f {
    let largest = vec4<bool>(scores == vec4f(largest_of(scores)));
    let before = vec4<bool>(false, largest.x, largest.x || largest.y, largest.x || largest.y || largest.z);
    return select(vec4f(0.0), vec4f(1.0), largest & !before);
}

// Weighted light of the points along w[j] = r + u[j] (x - p_j); u is 0 without parallax. Rays with one weight leave the
// loop after one iteration: software adapters run both sides of a branch, but skip iterations that all pixels have
// left. `focused` look-ups also weigh points by focus_along, and limit their light to the second largest, by channel:
// what one point alone sees on a surface is a highlight in its direction, or noise.
fn weighted(s: Surface, r: vec3f, u: vec4f, weights: vec4f, half_log2_omega: f32, focused: bool) -> vec3f {
    let x = s.x + object.centre.xyz;
    var left = weights;
    var light = vec4f(0.0);
    var largest = vec3f(-1.0);
    var second = vec3f(-1.0);
    var weight_of_largest = vec3f(0.0);
    loop {
        let one = first_largest(left);
        let point = u32(dot(select(vec4f(0.0), vec4f(s.points), one > vec4f(0.0)), vec4f(1.0)));
        let q = r + dot(one, u) * (x - place_of_point(point));
        // omega t^2/|q t|^2, as the point sees it
        let weight = dot(one, weights) * select(1.0, focus_along(q), focused);
        let seen = light_of(point, q, half_log2_omega - 0.5 * log2(dot(q, q)));
        let is_largest = seen > largest;
        second = select(max(second, seen), largest, is_largest);
        weight_of_largest = select(weight_of_largest, vec3f(weight), is_largest);
        largest = max(largest, seen);
        light += weight * vec4f(seen, 1.0);
        left *= 1.0 - one;
        if (largest_of(left) <= 0.0) { break; }
    }
    let lone = select(vec3f(0.0), weight_of_largest * (largest - second), second >= vec3f(0.0));
    return (light.rgb - select(vec3f(0.0), lone, focused)) / light.a;
}

const SHARP = -20.0; // half the log2 of a solid angle smaller than any texel

const SKY = 0.0;
const MISSED = -1.0;

struct Behind {
    g: f32,
    at_edge: bool, // the texel also shows the sky
}

struct MarchEnd {
    u: f32,        // inverse distance, 1/m, along the ray; SKY or MISSED
    at_edge: bool, // the point sees the sky there, or nearby
}

struct Found {
    u: vec4f, // of each point's MarchEnd
    at_edge: bool,
}

// How far a ray from o, relative to the map's point, along r is behind the map's surface at distance 1/u: 1/m, < 0 in
// front. Linear in u for planes, and finite at infinity.
fn behind(map: Map, o: vec3f, r: vec3f, u: f32) -> Behind {
    let q = r + u * o;
    let texel = texel_along(map, q);
    return Behind(texel.inverse - u * inverseSqrt(dot(q, q)), texel.cover != 15u);
}

// The ray's hit on the map's surface. Steps grow from FIRST times the distance of the point to the distance where the
// parallax is LAST texels of about 4/side rad, and end at infinity.
fn marched(point: u32, o: vec3f, r: vec3f) -> MarchEnd {
    let map = map_of(point);
    let texel = 4.0 / f32(field.side);
    let growth = pow(FIRST * texel / LAST, 1.0 / f32(STEPS - 1u));
    var near = 1.0 / (max(length(o), 1e-9) * FIRST);
    var g_near = behind(map, o, r, near).g;
    var far = near;
    var g_far = g_near;
    var crossed = false;
    for (var i = 1u; i <= STEPS && !crossed; i++) {
        near = far;
        g_near = g_far;
        far = select(near * growth, 0.0, i == STEPS);
        g_far = behind(map, o, r, far).g;
        crossed = g_near < 0.0 && (g_far > 0.0 || (g_far == 0.0 && i < STEPS));
    }
    if (!crossed) { return MarchEnd(select(MISSED, SKY, g_far <= 0.0), g_far <= 0.0); }
    var u = far;
    var last: Behind;
    for (var i = 0u; i < SECANTS; i++) {
        u = mix(near, far, clamp(g_near / min(g_near - g_far, -1e-30), 0.05, 0.95));
        last = behind(map, o, r, u);
        if (last.g < 0.0) { near = u; g_near = last.g; } else { far = u; g_far = last.g; }
    }
    // |q|/d - 1 is g |r + u o|/u, and |q|/t is |r + u o|
    let stretch = length(r + u * o);
    let hit = u > 0.0 && abs(last.g) * stretch * max(stretch, 1.0) < TOLERANCE * u;
    return MarchEnd(select(MISSED, u, hit), hit && last.at_edge);
}

fn found_by_points(s: Surface, r: vec3f) -> Found {
    let x = s.x + object.centre.xyz;
    var found = Found(vec4f(MISSED), false);
    for (var j = 0u; j < 4u; j++) {
        if (s.points[j] == NO_POINT) { continue; }
        let hit = marched(s.points[j], x - place_of_point(s.points[j]), r);
        found.u[j] = hit.u;
        found.at_edge |= hit.at_edge;
    }
    return found;
}

// Whether rays without a found surface end in the sky: for narrow bundles, if one point sees the sky; for wide bundles,
// whose edges lie beside the ray, if all points do.
fn is_sky(s: Surface, found: vec4f, half_log2_omega: f32) -> bool {
    let none = s.points == vec4u(NO_POINT);
    return largest_of(found) == SKY && (is_narrow(half_log2_omega) || all(none | (found == vec4f(SKY))));
}

// Whether a bundle of rays is narrower than a texel.
fn is_narrow(half_log2_omega: f32) -> bool {
    return half_log2_omega + log2(0.5 * f32(field.side)) < 0.0;
}

// Light of a surface at x as points with weights see it, and its share before the sky: by the points' mean coverage,
// between quarters of texels, made steeper.
fn edge_at(s: Surface, x: vec3f, weights: vec4f) -> vec4f {
    var light = vec3f(0.0);
    var shows = 1e-20;
    var sum = vec2f(0.0, 1e-9); // of shares, and number of points
    for (var j = 0u; j < 4u; j++) {
        if (s.points[j] == NO_POINT) { continue; }
        let q = x - place_of_point(s.points[j]);
        let edge = edge_along(map_of(s.points[j]), q);
        let weight = weights[j] * focus_along(q);
        light += weight * edge.light;
        shows += weight * edge.shows;
        sum += vec2f(edge.share, 1.0);
    }
    return vec4f(light / shows, saturate((sum.x / sum.y - 0.5) * STEEPNESS + 0.5));
}

// Light of the nearest surface that a point verifies, blended over the points that agree on it. If no point verifies a
// surface, the ray ends in the sky if is_sky, else the result is B_n.
fn marched_light(s: Surface, r: vec3f, half_log2_omega: f32) -> vec3f {
    let found = found_by_points(s, r);
    var sky = vec3f(0.0);
    if (HAS_SKY) { sky = light_of_sky(r, half_log2_omega) * object.sky_change.rgb; }
    if (HAS_SKY && is_sky(s, found.u, half_log2_omega)) { return sky; }
    let nearest = max(largest_of(found.u), 0.0);
    let is_sharp = nearest > 0.0 && is_narrow(half_log2_omega);
    let weights = weights_of_found(s, found.u);
    let hits = max(found.u, vec4f(0.0));
    var light = vec4f(weighted(s, r, hits, weights, half_log2_omega, is_sharp), 1.0);
    // a loop, which software adapters leave before its first turn where they would take both sides of a branch
    var at_edge = HAS_SKY && QUARTERS && found.at_edge && is_sharp;
    for (; at_edge; at_edge = false) {
        light = edge_at(s, s.x + object.centre.xyz + r / nearest, weights);
    }
    return mix(sky, light.rgb * change_along(s, r, nearest, half_log2_omega), light.a);
}

// Weights of the points that agree on the nearest surface; of all points if none has found one.
fn weights_of_found(s: Surface, found: vec4f) -> vec4f {
    let nearest = largest_of(found);
    let agree = (found > vec4f(0.0)) & (found * (1.0 + ALIKE) >= vec4f(nearest));
    let weights = point_weights(s);
    return select(weights, select(vec4f(0.0), max(weights, vec4f(1e-6)), agree), nearest > 0.0);
}

// The result in colours of medium brightness: one colour per point, for the point of largest share; blue for the sky;
// red if no point verifies a surface.
fn chosen(s: Surface, r: vec3f) -> vec3f {
    let found = found_by_points(s, r).u;
    var colour = vec3f(1.0, 0.0, 0.0);
    if (largest_of(found) == SKY) { colour = vec3f(0.0, 0.1, 1.0); }
    if (largest_of(found) > 0.0) {
        let point = dot(first_largest(weights_of_found(s, found)), vec4f(s.points));
        colour = 0.2 + 0.6 * fract(point * vec3f(0.618034, 0.754878, 0.569840));
    }
    return 0.3 * colour / frame.exposure;
}

// Light through the glass, from the exits of rays, and light that its further faces reflect.
fn light_through_glass(s: Surface, r: vec3f, half_log2_omega: f32) -> vec3f {
    let found = through_glass(r, s.n, s.exit, field.eta);
    var beyond = s;
    beyond.x += found.offset;
    let straight = light_along(beyond, found.w, half_log2_omega);
    if (s.exit.w < 0.0) { return straight; }
    let passed = found.share * field.tint * lambent_under_fresnel(found.cosine)
        * pow(max(found.cosine, LAMBENT_COS_MIN), field.power);
    let mirrored = mirrored_back(found.cosine, found.share, field.eta, field.tint) * field.tint;
    return passed * straight + mirrored * light_along(s, reflect(r, s.n), half_log2_omega);
}

fn incident_along(s: Surface, r: vec3f, half_log2_omega: f32) -> vec3f {
    if (GLASS && dot(r, s.n) < 0.0) { return light_through_glass(s, r, half_log2_omega); }
    return light_along(s, r, half_log2_omega);
}

fn light_along(s: Surface, r: vec3f, half_log2_omega: f32) -> vec3f {
    if (CHOICE) { return chosen(s, r); }
    return marched_light(s, r, half_log2_omega);
}

fn incident(s: Surface, w: vec3f, half_log2_omega: f32) -> vec3f {
    return incident_along(s, to_world(s, w), half_log2_omega);
}

// The prefiltered level of a probe has the roughness m with m^2 = level/6; a lobe of that m fills about 4 pi m^2 sr.
fn incident_at_level(s: Surface, w: vec3f, level: f32) -> vec3f {
    return incident(s, w, 0.5 * log2(4.0 * LAMBENT_PI) + log2(max(level / 6.0, 1e-6)) * 0.5);
}

fn incident_ray(s: Surface, w: vec3f) -> vec3f {
    return incident(s, w, SHARP);
}

fn incident_look_up(x: vec3f, w: vec3f) -> LookUp {
    return LookUp(w, 1.0);
}

fn incident_bound(x: vec3f, w: vec3f) -> f32 {
    return 0.0;
}
