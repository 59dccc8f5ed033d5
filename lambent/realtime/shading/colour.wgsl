// Colour: same functions as core/light/colour.py, the reference; a test compares the two.

const HALF_MAX = 65504.0; // the largest half float: brighter light is clamped to it

// Y of linear Rec.709 RGB.
fn luminance(rgb: vec3f) -> f32 {
    return dot(rgb, vec3f(0.2126, 0.7152, 0.0722));
}

// Filmic curve (Narkowicz 2015, a fit of the ACES reference transform).
fn filmic(c: vec3f) -> vec3f {
    let x = min(c, vec3f(1e4));
    return (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14);
}

// Light whose filmic value is `shown`, 0 to 1.
fn filmic_inverse(shown: vec3f) -> vec3f {
    let a = 2.43 * shown - 2.51;
    let b = 0.59 * shown - 0.03;
    return (-b - sqrt(b * b - 0.56 * a * shown)) / (2.0 * a);
}

// Khronos PBR Neutral (2024): colours below .76 are kept, highlights roll off and lose saturation.
fn neutral(c: vec3f) -> vec3f {
    let start = 0.76;
    let low = min(c.r, min(c.g, c.b));
    let offset = select(0.04, low - 6.25 * low * low, low < 0.08);
    let x = c - offset;
    let peak = max(x.r, max(x.g, x.b));
    if (peak < start) { return x; }
    let d = 1.0 - start;
    let new_peak = 1.0 - d * d / (peak + d - start);
    let g = 1.0 - 1.0 / (0.15 * (peak - new_peak) + 1.0);
    return mix(x * new_peak / peak, vec3f(new_peak), g);
}

// sRGB encoding of values in [0, 1].
fn srgb_encode(c: vec3f) -> vec3f {
    return select(1.055 * pow(c, vec3f(1.0 / 2.4)) - 0.055, 12.92 * c, c <= vec3f(0.0031308));
}
