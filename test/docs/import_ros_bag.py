"""What the reader of docs/import_ros_bag.md has: a bag. Run by run_page.py; exit 77 means skipped.

usage: import_ros_bag.py SOURCE_DIR SCRATCH_DIR
"""
import os
import pathlib
import subprocess
import sys

SOURCE, SCRATCH = (pathlib.Path(a) for a in sys.argv[1:3])
sys.path.insert(0, str(SOURCE / "test/install"))
from python_packages import SKIPPED, python_with  # noqa: E402  # pylint: disable=wrong-import-position

python = python_with(SCRATCH.parents[1] / "venv-ros-bag", "rosbags", "numpy", "PIL")
if python is None:
    sys.exit(SKIPPED)
subprocess.run([python, SOURCE / "test/imports/bag_of_stills.py",
                pathlib.Path(os.environ["BODYSCHEMA_DATA"]) / "real/lbr_zed5", SCRATCH / "my_bag", "mcap", "masks=1"],
               check=True)
