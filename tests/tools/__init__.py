"""Reusable checks for tests: chi-square, furnace, reciprocity, shader parity, z-test."""
