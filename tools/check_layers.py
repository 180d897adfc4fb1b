#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Checks that no file includes a layer which its own layer does not declare in CMakeLists.txt, nor
a private header (one under src/) of another layer, nor a library that only one layer may know; that
public headers include only libraries that their layer, or one below it, hands on to its users; and
that no library knows an option of the command: no string in src/ and include/ has "--word" in it.

Usage: tools/check_layers.py [ROOT]
Exit status: 0 all well, 1 a rule is broken (one line each: file:line: what is wrong).
"""
import pathlib
import re
import sys

LAYER = re.compile(r"^\s*risley_add_layer\(\s*(\w+)(?:\s+LAYERS\s+([\w\s]*))?\)", re.MULTILINE)
NEEDS = re.compile(r"^\s*risley_layer_needs\(\s*(\w+)\s+PUBLIC\s+([a-z0-9\s-]*)", re.MULTILINE)
INCLUDE = re.compile(r'^\s*#\s*include\s*["<]([^">]+)[">]')
STRING = re.compile(r'"((?:[^"\\]|\\.)*)"')
FLAG = re.compile(r"(?<![\w-])--[a-z][a-z0-9-]*")
PROGRAMS = ("apps", "studies", "bench")  # may use every layer
MEASURING = ("bench",)  # programs that measure what is private, as tests test it
BINDINGS = "python"  # src/python: may use every layer's public headers, and nothing may use it
# Libraries with one home: what others need of them, they ask that layer for.
HOMES = {"netcdf": "tables", "hdf5": "tables", "sqlite3": "tables", "openssl": "hashes", "yaml-cpp": "io",
         "pcap": "recordings", "proj": "cloud", "proj_experimental": "cloud", "pybind11": BINDINGS,
         "tbb": "parallel", "oneapi": "parallel"}
# Packages of risley_layer_needs by how their headers are included.
PACKAGES = {"Eigen": "eigen", "fmt": "fmt", "xsimd": "xsimd", "nlohmann": "nlohmann-json", "Random123": "random123",
            **{library: library for library in HOMES}}
LIMITED_BY_PROGRAMS = ("tbb",)  # whose threads they may limit
STRANGERS = ("simulation", "estimation")  # they meet only in tests, so their agreement counts


def declared_layers(cmake_text):
    """{layer: set of the layers it may include}, lowest layer first."""
    return {name: set((below or "").split()) for name, below in LAYER.findall(cmake_text)}


def exported_packages(layers, cmake_text):
    """{layer: packages that it and those below it hand on to their users}"""
    exported = {}
    public = {name: set(packages.split()) for name, packages in NEEDS.findall(cmake_text)}
    for name, below in layers.items():
        exported[name] = public.get(name, set()).union(*(exported.get(layer, set()) for layer in below))
    return exported


def check_declarations(layers):
    """Errors within the list itself: an unknown or later layer, strangers that are linked."""
    errors = []
    known = {}  # layer: everything it reaches
    for name, below in layers.items():
        for layer in sorted(below - known.keys()):
            errors.append(f"CMakeLists.txt: {name} declares {layer}, which does not stand above it")
        known[name] = below.union(*(known.get(layer, set()) for layer in below))
    for one, other in (STRANGERS, STRANGERS[::-1]):
        if other in known.get(one, set()):
            errors.append(f"CMakeLists.txt: {one} reaches {other}; the two must stay strangers")
    return errors


def included_layer(include, layers):
    """The layer that an #include names, and whether it names a private header of it; None for a
    library or a neighbour."""
    parts = include.split("/")
    if parts[0] == "risley" and len(parts) > 2:
        return parts[1], False
    private = len(parts) > 1 and (parts[0] in layers or parts[0] == BINDINGS)
    return (parts[0], True) if private else (None, False)


def flags_in(line):
    """Options of a command that the strings of a line of C++ name; comments do not count."""
    flags = []
    for match in STRING.finditer(line):
        if "//" in STRING.sub('""', line[:match.start()]):
            break
        flags += FLAG.findall(match.group(1))
    return flags


def library_of(include):
    """The library among PACKAGES that an #include names, or None."""
    name = include.split("/")[0].removesuffix(".h")
    return name if name in PACKAGES else None


def check_file(path, shown, own, allowed, layers, exported):
    """@param own  the file's layer; None in programs, which may know options
    @param exported  packages whose headers it may include; None: those of all"""
    errors = []
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        match = INCLUDE.match(line)
        if not match:
            if own is not None:
                errors += [f"{shown}:{number}: a library knows no {flag}, say \"option NAME\""
                           for flag in flags_in(line)]
            continue
        include = match.group(1)
        if ".." in include.split("/"):
            errors.append(f'{shown}:{number}: "{include}" hides its layer, name it from the root')
            continue
        library = library_of(include)
        home = HOMES.get(library, own)
        if own != home and not (own is None and library in LIMITED_BY_PROGRAMS):
            errors.append(f"{shown}:{number}: only the layer {home} may include {include}")
        elif library and exported is not None and PACKAGES[library] not in exported:
            errors.append(f"{shown}:{number}: the layer {own} does not hand on {include} to its users")
        layer, private = included_layer(include, layers)
        if layer is None or layer == own == BINDINGS:
            continue
        if layer == BINDINGS:
            errors.append(f"{shown}:{number}: nothing may include the bindings ({include})")
        elif layer not in layers:
            errors.append(f"{shown}:{number}: {include} is in no declared layer")
        elif layer not in allowed:
            errors.append(f"{shown}:{number}: may not include the layer {layer} ({include})")
        elif private and shown.parts[0] not in MEASURING and (layer != own or shown.parts[0] == "include"):
            errors.append(f"{shown}:{number}: {include} is a private header of the layer {layer}")
    return errors


def check(root):
    """Every error of the tree under root, as text."""
    cmake_text = (root / "CMakeLists.txt").read_text(encoding="utf-8")
    layers = declared_layers(cmake_text)
    exported = exported_packages(layers, cmake_text)
    if not layers:
        return ["CMakeLists.txt: no risley_add_layer found"]
    errors = check_declarations(layers)
    for top in (root / "include/risley", root / "src"):
        for folder in sorted(entry for entry in top.glob("*") if entry.is_dir()):
            if folder.name not in layers and folder != root / "src" / BINDINGS:
                errors.append(f"{folder.relative_to(root)}: the folder is no declared layer")
    for folder in ("include/risley", "src", *PROGRAMS):
        for path in sorted((root / folder).rglob("*.[ch]pp")):
            shown = path.relative_to(root)
            layer = None if folder in PROGRAMS else path.relative_to(root / folder).parts[0]
            if layer is None or (folder, layer) == ("src", BINDINGS):
                allowed = layers.keys()
            elif layer in layers:
                allowed = layers[layer] | {layer}
            else:
                continue
            errors += check_file(path, shown, layer, allowed, layers,
                                 exported.get(layer) if folder == "include/risley" else None)
    return errors


def main():
    root = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else pathlib.Path(__file__).parents[1]
    errors = check(root)
    print("\n".join(errors) if errors else "check_layers: every include points downwards")
    return 1 if errors else 0


if __name__ == "__main__":
    sys.exit(main())
