"""Scenes as YAML text: a subset without aliases, tags and duplicate keys, read and written."""

from __future__ import annotations

import re
from typing import Any

import yaml

from branches.scene.fields import ConfigError

#: Largest number of nested levels. Scenes have three; thousands would take seconds to read.
_DEEPEST = 20


class _Loader(yaml.SafeLoader):
    """Loader for the subset of YAML in scenes: no aliases (which can expand without bound), no tags, no duplicate keys.

    Plain words are read as in YAML 1.2: 1e-12 is a number, while 1:30, 010 and yes are text.
    """

    yaml_implicit_resolvers: dict = {}

    def compose_node(self, parent, index):
        self._depth = getattr(self, "_depth", 0) + 1
        if self._depth > _DEEPEST:
            raise RecursionError
        event = self.peek_event()
        if isinstance(event, yaml.AliasEvent) or getattr(event, "tag", None):
            raise yaml.MarkedYAMLError(problem="a scene has no aliases and no tags", problem_mark=event.start_mark)
        node = super().compose_node(parent, index)
        self._depth -= 1
        return node

    def construct_mapping(self, node, deep=False):
        seen = set()
        for key, _ in node.value:
            if isinstance(key, yaml.ScalarNode) and key.value in seen:
                raise yaml.MarkedYAMLError(problem=f"the key {key.value!r} is given twice", problem_mark=key.start_mark)
            seen.add(key.value if isinstance(key, yaml.ScalarNode) else None)
        return super().construct_mapping(node, deep)


for _kind, _pattern, _first in (
    ("null", r"~|null|", ["~", "n", ""]),
    ("bool", r"true|false", list("tf")),
    ("int", r"[-+]?(0|[1-9][0-9]{0,30})", list("-+0123456789")),
    ("float", r"[-+]?((\.[0-9]+|[0-9]+\.[0-9]*)([eE][-+]?[0-9]+)?|[0-9]+[eE][-+]?[0-9]+|\.inf)|\.nan", list("-+.0123456789")),
):
    _Loader.add_implicit_resolver(f"tag:yaml.org,2002:{_kind}", re.compile(f"^(?:{_pattern})$"), _first)


class _Dumper(yaml.SafeDumper):
    """Dumper that quotes texts which ``_Loader`` would read as other types."""

    yaml_implicit_resolvers = _Loader.yaml_implicit_resolvers


def written(values: dict) -> str:
    """Return the fields of a scene as YAML text."""
    return yaml.dump(values, Dumper=_Dumper, sort_keys=False)


def read(text: str, name: str) -> Any:
    """Return the value of a YAML text; messages call it ``name``."""
    try:
        return yaml.load(text, _Loader)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        where = f" in line {mark.line + 1}" if mark else ""
        problem = getattr(error, "problem", None) or str(error).splitlines()[0]
        raise ConfigError(f"{name}: not usable YAML{where}: {problem}") from error
    except RecursionError as error:
        raise ConfigError(f"{name}: not usable YAML: nested too deeply") from error


def plain(text: str) -> str:
    """Return a text for a message: one line of bounded length."""
    text = text if text.isprintable() else repr(text)[1:-1]
    return text if len(text) <= 200 else text[:197] + "..."
