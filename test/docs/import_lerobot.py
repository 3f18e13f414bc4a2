"""Whether PyPI is there for the reader of docs/import_lerobot.md. Run by run_page.py; exit 77 means skipped.

usage: import_lerobot.py SOURCE_DIR SCRATCH_DIR
"""
import pathlib
import sys

SOURCE, SCRATCH = (pathlib.Path(a) for a in sys.argv[1:3])
sys.path.insert(0, str(SOURCE / "test/install"))
from python_packages import SKIPPED, python_with  # noqa: E402  # pylint: disable=wrong-import-position

if python_with(SCRATCH.parents[1] / "venv-lerobot", "pyarrow", "av", "numpy", "lcm") is None:
    sys.exit(SKIPPED)
