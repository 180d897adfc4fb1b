#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Makes an installed tree need nothing of the system but its C and C++ library, as auditwheel does.

Usage: tools/carry_libraries.py TREE
The programs and libraries in and below TREE, bin/* and lib/*.so* and python/**/*.so, get what they are linked with
into TREE/lib, under names with a hash of the bytes, so that no other library of the process is taken for one of
them, and search there alone. PROJ's data and rosbag_storage's plugins come to TREE/share. TREE/share/doc/risley/libraries
lists what was carried, with the licences that Debian's packages state. Stand-ins of packaging/wheel/stand_ins replace
two libraries. Needs patchelf and g++. Prints the newest versions that are asked of libc and libstdc++.
"""
import argparse
import hashlib
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

#: What every Linux with Python has; the platform tag of a wheel says how new (PEP 600).
SYSTEM = re.compile(r"(ld-linux-x86-64|lib(c|m|dl|rt|pthread|resolv|util|gcc_s|stdc\+\+))\.so\.\d+")
PROJ_DATA = pathlib.Path("/usr/share/proj")
BAG_PLUGINS = pathlib.Path("/usr/share/rosbag_storage")
STAND_INS = pathlib.Path(__file__).parents[1] / "packaging/wheel/stand_ins"
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


def stand_in(name, folder):
    """Builds what replaces a library, or gives None."""
    match = re.fullmatch(r"lib(roslib|icudata)\.so\.(\w+)", name)
    if not match:
        return None
    subprocess.run(["g++", "-std=c++20", "-O1", "-fPIC", "-shared", f"-Wl,-soname,{name}",
                    f"-DICU_DATA=icudt{match[2]}_dat", STAND_INS / f"{match[1]}.cpp", "-o", folder / name], check=True)
    return folder / name


def closure(files, own, folder):
    """All libraries that files need, beside those of the system and the tree's own, by name.

    @param folder  for stand-ins
    """
    known = system_libraries()
    carried, todo = {}, list(files)
    while todo:
        user = todo.pop()
        for name in needed_by(user):
            if SYSTEM.fullmatch(name) or name in own or name in carried:
                continue
            if name not in known:
                sys.exit(f"carry_libraries: {user} needs {name}, which is not on this machine")
            carried[name] = stand_in(name, folder) or known[name].resolve()
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


def carry(tree):
    """Does what this file says. @returns the versions that are asked of the system"""
    with tempfile.TemporaryDirectory() as folder:
        return carry_with(tree, pathlib.Path(folder))


def carry_with(tree, folder):
    """The same, with a folder for stand-ins."""
    library = tree / "lib"
    library.mkdir(exist_ok=True)
    share = tree / "share"
    shutil.copytree(PROJ_DATA, share / "proj")
    shutil.copytree(BAG_PLUGINS, share / BAG_PLUGINS.name)
    plugins = {path.name: path for path in system_libraries()["libc.so.6"].resolve().parent.glob("ros/librosbag_default_*.so")}
    for name, path in plugins.items():
        shutil.copy(path, share / BAG_PLUGINS.name / name)
    files = [path for pattern in ("bin/*", "python/**/*.so", "share/rosbag_storage/*.so")
             for path in sorted(tree.glob(pattern)) if is_elf(path)]
    own = {}
    for path in sorted(library.glob("*.so*")):
        if path.is_symlink():
            path.unlink()
        else:
            own[output("patchelf", "--print-soname", path).strip()] = path
    carried = closure([*files, *own.values()], own, folder)
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
        inside = path.parent.relative_to(tree / "python/risley" if "python" in path.relative_to(tree).parts else tree)
        where = "/".join(["$ORIGIN", *[".."] * len(inside.parts), "lib"]) if path.parent != library else "$ORIGIN"
        changes = [["--force-rpath", "--set-rpath", where]]
        if path.parent == library:
            changes.append(["--set-soname", path.name])
        renamed = [["--replace-needed", name, names[name]] for name in needed_by(path) if name in names]
        if renamed:
            changes.append(sum(renamed, []))
        for change in changes:  # patchelf heeds one kind at a time
            subprocess.run(["patchelf", *change, path], check=True)
    packages = {package: {"headers"} for package in HEADERS}
    came = {**carried, **plugins, "proj.db": PROJ_DATA / "proj.db"}
    holders = packages_of(came.values())
    for name, path in came.items():
        if path in holders:
            packages.setdefault(holders[path], set()).add(name)
        elif path.parent != folder:
            sys.exit(f"carry_libraries: no package holds {path}, so that its licence is unknown")
    write_licences(tree / "share/doc/risley/libraries", packages)
    return newest_versions(files)


def main():
    """Does it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tree", type=pathlib.Path)
    for kind, version in sorted(carry(parser.parse_args().tree.resolve()).items()):
        print(f"{kind}_{version}")


if __name__ == "__main__":
    main()
