"""Rows of bench `card`: a module here with `ROWS`, {name: Row}, adds rows; see `row`."""
