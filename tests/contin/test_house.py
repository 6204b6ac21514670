"""The house rules of contin, read from its source: sizes, comments of constants, and what may import what."""

import ast
import functools
import io
import itertools
import re
import tokenize
from pathlib import Path

import pytest
from importlinter.cli import lint_imports

import contin

PACKAGE = Path(contin.__file__).parent
ROOT = Path(__file__).parents[2]
FILES = sorted(PACKAGE.rglob("*.py"))

MOST_LINES = 60
MOST_ARGUMENTS = 8
#: A picture of the matrix may make these longer.
LONGER = {"kernel", "helper", "instruction"}
CONSTANT = re.compile(r"_?[A-Z][A-Z0-9_]*")
#: Comments that are addressed to a tool.
DIRECTIVE = re.compile(r"#\s*(noqa|fmt:|type:|pragma)")


# --- what stands in a file ------------------------------------------------------------------------------------------


def functions(tree):
    """Every function with its class, or None; those inside other functions too."""
    for node in ast.walk(tree):
        for child in ast.iter_child_nodes(node):
            if isinstance(child, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)):
                yield child, node if isinstance(node, ast.ClassDef) else None


def decorators(function):
    """Their names, without arguments and without the module that they come from."""
    for node in getattr(function, "decorator_list", ()):
        node = node.func if isinstance(node, ast.Call) else node
        yield node.attr if isinstance(node, ast.Attribute) else getattr(node, "id", "")


def long_functions(tree):
    for function, _ in functions(tree):
        lines = function.end_lineno - function.lineno + 1
        if not isinstance(function, ast.Lambda) and lines > MOST_LINES and not LONGER & set(decorators(function)):
            yield f"{function.lineno}: {function.name} has {lines} lines"


def crowded_functions(tree):
    for function, owner in functions(tree):
        name = getattr(function, "name", "lambda")
        given = function.args
        names = [argument.arg for argument in (*given.posonlyargs, *given.args, *given.kwonlyargs)]
        names += [argument.arg for argument in (given.vararg, given.kwarg) if argument is not None]
        if owner is not None and names[:1] in (["self"], ["cls"]):
            names = names[1:]
        public = name if owner is None else owner.name
        if len(names) > MOST_ARGUMENTS and public not in contin.__all__:
            yield f"{function.lineno}: {name} has {len(names)} arguments"


def assigned(statement):
    """The names that a statement of a module assigns, and its value."""
    if isinstance(statement, ast.AnnAssign) and statement.value is not None:
        targets = [statement.target]
    elif isinstance(statement, ast.Assign):
        targets = statement.targets
    else:
        return [], None
    parts = itertools.chain.from_iterable(getattr(target, "elts", [target]) for target in targets)
    return [part.id for part in parts if isinstance(part, ast.Name)], statement.value


def is_literal(value):
    try:
        ast.literal_eval(value)
    except ValueError:
        return False
    return True


def bare_constants(tree, text):
    """Constants without a comment directly above, on their own lines, or above the first of their group."""
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    comments = {t.start[0] for t in tokens if t.type == tokenize.COMMENT and not DIRECTIVE.match(t.string)}
    end, told = None, False  # of the assignment before: its last line, and whether it has a comment
    for statement in tree.body:
        names, value = assigned(statement)
        if not names:
            end = None
            continue
        own = any(line in comments for line in range(statement.lineno - 1, statement.end_lineno + 1))
        told = own or (told and end == statement.lineno - 1)
        end = statement.end_lineno
        for name in names:
            if CONSTANT.fullmatch(name) and (name.startswith("_") or is_literal(value)) and not told:
                yield f"{statement.lineno}: {name} has no comment"


# --- the package ----------------------------------------------------------------------------------------------------


@functools.cache
def source(path):
    return path.read_text(encoding="utf-8")


@functools.cache
def tree_of(path):
    return ast.parse(source(path))


def said(check):
    """All that a check has to say of the package."""
    return [f"contin/{path.relative_to(PACKAGE)}:{what}" for path in FILES for what in check(path)]


def listed(found):
    return "\n".join(["", *found])


@pytest.mark.full
def test_no_function_is_longer_than_a_screen():
    found = said(lambda path: long_functions(tree_of(path)))
    assert not found, listed(found)


@pytest.mark.full
def test_no_function_has_more_than_eight_arguments():
    found = said(lambda path: crowded_functions(tree_of(path)))
    assert not found, listed(found)


@pytest.mark.full
def test_every_constant_says_where_it_comes_from():
    found = said(lambda path: bare_constants(tree_of(path), source(path)))
    assert not found, listed(found)


def test_imports_keep_the_contracts(monkeypatch):
    """One direction between packages and rooms, no circles, one gate to the compiler: as pyproject.toml has them."""
    monkeypatch.chdir(ROOT)
    assert lint_imports(config_filename="pyproject.toml", cache_dir=None) == 0


# --- the rules themselves -------------------------------------------------------------------------------------------

SAMPLE = """
#: Told.
_A = 1
_B = 2

_C = 3
D = "text"
E, _F = 4, 5  # told
_G = max(_A, _B)
H = max(_A, _B)
#: Told.

_I = 6
_J = [
    7,  # noqa: told to a tool
]


class Own:
    def method(self, a, b, c, d, e, f, g, h):
        return lambda a, b, c, d, e, f, g, h, i: a

    def another(self, a, b, c, d, *, e, f, g, h, **i):
        return a
"""


def test_the_rules_see_what_they_are_about():
    tree = ast.parse(SAMPLE)
    assert [what.split()[1] for what in bare_constants(tree, SAMPLE)] == ["_C", "D", "_I", "_J"]
    assert [what.split(maxsplit=1)[1] for what in crowded_functions(tree)] == [
        "another has 9 arguments", "lambda has 9 arguments",
    ]  # fmt: skip
    body = "\n    pass" * MOST_LINES
    sources = f"def f():{body}", f"def f():{body[9:]}", f"@helper(inline=True)\ndef f():{body}", f"@x.kernel\ndef f():{body}"
    assert [len([*long_functions(ast.parse(source))]) for source in sources] == [1, 0, 0, 0]
