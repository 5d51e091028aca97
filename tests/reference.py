"""Writes the pages of the guide on keys, columns and commands from what the program prints of itself."""

import json
import re
import subprocess

KEYS_HEAD = """# Manifest keys

<!-- Written by `tests/guide.py reference --write` from `asperity schema`. -->

A manifest has one table `[study]`, a table `[stage.NAME]` for each stage, of one kind, tables
`[figure.NAME]`, `[claim.NAME]` and `[data.NAME]` for the figures and claims that it declares, and optionally a
table `[parameters]`. Values of another type, values out of bounds, unknown keys and missing required keys are
errors. The message names the key, its value and its position, and explains how to correct it. Numbers are
compared with twelve significant digits.

- *swept* – a list of values gives one parameter point per value; several lists give a grid.
- *pair* – `[along x, along y]`, for rectangles.
- `cases`, allowed if any key is swept, lists parameter points explicitly: each of its tables sets some of the
  swept keys.
- `from` names the stage that is read, or lists several stages.
- A text in the place of a number is an [expression](../how-to/variants.md) in other keys of the same parameter
  point and in parameters, such as `"8 * k_upper"`.

A *text with a unit* is a number and a unit, such as `"100 um"` or `"210 GPa"`. Units of length are `m`, `cm`,
`mm`, `um` (`µm`), `nm`, `Å` and `pm`; units of pressure are `Pa`, `kPa`, `MPa`, `GPa`, `N/mm²` and `bar`.
Units of force, for loads, are `N`, `kN`, `MN`, `mN`, `uN` (`µN`) and `nN`.
[Units](../how-to/materials.md) says which unit the tables then have. Lengths without a unit are in the unit of
`side`, and pressures in the unit of `effective_modulus` or of the moduli of the bodies; you choose both units.
Loads without a unit are mean pressures in units of E* × rms slope, unless `load_unit` is set.
"""
PARAMETERS = """
## `[parameters]`

Numbers, lists of numbers to sweep, and expressions in other parameters, each with a name of letters, digits
and `_`. Keys of stages use them in expressions; a list is one axis of each stage that uses it. See
[variants](../how-to/variants.md).
"""
COLUMNS_HEAD = """# Columns

<!-- Written by `tests/guide.py reference --write` from `asperity columns`. -->

All columns of tables, sorted by the first kind of stage that has them. A table also has those columns of its
input tables that distinguish its rows. `asperity columns MANIFEST [STAGE]` lists the columns of a study, and
the metadata of the fields of every table contain the same description.

Unit `1` marks a pure number; columns without numbers have no unit. *Length* and *pressure* are in the units
that the manifest uses for `side` and for `effective_modulus` or `bodies`.
"""
COMMANDS_HEAD = """# The command line

<!-- Written by `tests/guide.py reference --write` from `asperity COMMAND --help`. -->

Exit codes: 0 success, 1 a task or a file failed, 2 error in the manifest or the command line, 130 stopped
by Ctrl-C, 143 stopped by `kill`, 129 terminal closed.

`ASPERITY_DATA` sets the default of `--data`. `ASPERITY_SIMD` selects the instruction set: `avx512`, `avx2` or
`portable`; the default is the widest set of the processor. `NO_COLOR` turns colours off.
"""
# Pages of the guide with the formulas of each kind of stage, in the order of a study.
THEORY = {
    "generate": "surfaces.md",
    "solve": "contact.md",
    "measure": "surfaces.md",
    "correct": "corrections.md",
    "fit": "laws.md",
    "aggregate": "models.md",
}
# Keys that the head of the page explains.
EXPLAINED = {"kind", "from", "cases"}
# Pattern of texts in the place of a number that are expressions, but not quantities with a unit.
EXPRESSIONS = {"[A-Za-z_*/^()+]", "[*/^()+]"}
ALTERNATIVES = ["oneOf", "anyOf"]
# Name and text of an option or of an argument in the help of a command. The text begins beside the name or below it,
# and all its lines are indented.
OPTION = r"^ {2,6}((?:-\w, )?--[\w-]+(?: <\S+>)?|[<[]\S+)\s+(.*\n(?: {10}.*\n|\n(?= {10}))*)"


