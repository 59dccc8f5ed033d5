// The factor by cos_o that makes fixed samples exact under uniform light (albedo.py).

const FACTOR_ROWS = 8u; // FACTORS/4 of albedo.py

fn factor_at(first: u32, i: u32) -> f32 {
    return samples[first + i / 4u][i % 4u];
}

// Factors are given at cos_o = (i + 1/2)/(4 FACTOR_ROWS).
fn albedo_factor(first: u32, cos_o: f32) -> f32 {
    let last = f32(4u * FACTOR_ROWS - 1u);
    let at = clamp(cos_o * (last + 1.0) - 0.5, 0.0, last);
    let below = min(u32(at), 4u * FACTOR_ROWS - 2u);
    return mix(factor_at(first, below), factor_at(first, below + 1u), at - f32(below));
}
