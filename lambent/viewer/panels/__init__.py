"""Panels shared by several modes. Each draws the parts of a state passed to it."""
