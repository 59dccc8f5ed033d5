"""Light that answers edited colours, on a GPU: compute shaders for `lambent.core.answer`."""
