// Light of planar reflectors: where a direction meets the scene, found in the planar reflection buffer (thesis M, 4.5.2).
// Appended to a shader of shade.wgsl; integrators bring integrate_planar(index, wo, s, place).
//
// Places are kept about the mirrored eye e: q = p - e. A plane is N towards e and N.q, both of the same texel.

#include "planar_view.wgsl"

@group(3) @binding(0) var<uniform> mirrored: MirroredView;
@group(3) @binding(1) var buffer_light: texture_2d<f32>;
@group(3) @binding(2) var buffer_planes: texture_2d<f32>;

@group(3) @binding(3) var reflector_light_maps: texture_2d_array<f32>; // `light_maps` of shade.wgsl, whose number is taken

const FARTHEST = 2e4; // m
const FADE_PX = 24.0; // beyond the edges of the buffer
const FLAT_COS = 0.998; // least cosine of the reflector's own normals: bevels beside them have the probe's light

// A pixel of a reflector: q, the plane seen in the mirror direction, the distance to it; x about the probe's centre.
struct Place {
    q: vec3f,
    seen: vec4f,
    t: f32,
    x: vec3f,
}

// Where a direction meets the scene: q, distance from the pixel, the plane there, texels of the buffer, and how far
// (0 to 1) the buffer can be trusted: 0 well outside it.
struct Hit {
    q: vec3f,
    t: f32,
    plane: vec4f,
    texel: vec2f,
    inside: f32,
}

fn plane_at(texel: vec2f) -> vec4f {
    return textureLoad(buffer_planes, vec2i(clamp(texel, vec2f(0.0), mirrored.size - 1.0)), 0);
}

// Distance to a plane along w, or `otherwise` where it is not met from its front.
fn meet(plane: vec4f, q: vec3f, w: vec3f, otherwise: f32) -> f32 {
    let closing = -dot(plane.xyz, w);
    let t = (dot(plane.xyz, q) - plane.w) / max(closing, 1e-6);
    return select(otherwise, min(t, FARTHEST), closing > 1e-4 && t > 1e-4);
}

// Texels (x, y) of the buffer, and depth.
fn project(q: vec3f) -> vec3f {
    let depth = dot(mirrored.row_w.xyz, q);
    let clip = vec2f(dot(mirrored.row_x.xyz, q), -dot(mirrored.row_y.xyz, q)) / max(depth, 1e-6);
    return vec3f((clip + 1.0) * 0.5 * mirrored.size, depth);
}

fn inside_image(projected: vec3f) -> f32 {
    let beyond = max(max(-projected.xy, projected.xy - mirrored.size), vec2f(0.0));
    return select(0.0, 1.0 - smoothstep(0.0, FADE_PX, max(beyond.x, beyond.y)), projected.z > 1e-6);
}

// Whether the buffer shows anything there: the mirrored eye sees nothing past the foot of a wall.
fn is_shown(plane: vec4f) -> bool {
    return dot(plane.xyz, plane.xyz) > 0.5;
}

fn place_of(v: Varyings, s: Surface, w_mirror: vec3f) -> Place {
    let q = v.p_world - mirrored.eye.xyz;
    let seen = plane_at(v.position.xy + mirrored.offset);
    return Place(q, seen, meet(seen, q, w_mirror, FARTHEST), s.x);
}

// Depth of what the buffer shows at a point's place, relative to the point's.
fn seen_depth(q: vec3f, plane: vec4f) -> f32 {
    return plane.w / min(dot(plane.xyz, q), -1e-6);
}

// The hit at distance t, or, where a wall is before it, that of the wall. The mirrored eye sees below walls, which end at
// the reflector: there a ray towards the foot of a wall seems to meet what is outside. What lies beyond a wall that the
// probe knows is believed where the buffer shows no wall in the plane, as in a window.
fn hit_within(place: Place, w: vec3f, t: f32, plane: vec4f) -> Hit {
    let nearness = incident_bound(place.x, w);
    let q_wall = place.q + w / max(nearness, 1.0 / FARTHEST);
    let wall = plane_at(project(q_wall).xy);
    let behind = t * nearness > 1.1 && seen_depth(q_wall, wall) < 1.05;
    let t_hit = select(t, 1.0 / max(nearness, 1.0 / FARTHEST), behind);
    let q = place.q + t_hit * w;
    let projected = project(q);
    var found = plane;
    if (behind) { found = wall; }
    return Hit(q, t_hit, found, projected.xy, select(0.0, inside_image(projected), is_shown(found)));
}

// Where a ray meets a plane.
struct Met {
    t: f32,
    plane: vec4f,
}

// The plane that the buffer shows where a ray is at the distance t.
fn plane_along(place: Place, w: vec3f, t: f32) -> vec4f {
    return plane_at(project(place.q + t * w).xy);
}

