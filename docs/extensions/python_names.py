"""Names in docstrings, each sought among the objects whose names end alike."""

from __future__ import annotations

from typing import Any

from sphinx.application import Sphinx
from sphinx.domains.python import ObjectEntry, PythonDomain
from sphinx.environment import BuildEnvironment


class PythonNames(PythonDomain):
    """The domain of Python, which compares a name that it does not know with those of all objects.

    Whatever a name means ends with it: only objects with the same last part can be meant.
    """

    def __init__(self, env: BuildEnvironment) -> None:
        super().__init__(env)
        self._alike: dict[str, dict[str, ObjectEntry]] = {}
        self._counted = 0

    def find_obj(
        self,
        env: BuildEnvironment,
        modname: str,
        classname: str,
        name: str,
        type: str | None,
        searchmode: int = 0,
    ) -> list[tuple[str, ObjectEntry]]:
        """Objects that a name may mean, with their full names."""
        if len(self.objects) != self._counted:
            self._alike, self._counted = {}, len(self.objects)
            for full, entry in self.objects.items():
                self._alike.setdefault(full.rpartition(".")[2], {})[full] = entry
        alike = self._alike.get(name.removesuffix("()").rpartition(".")[2])
        if alike is None:
            return []
        whole, self.data = self.data, {**self.data, "objects": alike}
        try:
            return super().find_obj(env, modname, classname, name, type, searchmode)
        finally:
            self.data = whole


def setup(app: Sphinx) -> dict[str, Any]:
    """Take it for the domain of Python."""
    app.add_domain(PythonNames, override=True)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
