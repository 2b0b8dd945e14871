"""check_includes.py refuses what it should."""
import contextlib
import io
import pathlib
import tempfile
import unittest

import check_includes


class Includes(unittest.TestCase):
    def said_of(self, file, include):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / file
            path.parent.mkdir(parents=True)
            path.write_text(f'// A line.\n#include "{include}"\n')
            out = io.StringIO()
            with contextlib.redirect_stdout(out):
                status = check_includes.main(pathlib.Path(folder))
        return status, out.getvalue()

    def test_down_the_tables_is_allowed(self):
        for file, include in (("daemon/a.cpp", "estimator/model/model.hpp"), ("drivers/sim/a.hpp", "sim/plant.hpp"),
                              ("estimator/paper/a.cpp", "estimator/solve/time/b.hpp"),
                              ("estimator/math/a.cpp", "estimator/math/b.hpp")):
            self.assertEqual(self.said_of(file, include)[0], 0, file)

    def test_up_between_rooms_is_refused(self):
        self.assertEqual(self.said_of("sim/a.cpp", "estimator/model/model.hpp"),
                         (1, "sim/a.cpp:2: sim/ may not include estimator/\n"))

    def test_up_inside_the_estimator_is_refused(self):
        self.assertEqual(self.said_of("estimator/math/a.cpp", "estimator/paper/b.hpp"),
                         (1, "estimator/math/a.cpp:2: estimator/math/ may not include estimator/paper/\n"))
        self.assertEqual(self.said_of("estimator/a.cpp", "estimator/paper/b.hpp"),
                         (1, "estimator/a.cpp:2: estimator/ may not include estimator/paper/\n"))

    def test_up_inside_a_room_is_refused(self):
        self.assertEqual(self.said_of("estimator/model/effects/a.cpp", "estimator/model/model.hpp"),
                         (1, "estimator/model/effects/a.cpp:2: estimator/model/effects/ may not include "
                             "estimator/model/\n"))
        self.assertEqual(self.said_of("estimator/model/instrument/a.cpp", "estimator/model/effects/b.hpp")[0], 0)

    def test_an_internal_header_is_for_its_room_alone(self):
        self.assertEqual(self.said_of("cli/a.cpp", "estimator/drop/internal/b.hpp"),
                         (1, "cli/a.cpp:2: estimator/drop/internal/b.hpp is internal to its room\n"))
        self.assertEqual(self.said_of("estimator/drop/a.cpp", "estimator/fit/internal/b.hpp")[0], 1)
        self.assertEqual(self.said_of("estimator/fit/a.cpp", "estimator/fit/internal/b.hpp")[0], 0)
        self.assertEqual(self.said_of("estimator/diagnosis/noise/a.cpp", "estimator/diagnosis/fit/internal/b.hpp")[0], 0)

    def test_up_between_the_folders_of_a_room_is_refused(self):
        self.assertEqual(self.said_of("estimator/diagnosis/fit/a.cpp", "estimator/diagnosis/noise/internal/b.hpp"),
                         (1, "estimator/diagnosis/fit/a.cpp:2: estimator/diagnosis/fit/ may not include "
                             "estimator/diagnosis/noise/\n"))
        for file, include in (("noise/a.cpp", "campaign.hpp"), ("a.cpp", "report/internal/b.hpp"),
                              ("fit/a.cpp", "fit/internal/b.hpp")):
            self.assertEqual(self.said_of(f"estimator/diagnosis/{file}", f"estimator/diagnosis/{include}")[0], 0, file)

    def test_a_new_inner_room_needs_a_row(self):
        status, text = self.said_of("estimator/new/a.cpp", "estimator/math/b.hpp")
        self.assertEqual(status, 1)
        self.assertIn("has no row", text)

    def test_rooms_that_may_include_each_other_are_refused(self):
        self.assertEqual(check_includes.up({"math": set(), "fit": {"math"}, "time": {"math", "fit"}}), [])
        self.assertEqual(check_includes.up({"math": set(), "fit": {"inference"}, "inference": {"fit"}}),
                         ["the row of fit in check_includes.py names inference, which is not above it"])


if __name__ == "__main__":
    unittest.main()
