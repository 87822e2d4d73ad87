"""Settings that all tests share."""

import gc
import json
import os
import sys
import warnings
import weakref
from collections import Counter
from collections.abc import Generator, Iterator
from copy import copy
from dataclasses import fields
from functools import wraps
from importlib import import_module
from inspect import signature, unwrap
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import jaxtyping
import pytest
from _pytest.doctest import DoctestModule
from hypothesis import HealthCheck, settings

from tests.other_programs import COMMANDS, PEERS, is_there

# The workers of pytest, which inherit it, fill the processors: threads of BLAS beside them would
# wait for one another busily.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# SymPy keeps the last 1,000 answers of each function; formulas take a tenth longer with these.
os.environ.setdefault("SYMPY_CACHE_SIZE", "10000")

# Records of the same robots are made once by all workers, in a folder of this run; those of the
# user stay as they are.
_SHARED = "ROBOSTIFF_RECORDS_OF_TESTS"
if _SHARED not in os.environ:
    _RECORDS = TemporaryDirectory(prefix="robostiff-records-")
    os.environ[_SHARED] = _RECORDS.name
os.environ["ROBOSTIFF_CACHE"] = "off"

_UNTIMED = [HealthCheck.too_slow, HealthCheck.data_too_large]

# The same examples on every machine, so that a pass here is a pass there.
settings.register_profile(
    "repeatable",
    derandomize=True,
    max_examples=12,
    deadline=None,
    database=None,
    suppress_health_check=_UNTIMED,
)
# Others at each run; failures print how to repeat them.
settings.register_profile(
    "campaign",
    max_examples=400,
    deadline=None,
    database=None,
    print_blob=True,
    suppress_health_check=_UNTIMED,
)
settings.load_profile("repeatable")

# Modules and tests stay to the end: looking through them for garbage again and again takes long.
gc.disable()
_SLOW = frozenset((Path(__file__).parent / "slow_tests.txt").read_text().splitlines())


class _ExamplesWhereThereAreSome:
    """Half of the modules have no example; looking through their objects takes seconds."""

    @pytest.hookimpl(wrapper=True)
    def pytest_collect_file(
        self, file_path: Path
    ) -> Generator[None, list[pytest.Collector], list[pytest.Collector]]:
        found = yield
        if file_path.suffix == ".py" and b">>>" not in file_path.read_bytes():
            return [one for one in found if not isinstance(one, DoctestModule)]
        return found


def pytest_configure(config: pytest.Config) -> None:
    """What a conftest.py says of files is said of those beside it alone; a plugin, of all."""
    config.pluginmanager.register(_ExamplesWhereThereAreSome())


_LEFT_OUT: pytest.StashKey[dict[str, int]] = pytest.StashKey()


def _programs(item: pytest.Item) -> list[str]:
    return sorted({name for mark in item.iter_markers("needs") for name in mark.args})


@pytest.hookimpl(wrapper=True)
def pytest_collection_modifyitems(
    config: pytest.Config, items: list[pytest.Item]
) -> Iterator[None]:
    """Mark tests for `make slow` and `make peers`, and leave out what cannot run here.

    Those of ``slow_tests.txt`` take seconds each, or are the same test at more robots and poses; a
    few of each are fast. A test that has another name since would be fast by mistake.
    """
    is_whole = not any("::" in name for name in config.args)
    if is_whole and all(map(is_there, (*PEERS, *COMMANDS))):  # all tests of the files are here
        files = {item.nodeid.split("::", 1)[0] for item in items}
        listed = {name for name in _SLOW if name.split("::", 1)[0] in files}
        if gone := sorted(listed - {item.nodeid for item in items}):
            raise pytest.UsageError(
                "slow_tests.txt names tests that are not there: " + ", ".join(gone)
            )
    for item in items:
        if item.nodeid in _SLOW:
            item.add_marker("slow")
        if PEERS & set(_programs(item)):
            item.add_marker("peer")
    yield  # here `-m` and `-k` choose
    missing = {item: [name for name in _programs(item) if not is_there(name)] for item in items}
    left_out = [item for item in items if missing[item]]
    config.hook.pytest_deselected(items=left_out)
    items[:] = [item for item in items if not missing[item]]
    config.stash[_LEFT_OUT] = Counter(" and ".join(missing[item]) for item in left_out)


