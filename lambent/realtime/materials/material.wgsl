// A material's numbers and the textures that multiply them (group 1), in the order of KINDS in textures.py, which
// describes their texels.

// Bits of the textures to read: 1 diffuse, 2 specular, 4 roughness, 8 normal, 16 direction. A constant, so that missing
// textures cost nothing.
override TEXTURES: u32 = 0u;

struct Material {
    kd: vec4f, // w: 1 where the diffuse reflection is coupled to Fresnel
    kt_d: vec4f, // w: first row of the curve of kd in `samples`, or 0
    diffuse_scale: vec4f, // w: cutoff of opacity, below which is a hole
    specular_scale: vec4f,
    lie: array<vec4f, 12>, // two rows of each texture's uv transform
}

@group(1) @binding(0) var<uniform> material: Material;
@group(1) @binding(3) var texture_sampler: sampler;
@group(1) @binding(4) var diffuse_texture: texture_2d<f32>;
@group(1) @binding(5) var specular_texture: texture_2d<f32>;
@group(1) @binding(6) var roughness_texture: texture_2d<f32>;
@group(1) @binding(7) var normal_texture: texture_2d<f32>;
@group(1) @binding(8) var direction_texture: texture_2d<f32>;
@group(1) @binding(9) var opacity_texture: texture_2d<f32>;

// The values of the textures at a point.
struct Painted {
    diffuse: vec3f,  // factor of kd and kt_d
    specular: vec3f, // of k
    roughness: f32,  // of mx, my
    slope: vec2f,    // of the normal along t and b
    widening: vec2f, // twice the variance of slopes along t and b
    turn: vec2f,     // cosine and sine of the angle from t to the brushing direction
}

// Texel coordinates of a texture: v points up in both, rows go down.
fn place(kind: u32, uv: vec2f) -> vec2f {
    let p = vec3f(uv, 1.0);
    return vec2f(dot(material.lie[2u * kind].xyz, p), 1.0 - dot(material.lie[2u * kind + 1u].xyz, p));
}

// Halves the angle of a doubled direction, whose length averaging has shortened.
fn half_angle(doubled: vec2f) -> vec2f {
    let l = length(doubled);
    let c2 = select(1.0, clamp(doubled.x / max(l, 1e-6), -1.0, 1.0), l > 1e-6);
    let s = sqrt(0.5 - 0.5 * c2);
    return vec2f(sqrt(0.5 + 0.5 * c2), select(s, -s, doubled.y < 0.0));
}

const MOST_TAPS = 8.0;

// Mean over a pixel's footprint, an ellipse: as many taps along its major axis as minor axes fit. Samplers of anisotropy
// differ from adapter to adapter. Takes derivatives: call in uniform control flow.
fn filtered(image: texture_2d<f32>, at: vec2f) -> vec4f {
    let size = vec2f(textureDimensions(image));
    let x = dpdxFine(at) * size;
    let y = dpdyFine(at) * size;
    let square = vec3f(x.x * x.x + y.x * y.x, x.x * x.y + y.x * y.y, x.y * x.y + y.y * y.y);
    let apart = 0.5 * (square.x - square.z);
    let root = sqrt(apart * apart + square.y * square.y);
    let major = sqrt(0.5 * (square.x + square.z) + root);
    let minor = max(max(abs(x.x * y.y - x.y * y.x) / max(major, 1e-12), major / MOST_TAPS), 1.0);
    let along = select(vec2f(square.y, root - apart), vec2f(root + apart, square.y), apart > 0.0);
    let axis = major * along / max(length(along), 1e-12) / size;
    let taps = max(round(major / minor), 1.0);
    var sum = vec4f(0.0);
    for (var i = 0.5; i < taps; i += 1.0) {
        sum += textureSampleLevel(image, texture_sampler, at + (i / taps - 0.5) * axis, log2(minor));
    }
    return sum / taps;
}

// Takes derivatives: call in uniform control flow.
fn painted(uv: vec2f) -> Painted {
    var p = Painted(vec3f(1.0), vec3f(1.0), 1.0, vec2f(0.0), vec2f(0.0), vec2f(1.0, 0.0));
    if ((TEXTURES & 1u) != 0u) {
        p.diffuse = material.diffuse_scale.rgb * filtered(diffuse_texture, place(0u, uv)).rgb;
    }
    if ((TEXTURES & 2u) != 0u) {
        p.specular = material.specular_scale.rgb * filtered(specular_texture, place(1u, uv)).rgb;
    }
    if ((TEXTURES & 4u) != 0u) {
        p.roughness = filtered(roughness_texture, place(2u, uv)).r;
    }
    if ((TEXTURES & 8u) != 0u) {
        let s = filtered(normal_texture, place(3u, uv));
        p.slope = s.xy;
        p.widening = max(s.zw, vec2f(0.0));
    }
    if ((TEXTURES & 16u) != 0u) {
        p.turn = half_angle(filtered(direction_texture, place(4u, uv)).xy);
    }
    return p;
}

fn is_hole(uv: vec2f) -> bool {
    return filtered(opacity_texture, place(5u, uv)).r < material.diffuse_scale.w;
}

const SOLID = 0.95; // pixels of at least this coverage count as covered

// Share of a pixel that the surface covers. For texels larger than pixels, an edge one pixel wide at the cutoff; for
// smaller texels, the share that passes the cutoff. Takes derivatives.
fn coverage(uv: vec2f) -> f32 {
    let at = place(5u, uv);
    let opacity = filtered(opacity_texture, at).rg;
    let texels = vec2f(textureDimensions(opacity_texture));
    let texels_per_px = max(length(dpdx(at) * texels), length(dpdy(at) * texels));
    let slope = length(vec2f(dpdx(opacity.r), dpdy(opacity.r)));
    let edge = clamp((opacity.r - material.diffuse_scale.w) / max(slope, 1e-4) + 0.5, 0.0, 1.0);
    return mix(edge, opacity.g, smoothstep(0.5, 2.0, texels_per_px));
}
