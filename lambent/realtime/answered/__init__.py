"""Light that answers other colours on a GPU: what `lambent.core.answer` computes, by compute shaders."""
