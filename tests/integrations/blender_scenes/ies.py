"""IES files for tests."""

from __future__ import annotations

from pathlib import Path


def write_constant(path: Path, candela: float) -> None:
    """A luminaire without a size that shines equally in all directions."""
    row = f"{candela} {candela} {candela}"
    path.write_text(f"IESNA:LM-63-2002\n[TEST] constant\nTILT=NONE\n1 -1 1 3 1 1 2 0 0 0\n1 1 10\n0 90 180\n0\n{row}\n")
