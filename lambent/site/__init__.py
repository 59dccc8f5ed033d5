"""A baked store as a static web site: the renderer's frame and its data, for the WebGPU of a browser."""
