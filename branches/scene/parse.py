"""Scenes from files and texts: the one parser, the one way in which a mistake is told, and the one text of a scene."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

import yaml
from pydantic import BaseModel, ValidationError

from branches.scene.closed import ClosedScene
from branches.scene.fields import ConfigError, Scene, alone, missing, plain, show, unknown
from contin.lowlevel import meant

if TYPE_CHECKING:
    from branches.scene.sweep import Sweep

#: Largest number of branches in one scene. With ten times more, a mistyped list would run for hours.
_MOST_BRANCHES = 10_000
#: Largest size of a scene. Scenes have a few lines; a larger file is not a scene (or is a device that never ends).
_MOST_BYTES = 1_000_000
#: The first bytes of an HDF5 file, by its specification.
_HDF5 = b"\x89HDF\r\n\x1a\n"


def load(path: str | Path, settings: Sequence[str] = ()) -> Scene | Sweep:
    """Return the scene of a YAML file, changed by ``key=value`` settings (dotted keys, YAML values).

    Raises
    ------
    ConfigError
        A file that cannot be read, or a field that is unknown, of the wrong type or invalid.
    """
    try:
        with open(path, "rb") as file:
            data = file.read(_MOST_BYTES + 1)
        text = data.decode("utf-8")
    except FileNotFoundError as error:
        beside = [one.name for one in Path(path).parent.glob("*.y*ml")]
        near = meant(Path(path).name, (*(one.stem for one in scenes()), *beside))
        of_package = "'ribbon scenes' lists those of the package"
        raise ConfigError(f"cannot read the config {str(path)!r}: {error.strerror}{near}; {of_package}") from error
    except OSError as error:
        told = "it is a folder; a scene is a YAML file" if Path(path).is_dir() else error.strerror
        raise ConfigError(f"cannot read the config {str(path)!r}: {told}") from error
    except UnicodeDecodeError as error:
        told = "it is a result, which 'ribbon plot' draws" if data.startswith(_HDF5) else "it is not UTF-8 text"
        raise ConfigError(f"cannot read the config {str(path)!r}: {told}") from error
    if len(data) > _MOST_BYTES:
        raise ConfigError(f"cannot read the config {str(path)!r}: it is larger than a megabyte; a scene must be smaller")
    return parse(text, plain(str(path)), settings)


def parse(text: str, name: str, settings: Sequence[str] = ()) -> Scene | Sweep:
    """Return the scene of a YAML text, or the sweep of one with lists; messages call the text ``name``."""
    values = read(text, name)
    if not isinstance(values, dict):
        found = "it is empty" if values is None else f"not {show(values)}"
        raise ConfigError(f"{name}: must hold `key: value` lines; {found}")
    for setting in settings:
        key, equals, value = setting.partition("=")
        parts = key.strip().split(".")
        if not equals or "" in parts:
            raise ConfigError(f"--set {setting!r}: must be key=value, as in nu=0.2 or mesh.degree=5")
        fields, value = values, read(value, f"--set {plain(key)}")
        for part in parts[:-1]:
            fields = fields.setdefault(part, {})
            if not isinstance(fields, dict):
                raise ConfigError(f"--set {plain('.'.join(parts))}: {part!r} has no fields")
        fields[parts[-1]] = value
    kind: type[Scene] = ClosedScene
    if "strips" in values:
        from branches.scene.network import NetworkScene as kind
    elif "stages" in values:
        from branches.scene.open_strip import OpenScene as kind  # 0.15 s, which closed strips do not need
    try:
        values = kind.prepared(values)
        lists = {place: one for pattern in kind.LISTS for place, one in _at(values, pattern) if isinstance(one, list)}
        if lists or "pairs" in values and kind.PAIRS:
            return _sweep(kind, values, lists)
        return kind.model_validate(values)
    except ValidationError as error:
        raise ConfigError(f"{_origin(error, name, settings)}: {_sentence(error, kind)}") from error
    except ValueError as error:
        raise ConfigError(f"{name}: {error}") from error


def _sweep(kind: type[Scene], values: dict, lists: dict[tuple, list]) -> Sweep:
    """Return the scenes of all combinations of lists; raise ValueError for a field invalid in all, or a combination twice."""
    from branches.scene.sweep import Sweep, combinations  # most scenes are of one branch

    for place, entries in lists.items():
        if not entries or any(isinstance(entry, (list, dict)) for entry in entries):
            empty = "" if entries else ": the list is empty"
            raise ValueError(f"{'.'.join(map(str, place))}: must be a number, or a list of numbers, not {show(entries)}{empty}")
    axes = kind.axes(values, lists)
    count = math.prod(len(entries) for _, entries in axes)
    if count > _MOST_BRANCHES:
        raise ValueError(f"{count} branches are more than {_MOST_BRANCHES}")
    scenes: dict[str, Scene] = {}
    numbers, absent = {}, {}
    for chosen, whole in combinations(values, axes):
        fields = kind.combination(whole, lists)
        if fields is None:
            continue
        try:
            one = kind.model_validate(fields)
        except ValidationError as error:
            if error.errors()[0]["loc"]:
                raise
            absent[kind.words_of(fields, chosen)] = _sentence(error, kind)
            continue
        file = one.file_of(chosen)
        if file in scenes:
            raise ValueError(kind.same_name(kind.words_of(fields, chosen), scenes[file], one))
        scenes[file], numbers[file] = one, chosen
    if not scenes:
        reason = next(iter(absent.values()), "n = m is a rigid rotation")
        raise ValueError(f"none of its branches can be run ({reason})")
    return Sweep(str(values.get("title", "")), values, scenes, numbers, absent)


def dump(scene: Scene | Sweep) -> str:
    """Return the YAML text of a scene without fields at their defaults; `parse` reads it back."""
    return written(scene.fields())


def difference(stored: Scene, scene: Scene, ignored: Sequence[str] = ()) -> str:
    """Return the first field in which the scene of a file differs from another scene, in words; '' if they agree.

    Parameters
    ----------
    ignored : sequence of str
        Fields that may differ: ``title``, or ``steps.max_points`` for one inside another.
    """
    if stored.KIND != scene.KIND:
        return f"a {stored.KIND} there, a {scene.KIND} here"
    a, b = stored.model_dump(), scene.model_dump()
    for field in ignored:
        name, _, inner = field.partition(".")
        for values in (a, b):
            (values[name] if inner else values).pop(inner or name, None)
    for name in a:
        if a[name] != b[name]:
            return f"{name} = {a[name]!r} there, {b[name]!r} here"
    return ""


def _at(value: object, pattern: Sequence[str], place: tuple = ()) -> Iterator[tuple[tuple, Any]]:
    """Yield the places below a value that match a pattern, in which ``*`` and ``#`` are any key, and what is there."""
    if not pattern:
        yield place, value
    elif pattern[0] == "#":
        for number, one in enumerate(value if isinstance(value, list) else ()):
            yield from _at(one, pattern[1:], (*place, number))
    elif isinstance(value, dict):
        for key in list(value) if pattern[0] == "*" else [pattern[0]] if pattern[0] in value else []:
            yield from _at(value[key], pattern[1:], (*place, key))


