// Layout of a light field in its textures (realtime/light_fields/light_field_atlas.py) and on the light map.

struct LightFieldRecord {
    side: u32,    // texels of a map's side
    tile: u32,    // texels of a tile's side on level 0
    places: u32,  // maps in a layer
    levels: u32,
    coarse: vec4u,      // texels of a tile's side on levels 1 to 4
    coarse_row: vec4u,  // first row of their tiles in a layer
    size: vec2f,  // of a layer, texels
    cell: vec2u,  // size of a map in the texture of distances
    corner: vec2f, // column and row of the sample map's first texel in its grid
    grid: vec2f,   // columns and rows of the grid
    tint: vec3f, // of an interface of glass at normal incidence
    eta: f32,      // its index of refraction
    power: f32,    // exponent of the cosine in its transmittance
    sky_texels: f32, // half the log2 of the sky's texels per unit area of the cube [-1, 1]^3
}
