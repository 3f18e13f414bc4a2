"""Interpreters with packages from PyPI, for tests that compare with official libraries."""
import subprocess
import venv

SKIPPED = 77


# What PyPI calls a package that is imported under another name.
NAMES = {"PIL": "pillow", "yaml": "pyyaml"}


def python_with(directory, *packages):
    """An interpreter in `directory` that imports these packages, or None where they cannot be had."""
    python = directory / "bin" / "python"
    wanted = ["-c", "import " + ", ".join(packages)]
    if python.exists() and subprocess.run([python, *wanted], capture_output=True,
                                          check=False).returncode == 0:
        return python
    try:
        venv.create(directory, with_pip=True, clear=True)
        subprocess.run([python, "-m", "pip", "install", "-q", "--timeout", "10", "--retries", "1",
                        *(NAMES.get(name, name) for name in packages)], check=True, timeout=240)
    except (subprocess.SubprocessError, OSError) as error:
        print(f"PyPI's {', '.join(packages)} cannot be had here, skipped: {error}")
        return None
    return python
