#!/usr/bin/env python3
"""Prints the licence texts of everything that is linked into the packaged programs: licences.py PACKAGE..."""

import json
import pathlib
import subprocess
import sys

# A file is a licence text if its name begins with one of these, in any case.
BEGINNINGS = ("license", "licence", "copying", "copyright", "notice", "unlicense")
# Of the packaged programs: `just programs`.
FEATURES = "tactus/tls,tactus-daemon/tls"
CODE = {".rs", ".c", ".h", ".py", ".sh"}


def metadata():
    host = subprocess.run(["rustc", "--print", "host-tuple"], check=True, capture_output=True, text=True).stdout.strip()
    command = ["cargo", "metadata", "--format-version=1", "--locked", f"--filter-platform={host}", "--features", FEATURES]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def linked(metadata, programs):
    """The ids of all packages that the programs are built from, without those that only build scripts use."""
    nodes = {node["id"]: node for node in metadata["resolve"]["nodes"]}
    pending = [package["id"] for package in metadata["packages"] if package["name"] in programs]
    found = set()
    while pending:
        package = pending.pop()
        if package not in found:
            found.add(package)
            dependencies = nodes[package]["deps"]
            pending += [d["pkg"] for d in dependencies if any(kind["kind"] is None for kind in d["dep_kinds"])]
    return found


def texts(package):
    """The licence texts in a crate's folder and in the folders right below, where vendored C sources keep theirs."""
    folder = pathlib.Path(package["manifest_path"]).parent
    files = [path for pattern in ("*", "*/*") for path in sorted(folder.glob(pattern)) if path.is_file()]
    licences = [path for path in files if path.name.lower().startswith(BEGINNINGS) and path.suffix not in CODE]
    if not licences:
        authors = ", ".join(package["authors"]) or "its authors"
        return f"The crate contains no licence text. Copyright: {authors}. Source: {package['repository'] or 'not stated'}."
    return "\n\n".join(path.read_text(errors="replace").strip() for path in licences)


def main():
    resolved = metadata()
    ids = linked(resolved, set(sys.argv[1:]))
    crates_of_text = {}
    for package in sorted(resolved["packages"], key=lambda package: package["name"]):
        if package["id"] in ids and package["source"] is not None:
            title = f"{package['name']} {package['version']} ({package['license'] or 'see below'})"
            crates_of_text.setdefault(texts(package), []).append(title)
    print("Third-party code that is linked into the programs of Tactus, with its licences.")
    for text, crates in crates_of_text.items():
        print("\n" + "".join(f"\n# {crate}" for crate in crates) + f"\n\n{text}")


main()