def pytest_sessionfinish(session: pytest.Session) -> None:
    """A worker of xdist tells what it has left out."""
    of_worker: dict[str, Any] | None = getattr(session.config, "workeroutput", None)
    if of_worker is not None:
        of_worker["left out"] = dict(session.config.stash.get(_LEFT_OUT, {}))


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    """All workers have left out the same."""
    node.config.stash[_LEFT_OUT] = getattr(node, "workeroutput", {}).get("left out", {})


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    """Say once what was left out."""
    left_out = config.stash.get(_LEFT_OUT, {})
    if left_out:
        parts = [f"{count} that need {name}" for name, count in sorted(left_out.items())]
        terminalreporter.write_line(f"tests left out, as this is not installed: {', '.join(parts)}")


#: Robots of files of the project as they were built, by their identity, and of what.
_BUILT: dict[int, tuple[weakref.ref[Any], Any]] = {}
#: Whether a test changes functions of the library, so that formulas are derived anew.
_IS_CHANGED = False


def _derived_once(derive: Any) -> Any:
    """The same function, whose formulas of robots that are built once are those of all tests."""
    from robostiff.analytic import AtHome

    known: dict[Any, Any] = {}
    of_call = signature(derive)

    @wraps(derive)
    def derive_once(robot: Any, *given: Any, **named: Any) -> Any:
        built, own = _BUILT.get(id(robot), (lambda: None, None))
        if _IS_CHANGED or built() is not robot:
            return derive(robot, *given, **named)
        call = of_call.bind(robot, *given, **named)
        call.apply_defaults()
        options = {**call.arguments, "robot": own}
        options["pose"] = options["pose"] or AtHome()
        try:
            key = tuple(options.items())
            hash(key)
        except TypeError:  # values of coordinates
            return derive(robot, *given, **named)
        if key not in known:
            known[key] = derive(robot, *given, **named)
        return known[key]

    return derive_once


def _robots_of_files_are_derived_once() -> None:
    """Formulas of robots that come with the project are those of all tests that ask for them.

    Modules that are imported later find the function in the package.
    """
    from robostiff import analytic

    inside = f"{analytic.__name__}."
    users = {name: own for name, own in sys.modules.items() if name.startswith("robostiff")}
    for name in ("derive_robot", "derive_leg"):
        derive = getattr(analytic, name)
        once = _derived_once(derive)
        setattr(analytic, name, once)
        for where, module in users.items():
            if not where.startswith(inside) and vars(module).get(name) is derive:
                vars(module)[name] = once


def _robots_of_files_are_built_once() -> None:
    """A quarter of the time of commands goes into models that were read a hundred times before.

    Those of files of the project, as they are or with some symbols in place of parameters, are
    built once in a process; each call has an object of its own, with nothing beside its fields.
    """
    from robostiff.io import document, model_file

    folder = Path(__file__).parents[1]
    are_told: Any = vars(import_module("robostiff.io.bounded_file"))[
        "_READ"
    ]  # files, as they are read
    read, build = document.read_document, model_file.model_from_document
    known: dict[tuple[Path, str], Any] = {}
    built: dict[tuple[Path, str, Any], Any] = {}

    def read_once(source: Any, *more: Any, **named: Any) -> Any:
        file = Path(source).absolute()
        is_own = folder in file.parents and os.path.isfile(file) and are_told.get() is None
        if more or named or not is_own:
            return read(source, *more, **named)
        place = file, str(source)
        if place not in known:
            known[place] = read(source)
        return known[place]

    def build_once(document: Any, parameters: Any = None, *, symbols: Any = (), **more: Any) -> Any:
        place = Path(document.file).absolute(), str(document.file)
        is_hashable = isinstance(symbols, tuple | model_file.ParameterChoice)
        is_own = document is known.get(place) and are_told.get() is None
        if parameters or not is_hashable or not is_own:
            return build(document, parameters, symbols=symbols, **more)
        key = *place, symbols
        if key not in built:
            built[key] = build(document, symbols=symbols, **more)
        own = copy(built[key])
        for name in set(vars(own)) - {field.name for field in fields(own)}:
            del vars(own)[name]
        _BUILT[id(own)] = weakref.ref(own), key
        return own

    document.read_document, model_file.model_from_document = read_once, build_once


