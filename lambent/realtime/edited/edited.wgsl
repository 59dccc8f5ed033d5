// Common code of the shaders of edited pictures (lambent.realtime.edited): a piece of a layer's pixels.

struct Piece {
    first: u32,  // pixel of the layer
    pixels: u32,
    words: u32,  // in a row of transport, two pixels each
}

@group(1) @binding(0) var<uniform> piece: Piece;
