"""As sanitized.hpp, for scripts: ctest says where the programs run under a sanitizer."""
import os

SANITIZED = "SHAKER_SANITIZED" in os.environ


def some(cases, count=1):
    """All cases; under a sanitizer the first `count`, since one takes the path that all take."""
    return list(cases)[:count] if SANITIZED else list(cases)
