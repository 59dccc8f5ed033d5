"""Interreflections of an edited view: freezing of all objects but one, and the polynomial in what is left."""
