"""Base and each extra alone: the built wheel in an environment of its own, outside of the clone.

    python tests/project/extras_alone.py                  all, at the newest and lowest versions
    python tests/project/extras_alone.py plot pdf        these, at both

In each environment every public name is imported, and the commands of the pages about its extra
run (``pip install 'robostiff[...]'`` or ``./extras/...`` makes a page one about an extra); those of
all pages in the base. With all extras together, `make test` runs them. A command that needs another
extra must say so in one line, with exit status 2, and its page must name that extra. This needs the
package uv.
"""

from __future__ import annotations

import re
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
EXTRAS = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"][
    "optional-dependencies"
]
#: Distributions of their own beside robostiff.
OTHERS = {path.parent.name for path in ROOT.glob("extras/*/pyproject.toml")}
FOR_DEVELOPERS = {"test", "peers", "lint", "bench", "docs"}
ALL = "all"
BASE = "base"
RESOLUTIONS = {"newest": "highest", "lowest": "lowest-direct"}
SECONDS = 300
NAMES = """
import sys, warnings
from importlib import import_module
from pathlib import Path
import robostiff

warnings.simplefilter("error")
count = 0
for top in ("robostiff", *sys.argv[1:]):
    source = Path(import_module(top).__file__).parent
    assert "site-packages" in source.parts, source
    for package in sorted(source.rglob("__init__.py")):
        module = import_module(".".join((top, *package.parent.relative_to(source).parts)))
        for name in getattr(module, "__all__", ()):
            getattr(module, name)
            count += 1
print(count)
"""


def named_extras(text: str) -> set[str]:
    """Extras that a text tells to install."""
    found = re.findall(r"robostiff\[([\w,]+)\]", text)
    others = set(re.findall(r"\./extras/([\w-]+)", text))
    return others | {extra for names in found for extra in names.split(",")}


