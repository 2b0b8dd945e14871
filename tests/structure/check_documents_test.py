"""check_documents.py finds each fault that it is there for, and nothing in a good page."""
import contextlib
import io
import pathlib
import tempfile
import unittest

import check_documents


class Documents(unittest.TestCase):
    def check(self, text, name="docs/page.md"):
        """What check_documents prints and returns about one page beside a good neighbour."""
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder).resolve()
            page = root / name
            page.parent.mkdir(parents=True, exist_ok=True)
            page.write_text(text)
            (page.parent / "other.md").write_text("# The `other` page: 1, 2\n\n## Twice\n\n## Twice\n")
            (page.parent / "build").mkdir()
            (page.parent / "build" / "left_alone.md").write_text("x" * 200)
            out = io.StringIO()
            with contextlib.redirect_stdout(out):
                status = check_documents.main(root)
            return status, out.getvalue()

    def passes(self, text, name="docs/page.md"):
        status, out = self.check(text, name)
        self.assertEqual(status, 0, out)

    def fails(self, text, sentence, name="docs/page.md"):
        status, out = self.check(text, name)
        self.assertEqual(status, 1, out)
        self.assertIn(sentence, out)

    def test_a_good_page_passes(self):
        self.passes("# A\n\n[b](other.md), [here](#a), [web](https://example.org/x), ![c](other.md)\n\n| a | b |\n")

    def test_a_line_of_121_columns_fails_and_one_of_120_does_not(self):
        self.fails("x" * 121, "docs/page.md:1: 121 columns")
        self.passes("ü" * 120)

    def test_a_page_of_201_lines_fails_but_not_among_notes_and_not_the_changelog(self):
        self.fails("a\n" * 201, "docs/page.md: 201 lines")
        self.passes("a\n" * 200)
        self.passes("a\n" * 201, "docs/notes/page.md")
        self.passes("a\n" * 201, "CHANGELOG.md")

    def test_a_cell_of_16_words_fails_and_one_of_15_does_not(self):
        self.fails(f"| a | {'word ' * 16}|", "docs/page.md:1: a cell of 16 words")
        self.passes(f"| a | {'word ' * 15}|")
        self.passes(f"```\n| a | {'word ' * 16}|\n```")

    def test_an_escaped_bar_does_not_end_a_cell(self):
        self.fails(f"| a | {'word ' * 8} \\| {'word ' * 8}|", "a cell of 16 words")

    def test_a_link_needs_its_file(self):
        self.fails("a\n[b](gone.md)", "docs/page.md:2: there is no gone.md")
        self.fails("![b](gone.svg)", "there is no gone.svg")

    def test_a_link_in_a_tables_cell_and_one_around_a_picture_are_links(self):
        self.fails("| [b](gone.md) |", "there is no gone.md")
        self.fails("[![p](other.md)](gone.md)", "there is no gone.md")

    def test_a_link_needs_its_heading(self):
        self.passes("[b](other.md#the-other-page-1-2) [c](other.md#twice) [d](other.md#twice-1)")
        self.fails("[b](other.md#twice-2)", "other.md has no heading #twice-2")
        self.fails("# A\n[b](#b)", "this page has no heading #b")
        self.fails("```\n# A\n```\n[b](#a)", "this page has no heading #a")

    def test_code_holds_no_links(self):
        self.passes("`[b](gone.md)` and\n```\n[b](gone.md)\n```\n")

    def test_a_link_stays_in_the_project(self):
        self.fails("[b](../../)", "outside the project")


if __name__ == "__main__":
    unittest.main()
