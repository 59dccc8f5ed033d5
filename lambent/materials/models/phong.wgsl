fn lambent_phong(wi: vec3f, wo: vec3f, exponent: f32) -> f32 {
    let cosine = max(dot(wi, vec3f(-wo.xy, wo.z)), 0.0);
    let value = (exponent + 2.0) / (2.0 * 3.14159265358979) * pow(cosine, exponent);
    return select(0.0, value, wi.z * wo.z > 0.0 && cosine > 0.0);
}
