"""Interreflections of an edited view: all objects but one are frozen, which leaves a polynomial in its albedos."""
