"""Mutation testing: which small changes of the source would the tests not notice?

Takes a seeded random sample of all mutants of some packages, runs for each the tests that concern
it in a copy of the tree, and lists those that survive.  `make mutate` does it.  Ctrl-C ends it
early: the sample is in random order, so what was tried until then is a smaller sample.

A compiled loop is cached by the file that it is in, while it holds the code of all loops that it
calls.  So for each mutant everything that was compiled from its file, or from a file that imports
it, is dropped from the cache; the probe at the start proves that a mutant in a loop is seen.
"""

import argparse
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from difflib import unified_diff
from pathlib import Path

from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.plugins import get_operator, operator_names
from scipy.stats import binomtest

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src" / "fringeforce"
TESTS = {
    "optics": ["tests/optics", "tests/test_model.py", "tests/reading/test_channels.py"],
    "estimation": [
        "tests/estimation",
        "tests/reading/test_reader.py",
        "tests/reading/test_channels.py",
        "tests/reading/test_tracking_reader.py",
    ],
}
"""Tests that concern a package, the quickest first."""
SILENT = (
    *("Decorator", "ExceptionReplacer", "Variable", "Bit", "Shift", "_Is"),
    *("_Mod", "_Pow", "_FloorDiv", "_Invert", "USub_Not"),
)
"""Operators left out: they make code that cannot run, or that no author would write."""
PROBE = ("estimation/vector_loops.py", "phase[k] += a * p[k]", "phase[k] += 2 * a * p[k]")
PROBED = [["tests/estimation/test_gauss_newton.py"]]
"""Tests that must notice it, and pass without it."""
LIMIT = 400
"""Seconds after which a mutant that makes the tests hang counts as killed."""


@dataclass(frozen=True)
class Mutant:
    """One change of one file."""

    module: str
    operator: str
    occurrence: int

    @property
    def original(self) -> str:
        """The file as it is."""
        return (SOURCE / self.module).read_text(encoding="utf-8")

    @property
    def text(self) -> str:
        """The file with the change."""
        return mutate_code(self.original, get_operator(self.operator)(), self.occurrence) or ""


