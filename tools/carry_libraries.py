#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Makes an installed tree need nothing of the system but its C and C++ library, as auditwheel does.

Usage: tools/carry_libraries.py TREE [--folder FOLDER]
The programs and libraries in and below TREE, bin/* and lib/*.so* and python/**/*.so, get what they are linked with
into TREE/lib, under names with a hash of the bytes, so that no other library of the process is taken for one of
them, and search there alone. PROJ's data comes to TREE/share/proj. TREE/share/doc/risley/libraries lists what was
carried, with the licences that Debian's packages state. --folder looks for libraries there first (stand-ins).
Needs patchelf. Prints the newest versions that are asked of libc and libstdc++.
"""
import argparse
import hashlib
import pathlib
import re
import shutil
import subprocess
import sys

#: What every Linux with Python has; the platform tag of a wheel says how new (PEP 600).
SYSTEM = re.compile(r"(ld-linux-x86-64|lib(c|m|dl|rt|pthread|resolv|util|gcc_s|stdc\+\+))\.so\.\d+")
PROJ_DATA = pathlib.Path("/usr/share/proj")
#: Debian packages whose headers are compiled into the binaries.
HEADERS = ("libeigen3-dev", "libxsimd-dev", "librandom123-dev", "nlohmann-json3-dev", "libcli11-dev", "pybind11-dev")


def output(*command):
    """What a command prints."""
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def is_elf(path):
    """Whether a file is a program or a library."""
    with open(path, "rb") as file:
        return file.read(4) == b"\x7fELF"


def needed_by(path):
    """The names of the libraries that a program or library is linked with."""
    return output("patchelf", "--print-needed", path).split()


def system_libraries():
    """Where the loader of this machine finds each name."""
    found = {}
    for line in output("/sbin/ldconfig", "-p").splitlines():
        match = re.match(r"\s*(\S+) \(libc6,x86-64[^)]*\) => (\S+)", line)
        if match:
            found.setdefault(match[1], pathlib.Path(match[2]))
    return found


def closure(files, own, folders):
    """All libraries that files need, beside those of the system and the tree's own, by name."""
    known = system_libraries()
    for folder in folders:
        known.update({path.name: path for path in folder.glob("*.so*")})
    carried, todo = {}, list(files)
    while todo:
        user = todo.pop()
        for name in needed_by(user):
            if SYSTEM.fullmatch(name) or name in own or name in carried:
                continue
            if name not in known:
                sys.exit(f"carry_libraries: {user} needs {name}, which is not on this machine")
            carried[name] = known[name].resolve()
            todo.append(carried[name])
    return carried


def hashed(name, path):
    """libfoo-0123abcd.so.1 for libfoo.so.1."""
    digest = hashlib.sha256(path.read_bytes()).hexdigest()[:8]
    stem, suffix = name.split(".so", 1)
    return f"{stem}-{digest}.so{suffix}"


def packages_of(paths):
    """The Debian package that each file came with, where there is one."""
    names = {name: path for path in paths for name in (str(path), str(path).removeprefix("/usr"))}
    found = subprocess.run(["dpkg-query", "-S", *names], check=False, capture_output=True, text=True).stdout
    lines = (re.match(r"([^:,\s]+)\S*: (/\S+)$", line) for line in found.splitlines())
    return {names[match[2]]: match[1] for match in lines if match and match[2] in names}


def write_licences(folder, packages):
    """Licences of the packages, and the list of what came of each."""
    folder.mkdir(parents=True, exist_ok=True)
    rows = []
    for package in sorted(packages):
        shutil.copy(f"/usr/share/doc/{package}/copyright", folder / f"{package}.copyright")
        source, version = output("dpkg-query", "-W", "-f", "${source:Package}\n${Version}\n", package).splitlines()[:2]
        rows.append(f"{package} {version} (source {source}): {', '.join(sorted(packages[package]))}\n")
    for licence in pathlib.Path("/usr/share/common-licenses").iterdir():  # to which the files refer
        shutil.copy(licence, folder / f"{licence.name}.txt")
    (folder / "README.txt").write_text(
        "Works of others in this folder's tree, by Debian package, whose licence stands in PACKAGE.copyright.\n"
        "Their sources: https://snapshot.debian.org, under the source and version named here.\n\n" + "".join(rows),
        encoding="utf-8")


def newest_versions(files):
    """The newest version that files ask of each of GLIBC, GLIBCXX, CXXABI and GCC."""
    newest = {}
    for path in files:
        for kind, version in re.findall(r"\((GLIBC|GLIBCXX|CXXABI|GCC)_([\d.]+)\)", output("objdump", "-T", path)):
            number = tuple(int(part) for part in version.split("."))
            newest[kind] = max(newest.get(kind, ()), number)
    return {kind: ".".join(map(str, number)) for kind, number in newest.items()}


def carry(tree, folders):
    """Does what this file says. @returns the versions that are asked of the system"""
    library = tree / "lib"
    library.mkdir(exist_ok=True)
    files = [path for path in sorted(tree.glob("bin/*")) + sorted(tree.glob("python/**/*.so")) if is_elf(path)]
    own = {}
    for path in sorted(library.glob("*.so*")):
        if path.is_symlink():
            path.unlink()
        else:
            own[output("patchelf", "--print-soname", path).strip()] = path
    carried = closure([*files, *own.values()], own, folders)
    names = {}
    for name, path in {**own, **carried}.items():
        names[name] = hashed(name, path)
        target = library / names[name]
        if name in own:
            path.rename(target)
        else:
            shutil.copy(path, target)
        target.chmod(0o755)
        files.append(target)
    for path in files:
        subprocess.run(["strip", "--strip-unneeded", path], check=True)
        where = "$ORIGIN" if path.parent == library else \
            "$ORIGIN/lib" if "python" in path.parts else "$ORIGIN/../lib"
        changes = [["--force-rpath", "--set-rpath", where]]
        if path.parent == library:
            changes.append(["--set-soname", path.name])
        renamed = [["--replace-needed", name, names[name]] for name in needed_by(path) if name in names]
        if renamed:
            changes.append(sum(renamed, []))
        for change in changes:  # patchelf heeds one kind at a time
            subprocess.run(["patchelf", *change, path], check=True)
    shutil.copytree(PROJ_DATA, tree / "share/proj")
    packages = {package: {"headers"} for package in HEADERS}
    came = {**carried, "proj.db": PROJ_DATA / "proj.db"}
    holders = packages_of(came.values())
    for name, path in came.items():
        if path in holders:
            packages.setdefault(holders[path], set()).add(name)
        elif path.parent not in folders:
            sys.exit(f"carry_libraries: no package holds {path}, so that its licence is unknown")
    write_licences(tree / "share/doc/risley/libraries", packages)
    return newest_versions(files)


def main():
    """Does it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tree", type=pathlib.Path)
    parser.add_argument("--folder", type=pathlib.Path, action="append", default=[])
    options = parser.parse_args()
    for kind, version in sorted(carry(options.tree.resolve(), [one.resolve() for one in options.folder]).items()):
        print(f"{kind}_{version}")


if __name__ == "__main__":
    main()
