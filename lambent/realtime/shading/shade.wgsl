// Light of a pixel: emission, diffuse light from the light map, and lobes by the integrator assembled with this file.

#include "vertex.wgsl"
#include "surface.wgsl"
#include "dominant_direction.wgsl"
#include "part_share.wgsl"
#include "sun_light.wgsl"
#include "lamp_direct.wgsl"

@group(3) @binding(0) var light_maps: texture_2d_array<f32>;

const FRONT = 0u;     // irradiance on the side of the normal
const BACK = 1u;      // irradiance on the back
const DIRECTION = 2u; // dominant direction of the front's light, world space; 0 if unknown
const SHARES = 3u;    // a, b of the shares of the probe's light on the front

// Least cos_o. The albedo of a lobe with alpha > 0 grows without bound towards grazing angles, to several times 1 below
// a cosine of .1; measured tables also end at 84 degrees (GRAZING_DEG of materials/measured/protocol.py).
const GRAZING = 0.1;

// Tangent, bitangent and normal of the mesh. Guards against zero normals: one NaN would persist in the mean of a
// progressive series.
fn mesh_frame(v: Varyings) -> mat3x3f {
    let n = normalize(select(vec3f(0.0, 1.0, 0.0), v.n_world, dot(v.n_world, v.n_world) > 1e-12));
    let flat_t = rejection(v.t_world, n);
    let t = flat_t * inverseSqrt(max(dot(flat_t, flat_t), 1e-12));
    return mat3x3f(t, cross(n, t), n);
}

// The triangle's normal, by the differences between neighbouring pixels; n where they vanish.
fn flat_normal(v: Varyings, n: vec3f) -> vec3f {
    let found = cross(dpdx(v.p_world), dpdy(v.p_world));
    return select(n, normalize(found), dot(found, found) > 0.0);
}

// The place on the light map, by the differences between neighbouring pixels.
fn on_map(v: Varyings) -> OnMap {
    let across = dpdx(v.p_world);
    let down = dpdy(v.p_world);
    let flat_normal = cross(across, down);
    let area = max(dot(flat_normal, flat_normal), 1e-30);
    let a = cross(down, flat_normal) / area; // 1 along `across`, 0 along `down`
    let b = cross(flat_normal, across) / area;
    let u = dpdx(v.uv2);
    let w = dpdy(v.uv2);
    return OnMap(v.uv2, a * u.x + b * w.x, a * u.y + b * w.y);
}

// At silhouettes an interpolated normal may turn away from the viewer while the triangle faces the viewer. It is bent
// back along `view` until cos_o is GRAZING, so that frame, mirror direction and lobe agree.
fn shading_frame(v: Varyings, facing: f32, view: vec3f) -> Surface {
    let mesh = mesh_frame(v);
    var given = mesh[2] * facing;
    var brushed = v.t_world;
    var shown = painted(v.uv);
    if ((TEXTURES & 24u) != 0u) {
        given = normalize(mesh * vec3f(shown.slope, 1.0)) * facing;
        brushed = shown.turn.x * mesh[0] + shown.turn.y * mesh[1];
        let shares = shown.turn * shown.turn;
        shown.widening = vec2f(dot(shares, shown.widening), dot(shares.yx, shown.widening));
    }
    let n = normalize(given + max(GRAZING - dot(given, view), 0.0) * view);
    let along = rejection(brushed, n);
    let t = normalize(select(perpendicular(n), along, dot(along, along) > 1e-8));
    return Surface(t, cross(n, t), n, v.p_world - object.centre.xyz, vec2u(v.position.xy), shown, vec4f(0.0, 0.0, 0.0, 1.0), vec3f(0.0), points_near(v.uv2), exit_near(on_map(v), -view, n, facing > 0.0));
}

// Layers past the last are black.
fn layer_of(maps: texture_2d_array<f32>, layer: u32, uv2: vec2f) -> vec4f {
    let last = textureNumLayers(maps) - 1u;
    let found = textureSampleLevel(maps, linear_sampler, uv2, min(layer, last), 0.0);
    return select(vec4f(0.0), found, layer <= last);
}

fn light_map(layer: u32, uv2: vec2f) -> vec3f {
    return layer_of(light_maps, layer, uv2).rgb;
}

// The surface with its share of the probe's light: by direction if the light map has shares, else from its irradiance
// e.
fn with_shares(found: Surface, maps: texture_2d_array<f32>, uv2: vec2f, front: bool, e: vec3f) -> Surface {
    if ((object.sky_change.w > 0.5) & front) {
        var s = found;
        s.shares = layer_of(maps, SHARES, uv2).yzwx;
        return s;
    }
    return in_niche(found, e);
}

fn surface_light(v: Varyings, front: bool) -> vec3f {
    let view = normalize(frame.eye.xyz - v.p_world);
    var s = shading_frame(v, select(-1.0, 1.0, front), view);
    let wo = normalize(vec3f(dot(view, s.t), dot(view, s.b), dot(view, s.n)));

    let mesh = mesh_frame(v);
    let facing = dot(mesh[2], sun.towards.xyz) * select(-1.0, 1.0, front);
    let direct = sun.irradiance.rgb * sun_share(s);
    let e_front = light_map(FRONT, v.uv2);
    let e_back = light_map(BACK, v.uv2);
    var e_here = select(e_back, e_front, front);
    let e_beyond = select(e_front, e_back, front) + max(-facing, 0.0) * direct;
    var e_bent = e_here;
    var sun_cos = max(facing, 0.0);
    let side = select(-1.0, 1.0, front);
    var bent = mesh[2] * side;
    if ((TEXTURES & 8u) != 0u && front) {
        bent = normalize(mesh * vec3f(s.painted.slope, 1.0));
        e_bent = e_here * bent_share(light_map(DIRECTION, v.uv2), mesh[2], bent);
        sun_cos = select(0.0, max(dot(bent, sun.towards.xyz), 0.0), facing > 0.0);
    }
    if (LOBES > 0u) { s = with_shares(s, light_maps, v.uv2, front, e_bent); } // light without sun and lamps, as in probes
    let of_lamps = light_of_lamps(UnderLamps(v.p_world, mesh[2] * side, flat_normal(v, mesh[2]), bent, wo), v.uv2, s);
    e_bent += sun_cos * direct + of_lamps.bent;
    e_here += max(facing, 0.0) * direct + of_lamps.here;
    let diffuse = diffuse_light(wo.z, e_bent, e_beyond + of_lamps.beyond, s.painted);
    var emitted = object.emission.rgb;
    if ((object.emission.w > 0.5) & front) { emitted = radiance_of_opening(u32(object.emission.w) - 1u, view); }
    emitted = select(vec3f(0.0), emitted, front);

    let specular = specular_light(wo, s) + of_lamps.specular;
    let light = frame.show.x * (diffuse + emitted) + frame.show.y * specular + frame.show.w * e_here;
    return clamp(light, vec3f(0.0), vec3f(HALF_MAX));
}

@fragment fn shade_main(v: Varyings, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    return vec4f(part_share(v.p_world) * surface_light(v, front), 1.0);
}
