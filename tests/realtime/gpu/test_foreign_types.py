"""wgpu's types parsed with few names are those that cffi parses with all."""

from __future__ import annotations

import subprocess
import sys

import pytest

PROBE = """
import sys
from wgpu.backends.wgpu_native._api import ffi
from lambent.realtime.gpu.foreign_types import METHOD, parse_quickly
if sys.argv[1] == "quick":
    parse_quickly()
    parse_quickly()
    assert METHOD in vars(ffi._parser), "this version of cffi is parsed slowly"
names = sorted(key[8:] for key in ffi._parser._declarations if key.startswith("typedef WGPU"))
for form in ("{}", "{} *", "{}[3]", "const {} *"):
    for name in names[:: 1 if form == "{} *" else 9]:
        try:
            one = ffi.typeof(form.format(name))
            fields = one.item.fields if one.kind == "pointer" and one.item.kind == "struct" else ()
            print(form.format(name), one.kind, one.cname, [field for field, _ in fields or ()])
        except Exception as error:
            print(form.format(name), type(error).__name__)
"""


@pytest.mark.long
def test_types_are_the_same():
    quick, slow = (
        subprocess.run([sys.executable, "-c", PROBE, how], capture_output=True, text=True) for how in ("quick", "slow")
    )
    assert quick.returncode == 0, quick.stderr
    assert quick.stdout == slow.stdout and quick.stdout.count("struct") > 50