def commands(page: Path) -> list[str]:
    """Lines of fenced blocks that call robostiff, as they would be typed."""
    text = page.read_text(encoding="utf-8")
    blocks = re.findall(r"^```(?:console|sh|bash|text)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    lines = "".join(blocks).replace("\\\n", " ").splitlines()
    calls = [line.removeprefix("$ ").partition(" | ")[0].strip() for line in lines]
    return [call for call in calls if call.startswith("robostiff ") and "ROBOT" not in call]


@dataclass(frozen=True)
class Environment:
    """Where the wheel is installed with an extra."""

    extra: str
    versions: str
    folder: Path

    def __str__(self) -> str:
        return f"{self.extra} ({self.versions})"

    @property
    def programs(self) -> Path:
        """The folder of its python and robostiff."""
        return self.folder / "venv" / ("Scripts" if sys.platform == "win32" else "bin")

    @property
    def extras(self) -> set[str]:
        """What is there."""
        return (set(EXTRAS) - FOR_DEVELOPERS) | OTHERS if self.extra == ALL else {self.extra}

    @property
    def pages(self) -> list[Path]:
        """Those whose commands are run."""
        if self.extra == BASE:
            return PAGES if self.versions == "newest" else PAGES[:1]
        return [page for page in PAGES if self.extra in named_extras(page.read_text("utf-8"))]

    @property
    def others(self) -> list[str]:
        """Distributions beside robostiff that are there."""
        return sorted(OTHERS & self.extras)

    def install(self, wheels: Mapping[str, Path]) -> None:
        """The wheel with its extra, and nothing else; wheels alone, as no one has a compiler."""
        uv = [sys.executable, "-m", "uv"]
        run([*uv, "venv", "--quiet", "--python", sys.executable, str(self.folder / "venv")])
        pip = [*uv, "pip", "install", "--quiet", "--python", str(self.folder / "venv")]
        extra = ["--extra", self.extra] if self.extra in EXTRAS else []
        # Bounds are those of direct dependencies, which a wheel's are not for the resolver.
        bounds = ["--resolution", RESOLUTIONS[self.versions], "-r", str(ROOT / "pyproject.toml")]
        for name in self.others:
            bounds += ["-r", str(ROOT / "extras" / name / "pyproject.toml")]
        own = str(wheels["robostiff"])  # which the others need
        run([*pip, "--only-binary", ":all:", *bounds, *extra, own])
        run([*pip, "--no-deps", own, *(str(wheels[name]) for name in self.others)])

    def complaints(self) -> list[str]:
        """What is wrong in this environment."""
        modules = [name.replace("-", "_") for name in self.others]
        done = self.called([str(self.programs / "python"), "-c", NAMES, *modules], self.folder)
        found = [] if done.returncode == 0 else [f"public names: {done.stderr[-800:]}"]
        for page in self.pages:
            folder = self.folder / page.stem
            shutil.copytree(ROOT / "examples", folder / "examples")
            shutil.copytree(ROOT / "docs", folder / "docs", ignore=shutil.ignore_patterns("_*"))
            lacking: set[str] = set()  # files that a refused command would have written
            for call in commands(page):
                words = shlex.split(call, comments=True)
                if lacking & set(words):
                    continue
                done = self.called([str(self.programs / words[0]), *words[1:]], folder)
                if done.returncode == 2 and "-o" in words:
                    lacking.add(words[words.index("-o") + 1])
                if wrong := self.complaint(done, page):
                    found.append(f"{page.name}: {call}\n    {wrong}")
        return found

    def complaint(self, done: subprocess.CompletedProcess[str], page: Path) -> str | None:
        """What is wrong with the outcome of a command of a page."""
        if "Traceback" in done.stderr or done.returncode not in {0, 1, 2}:
            return f"exit status {done.returncode}: {done.stderr[-800:]}"
        if done.returncode < 2:
            return None
        needed = re.fullmatch(
            r"robostiff: error: .* need '[\w-]+', which is not installed; write pip install "
            r"(?:'robostiff\[(\w+)\]'|\./extras/([\w-]+) in a checkout of robostiff)\n",
            done.stderr,
        )
        if needed is None:
            return f"exit status 2: {done.stderr[-800:]}"
        extra = needed[1] or needed[2]
        if extra in self.extras:
            return f"needs more than its extra brings: {done.stderr}"
        if extra not in named_extras(page.read_text("utf-8")):
            return f"the page does not say that this needs {extra}"
        return None

    def called(self, command: list[str], folder: Path) -> subprocess.CompletedProcess[str]:
        """A finished command; one that serves a page is interrupted once it does."""
        with subprocess.Popen(
            command,
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        ) as process:
            if "view" in command and process.stdout and "http" in process.stdout.readline():
                process.send_signal(signal.SIGINT)
                process.communicate(timeout=SECONDS)
                return subprocess.CompletedProcess(command, 0, "", "")
            out, err = process.communicate(timeout=SECONDS)
        return subprocess.CompletedProcess(command, process.returncode, out, err)


def run(command: list[str]) -> None:
    """A step without which nothing can be said."""
    done = subprocess.run(command, check=False, capture_output=True, text=True, cwd=ROOT)
    if done.returncode:
        raise SystemExit(f"{shlex.join(command)}\n{done.stdout}{done.stderr}")


def main(names: list[str]) -> int:
    """Exit status: 0 where nothing is wrong."""
    users = [*sorted(set(EXTRAS) - FOR_DEVELOPERS - {ALL}), *sorted(OTHERS)]
    wrong = 0
    with tempfile.TemporaryDirectory(prefix="robostiff-extras-") as folder:
        wheels = {}
        for name, source in {"robostiff": ROOT, **{n: ROOT / "extras" / n for n in OTHERS}}.items():
            build = [sys.executable, "-m", "uv", "build", "--quiet", "--wheel"]
            run([*build, "-o", f"{folder}/{name}", str(source)])
            (wheels[name],) = Path(folder, name).glob("*.whl")

        def checked(environment: Environment) -> tuple[Environment, list[str], int]:
            environment.folder.mkdir()
            environment.install(wheels)
            found = environment.complaints()
            count = sum(len(commands(page)) for page in environment.pages)
            shutil.rmtree(environment.folder)
            return environment, found, count

        asked = [
            Environment(extra, versions, Path(folder) / f"with-{extra}-{versions}")
            for versions in RESOLUTIONS
            for extra in names or [BASE, *users, ALL]
        ]
        with ThreadPoolExecutor(2) as pool:
            for environment, found, count in pool.map(checked, asked):
                print(f"{environment}: all public names, {count} commands, {len(found)} wrong")
                print(*(f"  {each}" for each in found), sep="\n", end="\n" if found else "")
                wrong += len(found)
    return min(wrong, 1)


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
