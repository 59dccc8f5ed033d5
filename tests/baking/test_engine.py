"""The engine probe: finds, refuses, remembers."""

from __future__ import annotations

from pathlib import Path

import pytest

from lambent.baking import engine as module
from lambent.core.errors import UserError


@pytest.fixture
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setattr(module, "_cache_file", lambda: tmp_path / "engine.json")
    return tmp_path / "engine.json"


def test_engine_renders_and_is_remembered(own_cache):
    first = module.probe_engine()
    if first.engine is None:
        pytest.skip(f"no engine here: {first.failures}")
    assert first.engine.variant in module.VARIANTS and first.engine.threads >= 1 and not first.cached
    again = module.probe_engine()
    assert again.cached and again.engine == first.engine
    own_cache.write_text("{broken")
    assert not module._read_cache(module._cache_key(module._wanted_variants(), module.find_llvm()))


def test_cache_of_another_library_is_not_used(own_cache):
    module._write_cache("key of another machine", module.Engine("llvm_ad_rgb", "19.1.7", 2))
    assert module._read_cache("key of this machine") is None
    assert module._read_cache("key of another machine") == module.Engine("llvm_ad_rgb", "19.1.7", 2)


def test_a_home_that_cannot_be_written_stops_nothing(own_cache, monkeypatch):
    own_cache.write_text("a file, where the cache's folder would be")
    monkeypatch.setattr(module, "_cache_file", lambda: own_cache / "engine.json")
    module._write_cache("key", module.Engine("llvm_ad_rgb", "19.1.7", 2))
    assert module._read_cache("key") is None


def test_a_wrong_library_is_an_error_that_names_the_mend(own_cache, monkeypatch):
    monkeypatch.setenv(module.LIBRARY_VARIABLE, "/nowhere/libLLVM.so")
    monkeypatch.setenv(module.VARIANT_VARIABLE, "llvm_ad_rgb")
    probe = module.probe_engine()
    assert probe.engine is None and "/nowhere/libLLVM.so" in probe.failures[0] and not own_cache.exists()
    with pytest.raises(UserError, match="libllvm19"):
        module.engine.__wrapped__()


def test_an_old_library_aborts_the_probe_and_not_this_process(own_cache, monkeypatch):
    old = next((p for p in module._llvm_files() if 15 <= module._llvm_number(p) < module.LLVM_OLDEST), None)
    if old is None:
        pytest.skip("no LLVM 15 to 18 installed")
    monkeypatch.setenv(module.LIBRARY_VARIABLE, str(old))
    monkeypatch.setenv(module.VARIANT_VARIABLE, "llvm_ad_rgb")
    probe = module.probe_engine()
    assert probe.engine is None and str(old) in probe.failures[0]


@pytest.mark.parametrize(
    ("path", "number"),
    [
        ("/usr/lib/x86_64-linux-gnu/libLLVM-15.so.1", 15),
        ("/usr/lib/x86_64-linux-gnu/libLLVM.so.19.1", 19),
        ("/usr/lib64/llvm20/lib64/libLLVM.so", 20),
        ("/opt/homebrew/opt/llvm@19/lib/libLLVM.dylib", 19),
        ("/somewhere/libLLVM.so", 0),
    ],
)
def test_version_number_of_a_library(path, number):
    assert module._llvm_number(Path(path)) == number


def test_find_llvm_takes_the_oldest_that_is_new_enough(monkeypatch):
    monkeypatch.delenv(module.LIBRARY_VARIABLE, raising=False)
    files = [Path(f"/none/libLLVM-{n}.so") for n in (21, 18, 20)]
    monkeypatch.setattr(module, "_llvm_files", lambda: iter(files))
    assert module.find_llvm() == Path("/none/libLLVM-20.so")
