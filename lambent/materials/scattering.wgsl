// Density, samples and tint of a lobe, which may read its curves; lobes.py and slope_curve.py are the reference. Needs
// lobes.wgsl, and a function lambent_row(i: u32) -> vec4f with the rows of slope_curve.curve_rows.

override LAMBENT_CURVES: bool = false; // a constant, so that curves cost other lobes nothing

const LAMBENT_CORE: f32 = 0.25; // CORE and STEP of slope_curve.py
const LAMBENT_STEP: f32 = 0.3;
const LAMBENT_SHAPE_NODES: u32 = 32u;
const LAMBENT_COSINE_NODES: u32 = 8u;

// ln of the density of slopes at the squared radius slope2, in units of (mx, my); 0 at the centre of Beckmann and GGX.
fn lambent_log_density(slope2: f32, lobe: LambentLobe) -> f32 {
    let log_one = log(1.0 + slope2);
    if LAMBENT_CURVES && lobe.distribution == LAMBENT_CURVE {
        let node = min(u32(asinh(sqrt(slope2) / LAMBENT_CORE) / LAMBENT_STEP), LAMBENT_SHAPE_NODES - 1u);
        let row = lambent_row(lobe.shape_row + node);
        return row.x + row.y * (log_one - row.w);
    }
    return select(-slope2, -2.0 * log_one, lobe.distribution == LAMBENT_GGX);
}

// Microfacet density D(h) in 1/sr: Beckmann (3.3), anisotropic GGX, or a curve.
fn lambent_distribution(h: vec3f, lobe: LambentLobe) -> f32 {
    let hz2 = max(h.z * h.z, 1e-12);
    let slope = h.xy / vec2f(lobe.mx, lobe.my);
    return exp(lambent_log_density(dot(slope, slope) / hz2, lobe)) / (LAMBENT_PI * lobe.mx * lobe.my * hz2 * hz2);
}

// Radius of slopes, in units of (mx, my), inside which a share of the curve lobe lies.
fn lambent_quantile(share: f32, lobe: LambentLobe) -> f32 {
    var node = 0u;
    for (var half = LAMBENT_SHAPE_NODES / 2u; half > 0u; half /= 2u) {
        node += select(0u, half, lambent_row(lobe.shape_row + node + half).z <= share);
    }
    let row = lambent_row(lobe.shape_row + node);
    let grown = 1.0 + (share - row.z) * (row.y + 1.0) * exp(-row.x - row.w);
    return sqrt(max(exp(row.w + log(max(grown, 1e-7)) / (row.y + 1.0)) - 1.0, 0.0));
}

// h with density D(h) h.z from u in [0, 1)^2 (4.5, 4.6), in slopes.
fn lambent_sample_half_vector(u: vec2f, lobe: LambentLobe) -> vec3f {
    let u1 = min(u.x, 1.0 - 1e-7);
    var r = sqrt(select(-log(1.0 - u1), u1 / (1.0 - u1), lobe.distribution == LAMBENT_GGX));
    if LAMBENT_CURVES && lobe.distribution == LAMBENT_CURVE {
        r = lambent_quantile(u1, lobe);
    }
    let phi = 2.0 * LAMBENT_PI * u.y;
    return lambent_from_slopes(r * vec2f(lobe.mx * cos(phi), lobe.my * sin(phi)));
}

// RGB at a cosine in [0, 1] of a curve of evenly spaced nodes, whose rows begin at `first`; w: (1 - cosine)^5 there.
fn lambent_at_cosine(first: u32, cosine: f32) -> vec3f {
    let c = clamp(cosine, 0.0, 1.0);
    let node = min(u32(c * f32(LAMBENT_COSINE_NODES - 1u)), LAMBENT_COSINE_NODES - 2u);
    let low = lambent_row(first + node);
    let high = lambent_row(first + node + 1u);
    let m = 1.0 - c;
    let m2 = m * m;
    return mix(low.rgb, high.rgb, (low.w - m2 * m2 * m) / (low.w - high.w));
}

// k times Fresnel: F for reflection (3.4), 1 - F for transmission (3.5).
fn lambent_tint(cos_d: f32, lobe: LambentLobe) -> vec3f {
    var f = lambent_fresnel(cos_d, lobe.r0);
    if LAMBENT_CURVES && lobe.fresnel_row > 0u {
        f = lambent_at_cosine(lobe.fresnel_row, cos_d);
    }
    return lobe.k * select(f, 1.0 - f, lobe.side == LAMBENT_TRANSMISSION);
}
