"""check_lengths.py measures what it should."""
import contextlib
import io
import pathlib
import tempfile
import unittest

import check_lengths


def body(lines):
    return "  work();\n" * lines


class Lengths(unittest.TestCase):
    def said_of(self, name, text):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "base" / name
            path.parent.mkdir()
            path.write_text(text)
            out = io.StringIO()
            with contextlib.redirect_stdout(out):
                status = check_lengths.main(pathlib.Path(folder))
        return status, out.getvalue()

    def test_a_function_of_60_lines_is_allowed_and_of_61_refused(self):
        for head in ("void f()", "A::A(int n) : n_(n)", "template <class T>\nvoid f(T t)", "TEST(A, B)",
                     "static const std::map<int, int> f(struct g* h)"):
            lines = 60 - head.count("\n") - 2
            self.assertEqual(self.said_of("a.cpp", f"{head} {{\n{body(lines)}}}\n")[0], 0, head)
            status, text = self.said_of("a.cpp", f"int x;\n{head} {{\n{body(lines + 1)}}}\n")
            self.assertEqual(status, 1, head)
            self.assertIn("base/a.cpp:2: ", text)
            self.assertIn("has 61 lines, at most 60", text)

    def test_a_class_and_a_namespace_may_be_longer_than_their_functions(self):
        inner = f"  void f() {{\n{body(50)}  }}\n"
        self.assertEqual(self.said_of("a.hpp", f"namespace a {{\nclass A final : public B<int()> {{\n{inner * 3}}};\n}}\n")[0],
                         0)

    def test_braces_in_text_and_comments_do_not_count(self):
        odd = "  s = \"{ \\\" {\"; c = '{'; n = 1'000'000;  // {\n  t = R\"({\"{)\"; /* {{ */\n"
        status, text = self.said_of("a.cpp", f"#define OPEN {{\nvoid f() {{\n{odd}{body(56)}}}\nvoid g() {{\n{body(59)}}}\n")
        self.assertEqual((status, text), (1, "base/a.cpp:62: void g() has 61 lines, at most 60\n"))

    def test_a_lambda_counts_with_the_function_that_holds_it(self):
        text = f"void f() {{\n  const auto g = [&](int n) {{\n{body(57)}  }};\n}}\n"
        self.assertEqual(self.said_of("a.cpp", text)[1], "base/a.cpp:1: void f() has 61 lines, at most 60\n")

    def test_python_counts_too(self):
        self.assertEqual(self.said_of("a.py", "def f():\n" + "    work()\n" * 59)[0], 0)
        self.assertEqual(self.said_of("a.py", "def f():\n" + "    work()\n" * 60),
                         (1, "base/a.py:1: f has 61 lines, at most 60\n"))

    def test_a_file_has_at_most_400_lines(self):
        rest = "int x;\n" * 397
        self.assertEqual(self.said_of("a.cpp", "void f() {\n  work();\n}\n" + rest)[0], 0)
        self.assertEqual(self.said_of("a.cpp", "void f() {\n  work();\n}\n\n" + rest),
                         (1, "base/a.cpp: 401 lines, at most 400\n"))


if __name__ == "__main__":
    unittest.main()