// The first guess: the plane seen in the mirror direction.
fn first_guess(place: Place, w: vec3f) -> Met {
    return Met(meet(place.seen, place.q, w, place.t), place.seen);
}

// The second: the plane seen where the first is met.
fn guessed(place: Place, w: vec3f) -> Met {
    let first = first_guess(place, w);
    let plane = plane_along(place, w, first.t);
    return Met(meet(plane, place.q, w, first.t), plane);
}

// The hit in three steps, without a search.
fn find_hit(place: Place, w: vec3f) -> Hit {
    let guess = guessed(place, w);
    return hit_within(place, w, guess.t, guess.plane);
}

fn buffer_sample(texel: vec2f, level: f32) -> vec3f {
    let wanted = clamp(level, 0.0, mirrored.levels - 1.0);
    let uv = clamp(texel, vec2f(0.5), mirrored.size - 0.5) / vec2f(textureDimensions(buffer_light)); // black beyond
    let found = textureSampleLevel(buffer_light, linear_sampler, uv, wanted);
    return found.rgb / max(found.a, 1e-3);
}

// Level at which a texel covers the solid angle of a sample: omega t^2/D^2 |N.v|/|N.wi| f^2/cos^3 texels, D and v from
// the mirrored eye, cos from the axis of its view.
fn level_of(hit: Hit, w: vec3f, half_log2_omega: f32) -> f32 {
    let d = length(hit.q);
    let cosine = dot(mirrored.row_w.xyz, hit.q) / d;
    let turned = abs(dot(hit.plane.xyz, hit.q)) / (d * max(abs(dot(hit.plane.xyz, w)), 1e-4));
    return half_log2_omega + log2(hit.t / d * mirrored.focal_px) + 0.5 * log2(clamp(turned, 0.1, 4.0))
        - 1.5 * log2(max(cosine, 1e-3));
}

// Tells pixels apart that cleaning must not mix: of other reflectors and materials, and with other lobes interleaved (the
// bits of `interleaved`). 1 to 1999.
fn surface_number(interleaved: u32) -> f32 {
    let l = lobes[0].lobe;
    let mixed = dot(l.k, vec3f(3.7, 7.1, 1.3)) + dot(l.r0, vec3f(5.3, 2.9, 11.1)) + dot(vec2f(l.mx, l.my), vec2f(17.3, 31.7));
    return 1.0 + floor(fract(mixed * 0.6180339 + mirrored.number * 0.2718 + f32(interleaved) * 0.3719) * 1999.0);
}

struct PlanarLight {
    @location(0) rough: vec4f, // see planar_layers.wgsl
    @location(1) sharp: vec4f,
}

@fragment fn planar_main(v: Varyings, @builtin(front_facing) front: bool) -> PlanarLight {
    let upright = dot(normalize(v.n_world), mirrored.plane.xyz);
    let view = normalize(frame.eye.xyz - v.p_world);
    // seen from right above, so that no normal is bent as those of rounded things are at grazing angles
    var s = shading_frame(v, select(-1.0, 1.0, upright > 0.0), mirrored.plane.xyz);
    // One comparison: software Vulkan (Mesa 22.3) crashes on further branches here.
    let height = abs(dot(mirrored.plane.xyz, v.p_world) + mirrored.plane.w);
    if (max(height - mirrored.tolerance, FLAT_COS - abs(upright)) > 0.0) { discard; }
    let e = layer_of(reflector_light_maps, select(BACK, FRONT, front), v.uv2).rgb;
    s = with_shares(s, reflector_light_maps, v.uv2, front, e);
    let wo = normalize(vec3f(dot(view, s.t), dot(view, s.b), max(dot(view, s.n), 1e-3)));
    let place = place_of(v, s, to_world(s, vec3f(-wo.xy, wo.z)));
    var result = PlanarLight(vec4f(0.0, 0.0, 0.0, min(place.t, HALF_MAX)), vec4f(0.0));
    var interleaved = 0u;
    for (var i = 0u; i < LOBES; i++) {
        let found = integrate_planar(i, wo, s, place);
        let elsewhere = !lobe_mirrors(lobes[i].lobe); // light from behind the plane or from the viewer: left to the probe
        let light = select(clamp(found.rgb, vec3f(0.0), vec3f(HALF_MAX)), vec3f(0.0), elsewhere);
        let rough = found.a > 0.0 && !elsewhere;
        result.rough += select(vec4f(0.0), vec4f(light, 0.0), rough);
        result.sharp += select(vec4f(light, 0.0), vec4f(0.0), rough);
        interleaved |= select(0u, 1u << i, rough);
    }
    result.sharp.a = surface_number(interleaved);
    return result;
}
