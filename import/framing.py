"""What the readers of this folder write: records on standard output, read by src/imports/record_stream.cpp.

A record is two unsigned 32-bit numbers, little-endian: the bytes of its header and those of its payload; then the
header, a JSON object in UTF-8 with at least "kind", and the payload. The last record's kind is "end" or "error"; a
stream without either was cut short.
"""
import json
import os
import struct
import sys

_SIZES = struct.Struct("<II")


class Records:
    """Writes records; nothing else may be written to standard output."""

    def __init__(self):
        self._out = os.fdopen(os.dup(sys.stdout.fileno()), "wb", buffering=1 << 20)
        os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # what a library prints must not come between records

    def write(self, kind, payload=b"", **header):
        text = json.dumps(dict(header, kind=kind), allow_nan=False).encode()
        self._out.write(_SIZES.pack(len(text), len(payload)))
        self._out.write(text)
        self._out.write(payload)

    def flush(self):
        self._out.flush()


def numbers(values):
    """Readings as a payload: 64-bit floating point, little-endian; NaN is one that is not there."""
    values = list(values)
    return struct.pack(f"<{len(values)}d", *values)


def run(main):
    """Calls main(records). Whatever goes wrong is the last record; a reader that went away is no error."""
    records = Records()
    try:
        try:
            main(records)
            records.write("end")
        except BrokenPipeError:
            raise
        except MemoryError:
            records.write("error", message="not enough memory")
        except Exception as error:  # pylint: disable=broad-except  # damaged files raise of every kind
            text = " ".join(str(error).split()) or type(error).__name__
            records.write("error", message=text[:1000])
        records.flush()
    except BrokenPipeError:
        os._exit(1)
