"""What check_public_headers.py finds, on includes that are written here."""
import unittest

from check_public_headers import closure, faults, listed

TREE = {"a.hpp": ["b.hpp"], "b.hpp": ["c.hpp", "a.hpp"], "c.hpp": [], "private.hpp": ["c.hpp"]}


def found(entries: list[str], others: list[str], shown: set[str]) -> list[str]:
    return faults(entries, others, shown, lambda header: TREE.get(header, []))


class PublicHeaders(unittest.TestCase):
    def test_the_closure_follows_every_include_once(self):
        self.assertEqual(closure(["a.hpp"], TREE.get), {"a.hpp", "b.hpp", "c.hpp"})

    def test_a_complete_list_has_no_fault(self):
        self.assertEqual(found(["a.hpp"], ["b.hpp", "c.hpp"], {"a.hpp"}), [])

    def test_a_missing_header_is_named(self):
        self.assertRegex("\n".join(found(["a.hpp"], ["b.hpp"], {"a.hpp"})), r"\Ac.hpp is missing .* a public header")

    def test_a_header_of_an_example_must_be_in_the_first_part(self):
        self.assertRegex("\n".join(found(["a.hpp"], ["b.hpp", "c.hpp"], {"b.hpp"})), r"\Ab.hpp is missing in the first")

    def test_a_private_header_is_named(self):
        self.assertRegex("\n".join(found(["a.hpp"], ["b.hpp", "c.hpp", "private.hpp"], {"a.hpp"})),
                         r"\Aprivate.hpp is private")

    def test_a_header_that_stands_twice_is_named(self):
        self.assertRegex("\n".join(found(["a.hpp"], ["b.hpp", "c.hpp", "c.hpp"], {"a.hpp"})), r"\Ac.hpp stands twice")

    def test_the_list_has_two_parts(self):
        text = "# words\nINPUT += a.hpp\n\n# What these include:\nINPUT += b.hpp\n"
        self.assertEqual(listed(text), (["a.hpp"], ["b.hpp"]))


if __name__ == "__main__":
    unittest.main()
