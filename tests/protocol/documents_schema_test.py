"""Every line that the serialiser makes must pass its schema, and the schemas must be able to refuse."""
import copy
import json
import pathlib
import subprocess
import sys
import unittest

from jsonschema import Draft202012Validator, RefResolver

EXAMPLES, SCHEMAS = sys.argv[1], pathlib.Path(sys.argv[2])


def load_schemas():
    return {path.name.removesuffix(".schema.json"): json.loads(path.read_text())
            for path in SCHEMAS.glob("*.schema.json")}


class Schemas(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.schemas = load_schemas()
        cls.stream = cls.validator("stream")
        raw = subprocess.run([EXAMPLES], check=True, capture_output=True).stdout
        cls.lines = raw.decode("utf-8", errors="strict").splitlines()  # valid UTF-8 or an exception
        cls.documents = [json.loads(line, parse_constant=cls.fail) for line in cls.lines]

    @classmethod
    def validator(cls, name):
        schema = cls.schemas[name]
        store = {other["$id"]: other for other in cls.schemas.values()}
        return Draft202012Validator(schema, resolver=RefResolver(schema["$id"], schema, store))

    def test_each_schema_is_a_schema(self):
        for name, schema in self.schemas.items():
            with self.subTest(name):
                Draft202012Validator.check_schema(schema)
                if name != "stream":
                    self.assertIs(schema["additionalProperties"], False)

    def test_each_line_is_valid_and_short(self):
        self.assertEqual(len(self.lines), 31)
        for line, document in zip(self.lines, self.documents):
            with self.subTest(document["type"], seq=document["seq"]):
                self.assertLessEqual(len(line.encode()), 1 << 20)
                own = self.validator(document["type"])
                self.assertEqual([e.message[:200] for e in own.iter_errors(document)], [])
                self.assertTrue(self.stream.is_valid(document))

    def test_each_type_has_an_example(self):
        seen = {document["type"] for document in self.documents}
        self.assertEqual(seen, set(self.schemas) - {"stream", "missed", "rpc_response", "diagnosis"})

    def test_a_changed_line_is_refused(self):
        changes = 0
        for document in self.documents[:13]:
            schema = self.schemas[document["type"]]
            required = schema["required"] + schema.get("then", {}).get("required", [])
            own = self.validator(document["type"])
            for key in required:
                broken = copy.deepcopy(document)
                del broken[key]
                self.assertFalse(own.is_valid(broken), f"{document['type']} without {key}")
                changes += 1
            for key, value in document.items():
                broken = copy.deepcopy(document)
                broken[key] = {"not": "this"}
                self.assertFalse(own.is_valid(broken), f"{document['type']} with another {key}")
                changes += 1
            broken = dict(document, surprise=1)
            self.assertFalse(self.stream.is_valid(broken))
        self.assertGreater(changes, 100)

    def test_what_is_left_out_is_said(self):
        for document in self.documents:
            for entry in document.get("omitted", []):
                *path, last = entry["pointer"].split("/")[1:]
                place = document
                for part in path:
                    place = place[int(part) if isinstance(place, list) else part]
                if isinstance(place, list):
                    self.assertEqual(len(place), int(last))
                else:
                    self.assertNotIn(last, place)
        self.assertGreater(sum("omitted" in document for document in self.documents), 6)

    def test_answers_and_the_last_line_to_a_slow_client(self):
        good = [{"type": "missed", "count": 3}, {"jsonrpc": "2.0", "id": 1, "result": {}},
                {"jsonrpc": "2.0", "id": None, "error": {"code": -32700, "message": "Not JSON."}}]
        bad = [{"type": "missed", "count": 0}, {"jsonrpc": "2.0", "id": 1},
               {"jsonrpc": "2.0", "id": 1, "result": 1, "error": {"code": 1, "message": ""}}]
        for line in good:
            self.assertTrue(self.stream.is_valid(line), line)
        for line in bad:
            self.assertFalse(self.stream.is_valid(line), line)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
