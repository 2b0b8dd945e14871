"""Schemas, examples and parser agree: examples validate, bad input does not (where a schema can see
it), and the examples together show every key that a schema knows."""
import copy
import json
import pathlib
import re
import sys
import unittest

import jsonschema

ROOT = pathlib.Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "config" / "examples"
COMMENT = re.compile(r'("(?:\\.|[^"\\])*")|//[^\n]*|/\*.*?\*/', re.DOTALL)


def load(path):
    text = path.read_text()
    return json.loads(COMMENT.sub(lambda m: m.group(1) or "", text))


SCHEMAS = {kind: load(ROOT / "config" / "schema" / f"{kind}.schema.json")
           for kind in ("rig", "model", "campaign")}


def validator(name):
    schema = SCHEMAS[name.split("-")[0]]
    store = {each["$id"]: each for each in SCHEMAS.values()}
    resolver = jsonschema.RefResolver(schema["$id"], schema, store=store)
    return jsonschema.Draft202012Validator(schema, resolver=resolver)


def changed(document, row):
    document = copy.deepcopy(document)
    *path, last = (row.get("set") or row["remove"]).split("/")[1:]
    at = document
    for key in path:
        at = at[int(key)] if isinstance(at, list) else at[key]
    last = int(last) if isinstance(at, list) else last
    if "set" in row:
        at[last] = row["to"]
    else:
        del at[last]
    return document


def keys_of_schema(node, keys):
    if isinstance(node, dict):
        keys.update(node.get("properties", {}))
        for value in node.values():
            keys_of_schema(value, keys)
    elif isinstance(node, list):
        for value in node:
            keys_of_schema(value, keys)


def keys_of(node, keys):
    if isinstance(node, dict):
        keys.update(node)
        node = list(node.values())
    if isinstance(node, list):
        for value in node:
            keys_of(value, keys)


class Schemas(unittest.TestCase):
    def test_are_schemas(self):
        for schema in SCHEMAS.values():
            jsonschema.Draft202012Validator.check_schema(schema)

    def test_examples_validate(self):
        examples = sorted(EXAMPLES.glob("*.json"))
        self.assertGreaterEqual(len(examples), 10)
        for path in examples:
            with self.subTest(path.name):
                validator(path.stem).validate(load(path))

    def test_bad_input_does_not(self):
        for row in load(ROOT / "tests" / "config" / "bad_input.json"):
            with self.subTest(row=row):
                document = changed(load(EXAMPLES / f"{row['base']}.json"), row)
                self.assertEqual(validator(row["base"]).is_valid(document), not row["schema"])

    def test_examples_show_every_key(self):
        shown, known = set(), set()
        for path in EXAMPLES.glob("*.json"):
            keys_of(load(path), shown)
        for schema in SCHEMAS.values():
            keys_of_schema(schema, known)
        # Channels of a Modbus sensor that no example has.
        self.assertEqual(known - shown, {"acceleration", "force", "aux7", "aux8", "label", "record_to",
                                         "false_alarms_per_run", "resumes"})


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], "-v"])
