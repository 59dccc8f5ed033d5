"""The measurements of the documentation, on this machine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from lambent.api.progress import Wanted, progress_of
from lambent.core.discovery import known
from lambent.core.extras import needing_extras


def run_bench(
    name: str,
    *,
    quick: bool = False,
    inputs: Sequence[str | Path] = (),
    output: str | Path | None = None,
    progress: Wanted = None,
    **sizes: Any,
) -> dict[str, Any]:
    """Run one of the benches of `lambent bench`.

    Parameters
    ----------
    name : str
        "fit", "direct-edit", "walk-cube", "oslf", ...; an unknown name lists all.
    quick : bool
        The same rows at a smaller size.
    inputs : sequence of str or Path
        Files to measure, for a bench that takes some.
    output : str or Path, optional
        File of finished rows, for bench card, which continues it.
    progress : bool or callable, optional
        As of `Table.fit`.
    **sizes
        Other sizes than those of this effort, such as width and height: fields of the bench's `Effort`.

    Returns
    -------
    dict
        bench, machine, inputs, `rows` (one dict each) and `summary`.

    Raises
    ------
    UserError
        If the bench, a size or an input is unknown.
    """
    from lambent.bench.registry import benches
    from lambent.bench.registry import run_bench as run

    with needing_extras(), progress_of(progress) as bar:
        found = benches()
        module = found[known("bench", name, found)]
        effort = module.QUICK if quick else module.FULL
        for size in sizes:
            known("size", size, vars(effort), field=name)
        file, read = None if output is None else Path(output), [Path(one) for one in inputs]
        return run(name, replace(effort, **sizes), inputs=read, output=file, progress=bar)
