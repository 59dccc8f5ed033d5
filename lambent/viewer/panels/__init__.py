"""Panels that more than one mode shows. Each draws the parts of a state that it is given."""
