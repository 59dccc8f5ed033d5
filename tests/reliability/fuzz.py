"""Coverage-guided fuzzing of the readers: broken files whose traces through the code are new breed the next ones.

    python -m tests.reliability.fuzz --reader EULUMDAT --minutes 10

Every sound file of the readers whose name holds NAME has its own process and an equal share of the processor's minutes.
atheris, where it is installed, guides by branches of `lambent`; otherwise hypothesis draws mutations, guided by what
readers say. Files with something new are kept in `--corpus`, where the next run begins. Faults are those of `mutate`,
and a process that ends; each is kept.
"""

from __future__ import annotations

import argparse
import faulthandler
import importlib
import importlib.util
import json
import os
import re
import resource
import shutil
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import asdict
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
CORPUS = ROOT / "out/fuzz"
OF_STRUCTURE = 0.5  # share of mutations that know the file's structure; the others are libFuzzer's
MOST_LENGTHS = 4  # of the sound file, and at least 4096 bytes
REPORT_S = 2.0
INSTRUMENTED = ("lambent.core", "lambent.materials", "lambent.scenes", "lambent.store", "lambent.published",
                "lambent.editing.session")  # fmt: skip

Use = Callable[[bytes], str]
"""Uses a file, and tells what was said of it."""


def guided() -> bool:
    """Whether atheris can guide."""
    return importlib.util.find_spec("atheris") is not None


def instrumented() -> Any:
    """While this lasts, what is imported of the readers tells atheris its branches."""
    if not guided():
        return nullcontext()
    atheris: Any = importlib.import_module("atheris")  # no dependency: it is for some systems alone
    compiled = [file for file in (ROOT / "lambent").rglob("*.py") if "numba" in file.read_text()]
    exclude = [".".join(file.relative_to(ROOT).with_suffix("").parts) for file in compiled]  # numba knows no counters
    return atheris.instrument_imports(include=list(INSTRUMENTED), exclude=exclude)


def fuzz_one(number: int, seconds: float, corpus: Path, folder: Path, report: Path) -> None:
    """Break the sound file with this number for so many seconds of the processor; does not return."""
    from tests.reliability.mutate import LONGEST_S, MOST_BYTES, Bench, Result, attempt, bounded
    from tests.reliability.readers import sound

    warnings.simplefilter("ignore")
    one = sound()[number]
    bench, result, whole = Bench(folder), Result(), one.files[one.broken]
    with instrumented():
        one.use(bench.lay_out(one) / one.main)  # imports and caches are warm
    begin_bytes, begin, next_report = _peak_bytes(), time.process_time(), 0.0

    def use(content: bytes) -> str:
        nonlocal next_report
        faulthandler.dump_traceback_later(100 * LONGEST_S, exit=True)  # code that never returns to Python
        told = attempt(bench, one, content, result, corpus / "faults", f"{number}-{len(result.failures)}")
        spent = time.process_time() - begin
        if spent > min(seconds, next_report):
            result.counts[one.reader].peak_mb = (_peak_bytes() - begin_bytes) / 2**20
            report.write_text(json.dumps({**asdict(result), "seconds": spent}))
            next_report = spent + REPORT_S
        if spent > seconds:
            sys.stdout.flush()
            os._exit(0)  # libFuzzer takes an exception for a crash
        return told

    kept = corpus / f"{number}-{re.sub(r'[^a-zA-Z0-9.]+', '-', one.reader)}"
    kept.mkdir(parents=True, exist_ok=True)
    (kept / "sound").write_bytes(whole)
    others = [other.files[other.broken] for other in sound()]
    with bounded(MOST_BYTES):
        (by_branches if guided() else by_what_is_said)(use, kept, others, whole)


def by_branches(use: Use, kept: Path, others: list[bytes], whole: bytes) -> None:
    """libFuzzer over `lambent`'s branches."""
    import numpy as np

    from tests.reliability.mutations import mutate

    atheris: Any = importlib.import_module("atheris")

    def broken(content: bytes, most: int, seed: int) -> bytes:
        random = np.random.default_rng(seed)
        if random.random() < OF_STRUCTURE:
            return mutate(content, others, random)[:most]
        return atheris.Mutate(content, most)

    longest = max(4096, MOST_LENGTHS * len(whole))
    limits = [
        f"-max_len={longest}",
        "-timeout=0",
        "-rss_limit_mb=0",
        "-malloc_limit_mb=0",
        "-verbosity=0",
        "-report_slow_units=1000",
    ]
    atheris.Setup([sys.argv[0], *limits, str(kept)], lambda content: use(content) and None, custom_mutator=broken)
    atheris.Fuzz()