def keys_page(program):
    schema = without_expressions(json.loads(printed(program, "schema")))["properties"]
    page = f"{KEYS_HEAD}\n## `[study]`\n\n" + items(schema["study"]) + PARAMETERS
    forms = schema["stage"]["additionalProperties"]["oneOf"]
    for kind, theory in THEORY.items():
        page += f"\n## `kind = \"{kind}\"`\n\nFormulas: [theory](../theory/{theory}).\n\n"
        page += kind_section([form for form in forms if word(form, "kind") == kind])
    for table in ["figure", "claim", "data"]:
        form = schema[table]["additionalProperties"]
        page += f"\n## `[{table}.NAME]`\n\n{form['description']}\n\n" + items(form)
    return page


def without_expressions(schema):
    """Returns a schema in which a number is not an expression, and a number with a unit has `unit`."""
    if isinstance(schema, list):
        return [without_expressions(part) for part in schema]
    if not isinstance(schema, dict):
        return schema
    schema = {key: without_expressions(part) for key, part in schema.items()}
    types = schema.get("type")
    if isinstance(types, list) and {"number", "integer"} & set(types) and "pattern" in schema:
        schema["unit"] = schema.pop("pattern") not in EXPRESSIONS
        schema["type"] = [name for name in types if name != "string"]
    return schema


def kind_section(forms):
    selector = next((key for key in ["method", "law"] if word(forms[0], key)), None)
    if selector:
        text = f"| `{selector}` | meaning |\n|---|---|\n"
        for form in forms:
            default = " (default)" if form is forms[0] else ""
            key = form["properties"][selector]
            text += f'| `"{key["const"]}"`{default} | {key["description"]} |\n'
        text += "\n"
    else:
        text = f"{forms[0]['description']}\n\n"
    # Equal keys of several variants are one entry.
    entries = {}
    for form in forms:
        for name, key in form["properties"].items():
            if name not in EXPLAINED | {selector}:
                entry = (name, json.dumps(key), is_required(form, name))
                entries.setdefault(entry, []).append(word(form, selector))
    for (name, key, required), words in sorted(entries.items(), key=lambda entry: entry[0][0]):
        text += item(name, json.loads(key), required, words if len(words) < len(forms) else [])
    return text


def items(table, depth=0):
    keys = table.get("properties", {}).items()
    return "".join(item(name, key, is_required(table, name), [], depth) for name, key in keys)


def item(name, key, required, words, depth=0):
    """Returns a key as a list item, with the keys of its table as indented items below it.

    `words` are the methods or laws that have the key, if others do not.
    """
    value, swept = unswept(key)
    facts = [described(value)]
    if swept:
        facts.append("*swept*")
    if required:
        facts.append("**required**")
    if key.get("default", "") != "":
        facts.append(f"default `{toml(key['default'])}`")
    if words:
        facts.append("only for " + ", ".join(f'`"{word}"`' for word in words))
    text = f"{'  ' * depth}- `{name}` – {'; '.join(facts)}. {key.get('description', '')}\n"
    for part in parts(value):
        if "const" in part:
            text += f"{'  ' * depth}  - `{toml(part['const'])}` – {part.get('description', '')}\n"
        text += items(part, depth + 1)
    return text


def unswept(key):
    """Returns the schema of a single value, and whether the key may be swept over a list of values."""
    match key.get("anyOf"):
        case [one, many] if many.get("description") == "swept over its values":
            return one, True
        case [one, many] if many.get("items") == one:
            return many, False
    return key, False


def parts(value):
    """Returns the schemas that a value, or an item of a list or table, may have."""
    for several in ALTERNATIVES:
        if several in value:
            return [part for one in value[several] for part in parts(one)]
    if value.get("type") == "array" and "items" in value:
        return parts(value["items"])
    more = value.get("additionalProperties")
    return parts(more) if isinstance(more, dict) else [value]