def mutants(package: str) -> Iterator[Mutant]:
    """All mutants of a package."""
    for path in sorted((SOURCE / package).rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        nodes, lines = list(ast_nodes(get_ast(text))), text.splitlines()
        for name in sorted(operator_names()):
            if any(part in name for part in SILENT):
                continue
            operator = get_operator(name)()
            places = [place for node in nodes for place in operator.mutation_positions(node)]
            for occurrence, ((line, _), _) in enumerate(places):
                # what a decorator is told concerns speed and safety, not results
                if not lines[line - 1].startswith("@"):
                    yield Mutant(str(path.relative_to(SOURCE)), name, occurrence)


class Copy:
    """A copy of the tree in which mutants are tried, with a cache of compiled loops of its own."""

    def __init__(self, folder: Path) -> None:
        self.tree, self.cache = folder / "tree", folder / "cache"
        names = subprocess.run(
            ["git", "ls-files", "-co", "--exclude-standard"], cwd=ROOT, capture_output=True,
            text=True, check=True,
        ).stdout.splitlines()  # fmt: skip
        for name in names:
            if (ROOT / name).is_file():
                (self.tree / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(ROOT / name, self.tree / name)

    def killed(self, module: str, changed: str | None, stages: list[list[str]]) -> bool:
        """Whether tests fail with one file changed, or with none for a trial; stage by stage."""
        path = self.tree / "src" / "fringeforce" / module
        original = path.read_text(encoding="utf-8")
        self._forget(module)
        try:
            path.write_text(changed if changed is not None else original, encoding="utf-8")
            return any(self._fails(tests) for tests in stages)
        finally:
            path.write_text(original, encoding="utf-8")
            self._forget(module)

    def _fails(self, tests: list[str]) -> bool:
        environment = os.environ | {
            "PYTHONPATH": str(self.tree / "src"),
            "NUMBA_CACHE_DIR": str(self.cache),
            "PYTHONDONTWRITEBYTECODE": "1",
        }
        command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *tests]
        try:
            run = subprocess.run(
                command, cwd=self.tree, env=environment, capture_output=True, timeout=LIMIT,
                check=False,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            return True
        return run.returncode != 0

    def _forget(self, module: str) -> None:
        """Drop from the cache what was compiled from a file or from those that import it."""
        for name in _importers(self.tree / "src" / "fringeforce", module):
            for cached in self.cache.rglob(f"{Path(name).stem}.*"):
                cached.unlink()


def _importers(folder: Path, module: str) -> set[str]:
    """A module and all that import it, directly or not."""
    texts = {
        str(p.relative_to(folder)): p.read_text(encoding="utf-8") for p in folder.rglob("*.py")
    }
    found, fresh = {module}, {module}
    while fresh:
        dotted = {"fringeforce." + name.removesuffix(".py").replace("/", ".") for name in fresh}
        wanted = re.compile("|".join(rf"from {re.escape(name)} import" for name in dotted))
        fresh = {name for name, text in texts.items() if wanted.search(text)} - found
        found |= fresh
    return found


def main() -> None:
    """Try a sample and say what survived."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("packages", nargs="*", default=list(TESTS))
    parser.add_argument("--count", type=int, default=150, help="mutants in the sample")
    parser.add_argument("--seed", type=int, default=0, help="of the sample")
    parser.add_argument(
        "--quick", action="store_true", help="only tests/PACKAGE: fewer are killed, but sooner"
    )
    asked = parser.parse_args()
    everything = [mutant for package in asked.packages for mutant in mutants(package)]
    sample = random.Random(asked.seed).sample(everything, min(asked.count, len(everything)))
    print(f"{len(sample)} of {len(everything)} mutants", flush=True)
    killed: Counter[str] = Counter()
    tried: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as folder, suppress(KeyboardInterrupt):
        copy = Copy(Path(folder))
        _prove(copy)
        for number, mutant in enumerate(sample, start=1):
            package = mutant.module.split("/")[0]
            dead = copy.killed(
                mutant.module, mutant.text, _stages(package, mutant.module, asked.quick)
            )
            tried[package] += 1
            killed[package] += dead
            print(f"{number} {'killed' if dead else 'SURVIVED'} {mutant.module}", flush=True)
            if not dead:
                print(_difference(mutant), flush=True)
    for package in tried:
        print(f"{package:8} {_share(killed[package], tried[package])}")
    if tried:
        print(f"{'all':8} {_share(killed.total(), tried.total())}")


def _stages(package: str, module: str, quick: bool) -> list[list[str]]:
    """The tests of the module itself, which kill most, and those that concern its package."""
    own = f"tests/{package}/test_{Path(module).name}"
    wider = TESTS[package][:1] if quick else TESTS[package]
    return [[own], wider] if (ROOT / own).is_file() else [wider]


def _prove(copy: Copy) -> None:
    """Stop unless the tests pass as they are and notice a fatal change inside a compiled loop."""
    module, old, new = PROBE
    text = (SOURCE / module).read_text(encoding="utf-8")
    if copy.killed(module, None, PROBED):
        sys.exit("The tests fail without any change.")
    if old not in text:
        sys.exit(f"The probe {old!r} is no longer in {module}.")
    if not copy.killed(module, text.replace(old, new), PROBED):
        sys.exit("A fatal change inside a compiled loop is not noticed.")
    print("A fatal change inside a compiled loop is noticed.", flush=True)


def _difference(mutant: Mutant) -> str:
    lines = unified_diff(mutant.original.splitlines(), mutant.text.splitlines(), n=1, lineterm="")
    return "\n".join(f"    {line}" for line in list(lines)[2:])


def _share(killed: int, tried: int) -> str:
    interval = binomtest(killed, tried).proportion_ci(0.95, method="wilson")
    return (
        f"{killed} of {tried} killed, {100 * killed / tried:.0f} % "
        f"(95 % interval {100 * interval.low:.0f} to {100 * interval.high:.0f} %)"
    )


if __name__ == "__main__":
    main()
