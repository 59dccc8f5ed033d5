"""Fixtures that every test may use."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, settings

# A loaded machine is slow at making examples as well as at running them, which says nothing of the code; fixtures of
# these tests hold nothing that an example changes.
UNHURRIED = [HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.function_scoped_fixture]
settings.register_profile("unhurried", deadline=None, suppress_health_check=UNHURRIED)
settings.load_profile("unhurried")

SHARED = Path(os.environ.get("LAMBENT_SHARED", Path(__file__).parents[2] / "shared" / "data"))


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--long", action="store_true", help="Run tests that take more than a second, too.")


def pytest_runtest_setup(item: pytest.Item) -> None:
    if item.get_closest_marker("long") and not item.config.getoption("--long"):
        pytest.skip("pytest --long runs it")


@pytest.fixture(scope="session", autouse=True)
def settings_of_no_user(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Windows of tests start as on a new computer, and leave the user's own settings alone."""
    os.environ["XDG_CONFIG_HOME"] = str(tmp_path_factory.mktemp("config"))


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of real measured files, environments and scenes; tests that need it skip where it is absent."""
    if not SHARED.is_dir():
        pytest.skip(f"real test data not found at {SHARED} (set LAMBENT_SHARED)")
    return SHARED


def or_skip(start: Callable[[], object]) -> None:
    """Skip where this machine cannot start what a test needs."""
    from lambent.core.errors import UserError

    try:
        start()
    except UserError as error:
        pytest.skip(str(error))


@pytest.fixture(scope="session")
def adapter() -> None:
    """A graphics adapter, hardware or software; tests that draw skip without one."""
    from lambent.realtime.gpu.device import choose_adapter

    or_skip(choose_adapter)


@pytest.fixture(scope="session")
def device(adapter: None) -> Any:
    """One device for all tests that draw."""
    from lambent.realtime.gpu.device import open_device

    return open_device()


@pytest.fixture(scope="session")
def mi() -> Any:
    """Mitsuba with its variant set and our BSDFs registered; tests that need it skip where no variant works."""
    from lambent.baking.engine import engine

    or_skip(engine)
    from lambent.baking.bsdfs.material_plugin import register_material_plugin
    from lambent.baking.bsdfs.table_plugin import register_table_plugin

    register_material_plugin()
    register_table_plugin()
    import mitsuba

    return mitsuba


@pytest.fixture(scope="session")
def baked_box(mi: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a store of the built-in box."""
    from lambent.baking.bake import bake
    from lambent.scenes.loaders.load import load_scene
    from tests.baking.small_scenes import TINY

    folder = tmp_path_factory.mktemp("baked") / "box.store"
    bake(load_scene("builtin:box"), folder, quality=TINY).close()
    return folder