def _shared_records_answer_where_they_pay() -> None:
    """A record of another test does not change the way in which a question is answered.

    Users' calls read a record that is there at once; here it is read where it would be made.
    """
    from robostiff.analysis.posed_stiffness import KeptRecord

    seek = KeptRecord._seek

    def seek_where_it_pays(self: KeptRecord, count: int, pays: bool) -> None:
        if pays or os.environ["ROBOSTIFF_CACHE"] != os.environ[_SHARED]:
            seek(self, count, pays)

    KeptRecord._seek = seek_where_it_pays


def _models_of_mujoco_are_compiled_here() -> None:
    """A process for each would import MuJoCo each time; what it refuses goes to a process.

    So does everything in the tests of what files may not do.
    """
    if not is_there("robostiff_interop"):
        return
    compiled_model: Any = import_module("robostiff_interop.compiled_model")
    of_process = compiled_model.answer_of

    def of_here(task: Path, request: Any, *more: Any) -> Any:
        if not _IS_HARMFUL:
            from robostiff_interop.compile_mjcf import answer

            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # of MuJoCo, which a process keeps to itself
                found = answer(request)
            if "refusal" not in found:
                return json.loads(json.dumps(found))
        return of_process(task, request, *more)

    compiled_model.answer_of = of_here


def pytest_collection_finish() -> None:
    """Look for garbage in what the tests leave alone."""
    _models_of_mujoco_are_compiled_here()
    _shared_records_answer_where_they_pay()
    _robots_of_files_are_built_once()
    _robots_of_files_are_derived_once()
    gc.collect()
    gc.freeze()
    gc.enable()


# Where formulas are tested by themselves; what is built on them calls them with the same shapes
# thousands of times, at a third of the time of its tests. All slow tests check them.
_SHAPES_CHECKED = {"elastostatics", "paper"}
#: What is tested there is what a file may not do to the program that reads it.
_ABOUT_HARM = ("tests/interop/mjcf/test_bounds.py", "tests/io/urdf/test_harmful_files.py")
#: Whether a test is one of these.
_IS_HARMFUL = False
#: What is tested there is how records are made, and what is found in them.
_ABOUT_RECORDS = tuple(
    f"tests/{name}"
    for name in (
        *("recorded/", "compiled/", "analysis/kernels/test_disagreement.py"),
        "analysis/kernels/test_records_on_disk.py",
    )
)


def _changes_functions(function: Any) -> bool:
    """Whether a test or a fixture puts another function in place of one of the library."""
    code = getattr(unwrap(function), "__code__", None)
    return code is not None and "monkeypatch" in code.co_varnames and "setattr" in code.co_names


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Choose what is checked, recorded and derived anew."""
    global _IS_CHANGED, _IS_HARMFUL  # noqa: PLW0603
    _IS_HARMFUL = item.nodeid.startswith(_ABOUT_HARM)
    folder = item.nodeid.split("/")[1]
    is_checked = folder in _SHAPES_CHECKED or item.get_closest_marker("slow") is not None
    jaxtyping.config.update("jaxtyping_disable", not is_checked)
    # Fixtures change folders and limits; a test that changes more asks for it itself.
    function: Any = getattr(item, "function", None)
    changes = _changes_functions(function)
    fixtures = getattr(item, "_fixtureinfo", None)
    named = fixtures.name2fixturedefs.values() if fixtures is not None else ()
    _IS_CHANGED = changes or any(_changes_functions(own.func) for each in named for own in each)
    is_anew = changes or item.nodeid.startswith(_ABOUT_RECORDS)
    os.environ["ROBOSTIFF_CACHE"] = "off" if is_anew else os.environ[_SHARED]


@pytest.fixture
def in_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The test runs in an empty folder."""
    monkeypatch.chdir(tmp_path)
