# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Holds what --json prints against docs/schemas."""
import functools
import json
import os
import pathlib
import sys

try:
    import jsonschema
except ImportError:
    jsonschema = None
    print("SKIPPED: python3-jsonschema is missing (scripts/install-dependencies --test): nothing that "
          "--json prints is held against docs/schemas", file=sys.stderr)

FOLDER = pathlib.Path(os.environ["RISLEY_SOURCE_DIR"]) / "docs" / "schemas"
VERBS = sorted(path.stem for path in FOLDER.glob("*.json")
               if path.stem not in ("common", "report_file", "columns"))


def _with_local_references(schema):
    if isinstance(schema, dict):
        return {key: value.removeprefix("common.json") if key == "$ref" else
                _with_local_references(value) for key, value in schema.items()}
    return [_with_local_references(one) for one in schema] if isinstance(schema, list) else schema


@functools.lru_cache(maxsize=None)
def schema_of(verb):
    """The schema of a verb in one piece, so that no version of jsonschema looks for another file."""
    common = json.loads((FOLDER / "common.json").read_text(encoding="utf-8"))
    if verb not in VERBS:  # nothing but an error
        return {"$ref": "#/$defs/error", "$defs": common["$defs"]}
    own = json.loads((FOLDER / f"{verb}.json").read_text(encoding="utf-8"))
    twice = own["$defs"].keys() & common["$defs"].keys()
    assert not twice, f"{verb}.json and common.json both define {twice}"
    del own["$id"]
    return _with_local_references({**own, "$defs": {**common["$defs"], **own["$defs"]}})


@functools.lru_cache(maxsize=None)
def _validator(verb):
    jsonschema.Draft202012Validator.check_schema(schema_of(verb))
    return jsonschema.Draft202012Validator(schema_of(verb))


def takes(verb, instance):
    """Whether an object is as the schema of a verb has it."""
    return _validator(verb).is_valid(instance)


def problem(verb, instance):
    """What the schema of a verb has against an object, in words; None where nothing."""
    if jsonschema is None:
        return None
    error = jsonschema.exceptions.best_match(_validator(verb).iter_errors(instance))
    if error is None:
        return None
    return f"docs/schemas/{verb}.json, {error.json_path}: {error.message[:2000]}"


def check_output(arguments, output):
    """Demands that what a command with --json printed is one object as its schema has it."""
    words = [str(one) for one in arguments]
    found = problem(words[0], json.loads(output))
    assert found is None, f"risley {' '.join(words)}: {found}"
