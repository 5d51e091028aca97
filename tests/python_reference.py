"""Writes the page of the guide on the Python module from its docstrings, which are in the style of numpydoc."""

import ast
import inspect
import re
import textwrap
from pathlib import Path

PACKAGE = Path(__file__).resolve().parent.parent / "python" / "asperity"
# The sources in the order of the page. Their names without underscore at the start are public.
SECTIONS = [
    ("Surfaces", ["_surfaces", "_topography"]),
    ("Contact", ["_press", "_contact"]),
    ("Studies", ["_study", "_plan", "_map", "_table"]),
    ("Laws and corrections", ["_laws"]),
    ("`asperity.persson`", ["persson"]),
    ("`asperity.models`", ["models"]),
    ("Exceptions", ["errors"]),
]
# Sections of a docstring that are lists of `name : type` with indented meanings.
WITH_ITEMS = ["Parameters", "Attributes", "Returns", "Yields", "Raises", "Warns"]
INTRODUCTION = """# Python reference

<!-- Written by `tests/guide.py reference --write` from the docstrings in `python/asperity/`. -->

All names are in the module `asperity`, unless their heading is another module. `help(asperity.press)` shows the
same text. [Use asperity from Python](../how-to/python.md) has examples that belong together; the tests run the
examples on this page.

Heights are arrays `[x, y]` and positive towards the elastic body. Loads are mean pressures in units of E* × rms
slope, and areas are fractions of the apparent area.
"""


def page():
    """Returns the text of the page."""
    public = exported()
    text = INTRODUCTION
    for title, modules in SECTIONS:
        text += f"\n## {title}\n"
        for module in modules:
            tree = ast.parse((PACKAGE / f"{module}.py").read_text(encoding="utf-8"))
            if not module.startswith("_") and module != "errors":
                text += "\n" + markdown(ast.get_docstring(tree))
            for node in tree.body:
                name = getattr(node, "name", "_")
                if isinstance(node, (ast.FunctionDef, ast.ClassDef)) and is_public(name, module, public):
                    text += described(node, "###")
    return text.rstrip() + "\n"


def exported():
    """Returns the public names of the package, as its `__init__` lists them."""
    tree = ast.parse((PACKAGE / "__init__.py").read_text(encoding="utf-8"))
    values = {node.targets[0].id: node.value for node in tree.body if isinstance(node, ast.Assign)}
    return ast.literal_eval(values["_MODULE_OF"])


def is_public(name, module, exported):
    return not name.startswith("_") if not module.startswith("_") else exported.get(name) == module


def described(node, heading):
    """Returns heading, signature and docstring of a function or class, and of the public members of a class."""
    text = f"\n{heading} {node.name}\n\n"
    if isinstance(node, ast.FunctionDef) and not has_decorator(node, "property"):
        text += f"```text\n{signature(node)}\n```\n\n"
    text += markdown(ast.get_docstring(node))
    for member in node.body if isinstance(node, ast.ClassDef) else []:
        if isinstance(member, ast.FunctionDef) and not member.name.startswith("_"):
            text += described(member, "####")
    return text


def has_decorator(node, name):
    return any(isinstance(one, ast.Name) and one.id == name for one in node.decorator_list)


def signature(node):
    """Returns the call with the names and defaults of its arguments; the docstring describes their types."""
    arguments = ast.parse(f"def f({ast.unparse(node.args)}): pass").body[0].args
    everything = [*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs, arguments.vararg, arguments.kwarg]
    for one in filter(None, everything):
        one.annotation = None
    arguments.args = [one for one in arguments.args if one.arg not in ("self", "cls")]
    call = f"{node.name}({ast.unparse(arguments)})"
    return "\n".join(textwrap.wrap(call, 80, subsequent_indent=" " * (len(node.name) + 1), break_long_words=False))


def markdown(docstring):
    """Converts a docstring to Markdown. Sections become paragraphs in bold with lists, and examples blocks."""
    text = re.sub(r":\w+:`~?([^`]+)`", r"`\1`", inspect.cleandoc(docstring)).replace("``", "`")
    parts = re.split(r"^(\w[\w ]*)\n-{3,}\n", text, flags=re.M)
    result = with_examples(parts[0])
    for title, body in zip(parts[1::2], parts[2::2]):
        result += f"\n**{title}**\n\n"
        result += items(body) if title in WITH_ITEMS else with_examples(body)
    return result


def items(body):
    """Returns a list of the entries of a section: `name : type`, then indented lines with the meaning."""
    result = ""
    for entry in re.split(r"\n(?=\S)", body.strip("\n")):
        head, _, meaning = entry.partition("\n")
        name, _, kind = head.partition(" : ")
        kind = f" ({kind.strip()})" if kind else ""
        meaning = " ".join(meaning.split())
        result += f"- `{name.strip('`')}`{kind}{': ' if meaning else ''}{meaning}\n"
    return result


def with_examples(text):
    """Puts the paragraphs that start with `>>>` into blocks."""
    paragraphs = [part for part in re.split(r"\n\s*\n", text.strip()) if part]
    return "".join(f"```pycon\n{one}\n```\n\n" if one.startswith(">>>") else f"{one}\n\n" for one in paragraphs)[:-1]