def described(value):
    """Describes the values that a key accepts."""
    for several in ALTERNATIVES:
        if several in value:
            if all("const" in one for one in value[several]):
                return "a word"
            return ", or ".join(map(described, value[several]))
    types = value.get("type", [])
    types = [types] if isinstance(types, str) else types
    if "array" in types and len(types) > 1:
        return described(value | {"type": [name for name in types if name != "array"]}) + ", or a pair"
    if "const" in value:
        return f"`{toml(value['const'])}`"
    unit = ", or a text with a unit" if value.get("unit") else ""
    match types[:1]:
        case ["integer"]:
            return f"a whole number{bounds(value)}"
        case ["number"]:
            return f"a number{bounds(value)}{unit}"
        case ["array"]:
            pair = value.get("minItems") == value.get("maxItems") == 2
            return f"a {'pair' if pair else 'list'}, each {described(value['items'])}"
    return {"boolean": "`true` or `false`", "string": "a text", "object": "a table"}.get(*types[:1], "anything")


def bounds(value):
    limits = [[("minimum", "from"), ("exclusiveMinimum", "above")], [("maximum", "to"), ("exclusiveMaximum", "below")]]
    found = [next((f" {word} {toml(value[key])}" for key, word in limit if key in value), "") for limit in limits]
    return "".join(found)


def toml(value):
    return json.dumps(value, ensure_ascii=False).replace("e-0", "e-")


def is_required(form, name):
    """Returns whether a key is required, in the table itself or in each of the `cases`."""
    of_cases = form.get("anyOf", [{}])[0].get("required", [])
    return name in form.get("required", []) or name in of_cases


def word(form, key):
    return form["properties"].get(key, {}).get("const", "")


def columns_page(program):
    page, known = COLUMNS_HEAD, []
    for kind in json.loads(printed(program, "columns", "--json")):
        page += f"\n## `{kind['kind']}`\n\n| column | unit | meaning |\n|---|---|---|\n"
        for column in kind["columns"]:
            codes = [f"`{code['code']}`: {code['meaning']}" for code in column.get("codes", [])]
            meaning = ". ".join([column["meaning"], *codes])
            row = f"| `{column['name']}` | {cell(column['unit'])} | {cell(meaning)} |\n"
            page += row if row not in known else ""
            known.append(row)
    return page


def cell(text):
    return text.replace("|", "\\|").replace("<", "&lt;")


def commands_page(program):
    commands = printed(program, "--help").split("\nCommands:\n")[1].split("\n\n")[0]
    names = [name for name in re.findall(r"^  (\S+) ", commands, re.M) if name != "help"]
    helps = {name: printed(program, name, "--help") for name in names}
    options = {name: dict(re.findall(OPTION, text + "\n", re.M)) for name, text in helps.items()}
    of_all = set.intersection(*map(set, options.values()))
    page = f"{COMMANDS_HEAD}\nOptions of every command:\n\n"
    page += "".join(option_item(*option) for option in options[names[0]].items() if option[0] == "--data <DIR>")
    for name in names:
        about, usage = helps[name].split("\n\nUsage: ")
        page += f"\n## `asperity {name}`\n\n{sentence(about)}\n\n```text\n{usage.splitlines()[0]}\n```\n"
        own = [option_item(*option) for option in options[name].items() if option[0] not in of_all]
        page += "\n" + "".join(own) if own else ""
    return page


def option_item(name, text):
    """Returns an option or an argument as a list item; `text` is what the help says of it."""
    whole = " ".join(text.split())
    text, _, words = whole.partition(" Possible values: ")
    words = re.findall(r"- (\S+):", words)
    if found := re.search(r" ?\[possible values: (.*?)\]", text):
        words = found[1].split(", ")
    default = re.search(r"\[default: (.*?)\]", whole)
    text = sentence(re.sub(r" ?\[(possible values|default|env): .*?\]| ?\[env: \w+=\]", "", text))
    text += f" One of {', '.join(f'`{word}`' for word in words)}." if words else ""
    text += f" Default: `{default[1]}`." if default else ""
    return f"- `{name.strip('[]<>.') if name[0] in '[<' else name}` – {text}\n"


def sentence(text):
    """Joins a text into one line, and ends it with a full stop."""
    text = " ".join(text.split())
    return text if text.endswith((".", "!", "?")) else f"{text}."


def printed(program, *arguments):
    return subprocess.run([program, *arguments], check=True, capture_output=True, text=True).stdout
