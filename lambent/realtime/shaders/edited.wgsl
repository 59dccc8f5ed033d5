// What every shader of edited pictures knows (lambent.realtime.edited): a piece of a layer's pixels.

struct Piece {
    first: u32,  // pixel of the layer
    pixels: u32,
    words: u32,  // of two pixels, in a row of transport
}

@group(1) @binding(0) var<uniform> piece: Piece;
