"""Shared by all tests: one thread each, the option ``--full``, workers, and the order of modules."""

import gc
import os
import signal
import sys
import zlib
from pathlib import Path

import pytest

# Set before numpy is imported, and for the processes that tests start: there is a test for every core, and where threads of
# linear algebra wait for a busy one, matrices as small as these take thirty times as long.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS", "CONTIN_THREADS"):
    os.environ.setdefault(_name, "1")

# A shell that starts the tests in the background lets them ignore SIGINT, and the tests of interrupts would wait for ever.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

ROOT = Path(__file__).parent.parent
sys.path[:0] = [str(ROOT / "tests"), str(ROOT)]  # for `printed`, and for the bank of reference problems
#: The modules that take longest, some two seconds or more, in order. They are handed out first: what comes last must be short,
#: or one worker ends long before the other.
FIRST = (
    "branches/test_network", "branches/test_explore", "contin/continuation/test_bank", "branches/test_diagram",
    "ribbon_model/test_examples", "contin/test_examples", "branches/test_run", "contin/boundary/test_fields",
    "branches/test_scene", "branches/test_pictures", "ribbon_model/test_network", "branches/test_hostile_config",
    "branches/test_open", "ribbon_model/test_branches", "test_scenes", "test_stress",
)  # fmt: skip
#: Each worker imports everything and needs up to a gigabyte.
MOST_WORKERS = 8


gc.disable()  # until all tests are collected: nothing of that is garbage


def pytest_addoption(parser):
    parser.addoption("--full", action="store_true", help="tests that take long, all examples of random input, every fault")
    parser.addoption("--part", metavar="K/N", help="of the tests that take long, the K-th of N parts, K from 0 on")


def pytest_configure(config):
    try:
        from hypothesis import HealthCheck, settings
    except ImportError:  # its tests are skipped
        pass
    else:
        common = {"deadline": None, "derandomize": True, "suppress_health_check": list(HealthCheck)}
        settings.register_profile("quick", max_examples=25, **common)
        settings.register_profile("full", max_examples=300, **common)
        settings.load_profile("full" if config.getoption("--full") else "quick")


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers(config):
    """One worker a core for folders of tests; none for a test or a file, which start sooner without."""
    if all("::" in argument or argument.endswith(".py") for argument in config.args):
        return 0
    return min(len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1, MOST_WORKERS)


#: What marks of tests require, with the reason as their argument.
REQUIRED = {"posix": os.name == "posix", "forks": sys.platform.startswith("linux")}


def _long(items):
    """Return the tests that take long: those marked so and, of one marked ``sample(n)``, all but n of its parameters."""
    groups = {}
    for item in items:
        if mark := item.get_closest_marker("sample"):
            groups.setdefault((item.path, item.originalname), (mark.args[0], []))[1].append(item)
    for count, group in groups.values():
        kept = {place * len(group) // count for place in range(count)}
        yield from (item for place, item in enumerate(group) if place not in kept)
    yield from (item for item in items if item.get_closest_marker("full"))


@pytest.hookimpl(tryfirst=True)  # before those that are not asked for are left out
def pytest_collection_modifyitems(config, items):
    for name, given in REQUIRED.items():
        for item, mark in ((item, item.get_closest_marker(name)) for item in items if not given):
            if mark is not None:
                item.add_marker(pytest.mark.skip(reason=f"needs {name}: {mark.args[0]}"))
    part, parts = map(int, (config.getoption("--part") or "0/1").split("/"))
    asked = config.getoption("--full") or any("::" in argument for argument in config.args)  # or by their names
    left = set()
    for item in list(_long(items)):
        item.add_marker(pytest.mark.full)
        hours = parts > 1 and item.get_closest_marker("hours")
        if not asked or hours or zlib.crc32(item.nodeid.encode()) % parts != part:
            left.add(item)
    if left:
        config.hook.pytest_deselected(items=list(left))
        items[:] = [item for item in items if item not in left]
    places = {ROOT / "tests" / f"{name}.py": place for place, name in enumerate(FIRST)}
    assert all(path.exists() for path in places), "FIRST names a module that is not there"
    items.sort(key=lambda item: places.get(item.path, len(places)))


def pytest_collection_finish():
    gc.freeze()  # modules and tests stay to the end: nobody looks through them for garbage
    gc.enable()


@pytest.fixture(autouse=True)
def closed_figures():
    """Close the figures of a test: Matplotlib warns of more than twenty in one process, in whichever test comes next."""
    yield
    if "matplotlib.pyplot" in sys.modules:
        sys.modules["matplotlib.pyplot"].close("all")
