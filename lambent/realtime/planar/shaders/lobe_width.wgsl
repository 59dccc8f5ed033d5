// Width of a lobe about its mirror direction.

// Half-widths (minor, major) in radians: an ellipse. Slopes m turn the mirror direction by 2 m in the plane of
// incidence and by 2 m cos_o across it.
fn lobe_half_widths(lobe: LambentLobe, wo: vec3f) -> vec2f {
    let e = wo.xy * inverseSqrt(max(dot(wo.xy, wo.xy), 1e-12));
    let m2 = lobe.spread * lobe.spread * vec2f(lobe.mx * lobe.mx, lobe.my * lobe.my);
    let along = dot(m2, e * e);
    let across = dot(m2, e.yx * e.yx) * wo.z * wo.z;
    let area = lobe.spread * lobe.spread * lobe.mx * lobe.my * wo.z;
    let middle = 0.5 * (along + across);
    let major2 = middle + sqrt(max(middle * middle - area * area, 0.0));
    return 2.0 * vec2f(area * inverseSqrt(max(major2, 1e-12)), sqrt(major2));
}

// Pixels that an angle covers in the mirrored view, for a reflected point `t` behind a pixel that is `away` from the
// eye.
fn pixels_of(angle: f32, focal_px: f32, t: f32, away: f32) -> f32 {
    return angle * focal_px * t / (t + away);
}
