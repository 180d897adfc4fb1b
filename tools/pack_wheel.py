#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Packs the tree that tools/carry_libraries.py made into a wheel. Two runs give the same bytes.

Usage: tools/pack_wheel.py TREE VERSION GLIBC FOLDER
VERSION is that of Python's packages (PEP 440); GLIBC, such as 2.36, that which the tree needs. Leaves
FOLDER/risley-VERSION-....whl. SOURCE_DATE_EPOCH dates its files.
"""
import base64
import hashlib
import os
import pathlib
import re
import sys
import time
import zipfile

ROOT = pathlib.Path(__file__).parents[1]
#: Where parts of the tree go; what none names stays out. {data} lands below the prefix of the Python.
PLACES = {"python/risley": "risley", "bin": "risley/bin", "lib": "risley/lib", "share/proj": "risley/share/proj",
          "share/rosbag_storage": "risley/share/rosbag_storage", "share/risley": "risley/share/risley",
          "share/doc/risley": "{info}/licenses",
          "share/man": "{data}/share/man", "share/bash-completion": "{data}/share/bash-completion",
          "share/zsh": "{data}/share/zsh", "share/fish": "{data}/share/fish"}
METADATA = """Metadata-Version: 2.1
Name: risley
Version: {version}
Summary: {summary}
License: MIT
Requires-Python: {pythons}
Provides-Extra: arrays
Requires-Dist: numpy; extra == "arrays"
Description-Content-Type: text/markdown

{readme}"""


def parts(tree, info, data):
    """Names in the wheel and the files that go there."""
    for place, target in PLACES.items():
        for path in sorted((tree / place).rglob("*")):
            if path.is_file():
                folder = target.format(info=info, data=data)
                yield f"{folder}/{path.relative_to(tree / place).as_posix()}", path
    yield "_risley_command.py", ROOT / "packaging/wheel/_risley_command.py"


def pack(tree, version, glibc, folder):
    """Writes the wheel. @returns its path"""
    modules = (tree / "python/risley").glob("_risley.cpython-*.so")
    minors = sorted(int(re.match(r"_risley\.cpython-3(\d+)-", path.name)[1]) for path in modules)
    pythons = [f"cp3{minor}" for minor in minors]
    platform = f"manylinux_{glibc.replace('.', '_')}_x86_64"
    gaps = [f",!=3.{minor}.*" for minor in range(minors[0], minors[-1]) if minor not in minors]
    info, data = f"risley-{version}.dist-info", f"risley-{version}.data/data"
    summary = re.search(r'DESCRIPTION "([^"]+)"', (ROOT / "CMakeLists.txt").read_text(encoding="utf-8"))[1]
    tags = "".join(f"Tag: {python}-{abi}-{platform}\n" for python in pythons for abi in pythons)
    texts = {
        f"{info}/METADATA": METADATA.format(
            version=version, summary=summary, pythons=f">=3.{minors[0]}{''.join(gaps)},<3.{minors[-1] + 1}",
            readme=(ROOT / "README.md").read_text(encoding="utf-8")),
        f"{info}/WHEEL": f"Wheel-Version: 1.0\nGenerator: scripts/wheel\nRoot-Is-Purelib: false\n{tags}",
        f"{info}/entry_points.txt": "[console_scripts]\nrisley = _risley_command:main\n",
    }
    date = time.gmtime(int(os.environ.get("SOURCE_DATE_EPOCH", time.time())))[:6]
    path = folder / f"risley-{version}-{'.'.join(pythons)}-{'.'.join(pythons)}-{platform}.whl"
    record = ""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as wheel:
        def add(name, content, mode=0o644):
            entry = zipfile.ZipInfo(name, date)
            entry.external_attr = (0o100000 | mode) << 16
            entry.compress_type = zipfile.ZIP_DEFLATED
            wheel.writestr(entry, content, compresslevel=9)

        for name, source in parts(tree, info, data):
            texts[name] = source
        for name, source in texts.items():
            content = source.encode() if isinstance(source, str) else source.read_bytes()
            runs = not isinstance(source, str) and os.access(source, os.X_OK)
            add(name, content, 0o755 if runs else 0o644)
            digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
            record += f"{name},sha256={digest},{len(content)}\n"
        add(f"{info}/RECORD", record + f"{info}/RECORD,,\n")
    return path


if __name__ == "__main__":
    if len(sys.argv) != 5:
        sys.exit(__doc__)
    print(pack(pathlib.Path(sys.argv[1]), sys.argv[2], sys.argv[3], pathlib.Path(sys.argv[4])))