# --- messages -----------------------------------------------------------------------------------------------------


#: Words of pydantic, and ours for them.
_OURS = {
    "Input should be": "must be", "List should": "must",
    "a valid integer": "a whole number", "a valid boolean": "true or false",
    "a valid number": "a number", "a valid string": "text", "a valid list": "a list",
    "a valid dictionary": "`key: value` fields",
    "greater than or equal to": "at least", "less than or equal to": "at most", "greater than": "above", "less than": "below",
}  # fmt: skip


def _where(complaint) -> str:
    return plain(".".join(str(part) for part in complaint["loc"] if part != "[key]"))


def _origin(error: ValidationError, name: str, settings: Sequence[str]) -> str:
    """Return the setting that the sentence is about, otherwise the file."""
    where = _where(_in_order(error)[0])
    for setting in reversed(settings):
        key = setting.partition("=")[0].strip()
        if f"{where}.".startswith(f"{key}.") or f"{key}.".startswith(f"{where}."):
            return f"--set {plain(setting)}"
    return name


def _in_order(error: ValidationError) -> list:
    """Return the complaints, unknown fields first: one that is mistyped is missing, too."""
    return sorted(error.errors(), key=lambda one: one["type"] != "extra_forbidden")


def _sentence(error: ValidationError, model: type[BaseModel]) -> str:
    """Return the first complaint as `field: value ... what is allowed`, and the number of further ones."""
    errors = _in_order(error)
    first, told = errors[0], 1
    where, kind, message = _where(first), first["type"], first["msg"].removeprefix("Value error, ")
    if kind == "extra_forbidden":
        text = unknown(where, _fields(first["loc"], model))
    elif kind == "missing":
        absent = [_where(one) for one in errors if one["type"] == "missing"]
        text, told = missing(absent), len(absent)
    elif kind == "value_error":
        text = f"{where}: {message}" if where else message
    elif kind == "invalid_key" or (first["loc"][-1:] == ("[key]",) and not isinstance(first["input"], str)):
        text = f"{where}: names of fields are words, not {show(first['input'])}; a number has a decimal point, as in 1.2"
    elif kind in ("model_type", "dict_type"):
        text = f"{where}: must hold `key: value` fields, not {show(first['input'])}"
    else:
        for words, ours in _OURS.items():
            message = message.replace(words, ours)
        counted = "after validation" in message  # pydantic's words about lists that are too long or too short
        value = "" if counted else f", not {show(first['input'])}{alone(first['input'])}"
        text = f"{where}: {message[0].lower()}{message[1:].replace(' after validation', '')}{value}"
        if kind == "literal_error":
            text += meant(str(first["input"]), re.findall("'([^']+)'", first["ctx"]["expected"]))
    return text + (f" (and {len(errors) - told} more)" if len(errors) > told else "")


def _fields(location, model: type[BaseModel]) -> list[str]:
    for part in location[:-1]:
        field = model.model_fields.get(part)
        model = next(_models(field.annotation), model) if field else model
    return list(model.model_fields)


def _models(kind: Any) -> Iterator[type[BaseModel]]:
    """Yield the models in the type of a field, as in a dict of lists of them."""
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        yield kind
    for inner in get_args(kind):
        yield from _models(inner)


# --- the scenes of the package ----------------------------------------------------------------------------------------


#: The folder of scenes: in an installed package, and in a working copy.
_FOLDERS = Path(__file__).resolve().parents[1] / "configs", Path(__file__).resolve().parents[2] / "configs"


def scenes() -> list[Path]:
    """Return the files of all scenes of the package, by name."""
    return sorted(file for folder in _FOLDERS for file in folder.glob("*.yaml"))


def found(name: str) -> str:
    """Return the file of a scene: the given one, or, where there is none (a folder is none), that of the package of this name.

    Examples
    --------
    >>> Path(found("m1_n2")).name, found("no such scene")
    ('m1_n2.yaml', 'no such scene')
    """
    return name if Path(name).is_file() else next((str(file) for file in scenes() if file.stem == name), name)


# --- YAML -------------------------------------------------------------------------------------------------------------


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