def by_what_is_said(use: Use, kept: Path, others: list[bytes], whole: bytes) -> None:
    """Mutations of files of which something new was said."""
    import numpy as np
    from hypothesis import HealthCheck, Phase, given, settings
    from hypothesis import strategies as st

    from tests.reliability.mutations import mutate

    files, known = [file.read_bytes() for file in sorted(kept.iterdir())], set[str]()
    number = st.integers(0, (1 << 32) - 1)

    @settings(max_examples=1 << 30, deadline=None, database=None, phases=[Phase.generate],
              suppress_health_check=list(HealthCheck))  # fmt: skip
    @given(number, number)
    def one(which: int, seed: int) -> None:
        content = mutate(files[which % len(files)], others, np.random.default_rng(seed))
        said = re.sub(r"found .*|[\d'\"]+", "", use(content))
        if said not in known:
            known.add(said)
            files.append(content)
            (kept / f"{len(files):06d}").write_bytes(content)

    one()


def _peak_bytes() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss << 10


def fuzz(reader: str, minutes: float, corpus: Path) -> tuple[Any, dict[str, float]]:
    """The counts and failures of the readers whose name holds `reader`, and the processor's minutes of each."""
    with instrumented():
        from tests.reliability.mutate import IN_MEMORY, Count, Result
        from tests.reliability.readers import numbers_of, sound

        chosen = numbers_of(reader, sound())
    result, spent = Result(), dict[str, float]()
    for k in chosen:
        one = sound()[k]
        with tempfile.TemporaryDirectory(dir=IN_MEMORY if IN_MEMORY.is_dir() else None) as name:
            found, ended = _in_a_process(k, 60 * minutes / len(chosen), corpus, Path(name))
            if ended:
                (corpus / "faults").mkdir(parents=True, exist_ok=True)
                last = Path(name) / "files/0" / one.broken
                if last.is_file():
                    shutil.copy(last, corpus / "faults" / f"{k}-last")
                found["failures"][f"{one.reader}: the process ended with {ended}"] = 1
        spent[one.reader] = spent.get(one.reader, 0.0) + found["seconds"] / 60
        for of, counts in found["counts"].items():
            had, new = result.counts.setdefault(of, Count()), Count(**counts)
            highest = {what: max(getattr(had, what), getattr(new, what)) for what in ("slowest_s", "peak_mb")}
            sums = {what: getattr(had, what) + getattr(new, what) for what in ("tried", "refused", "read", "failed")}
            result.counts[of] = Count(**sums, **highest)
        for key, times in found["failures"].items():
            result.failures[key] = result.failures.get(key, 0) + times
    return result, spent


def _in_a_process(number: int, seconds: float, corpus: Path, folder: Path) -> tuple[Any, int]:
    """The report of a child process, and how it ended, 0 if well."""
    report = folder / "report.json"
    child = os.fork()
    if not child:
        try:
            fuzz_one(number, seconds, corpus, folder / "files", report)
        except BaseException:  # noqa: BLE001 - the child must not go on as its parent
            traceback.print_exc()
        os._exit(1)
    _, ended = os.waitpid(child, 0)
    found = json.loads(report.read_text()) if report.is_file() else {"counts": {}, "failures": {}, "seconds": 0.0}
    return found, ended


def main() -> None:
    options = argparse.ArgumentParser()
    options.add_argument("--reader", default="")
    options.add_argument("--minutes", type=float, default=1.0, help="of the processor")
    options.add_argument("--corpus", type=Path, default=CORPUS)
    given = options.parse_args()
    faulthandler.enable()
    result, spent = fuzz(given.reader, given.minutes, given.corpus.resolve())
    from tests.reliability.mutate import table

    print("guided by", "branches (atheris)" if guided() else "what readers say (hypothesis)")  # noqa: T201
    print(table(result))  # noqa: T201
    print("\n".join(f"{name}: {minutes:.1f} minutes of the processor" for name, minutes in spent.items()))  # noqa: T201
    for key, times in result.failures.items():
        print(f"{times} x {key}")  # noqa: T201
    sys.exit(bool(result.failures))


if __name__ == "__main__":
    main()
