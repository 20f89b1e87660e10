#!/usr/bin/env python3
"""Writes what is made from firmware/params/parameters.yaml: C tables, EDS, DBC, documents, constants of the host tool.

usage: tools/gen_dictionary.py [--check]

--check writes nothing and fails when a file is not what the source says. The generated files are committed, so that
building needs no Python. Needs PyYAML and Jinja2: python3-yaml, python3-jinja2.
"""
import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
from dictionary import generate  # noqa: E402
from dictionary.source import SourceError  # noqa: E402


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="only compare")
    arguments = parser.parse_args()
    try:
        files = generate.files()
    except SourceError as error:
        print(error, file=sys.stderr)
        return 1
    stale = [path for path, data in files.items() if not generate.same(path, data)]
    for path in stale:
        if arguments.check:
            print(f"{path} is not what parameters.yaml says; run tools/gen_dictionary.py", file=sys.stderr)
        else:
            generate.write(path, files[path])
            print(f"wrote {path}")
    return 1 if arguments.check and stale else 0


if __name__ == "__main__":
    sys.exit(main())
