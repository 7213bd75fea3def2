#!/usr/bin/env python3
"""Prints the licence texts of everything that is linked into the packaged programs: licences.py PACKAGE...

The output is `third-party-licences.txt` of the package, beside `LICENSE-APACHE` and `copyright`, to which it refers.
"""

import json
import pathlib
import subprocess
import sys

# A file is a licence text if its name begins with one of these, in any case.
BEGINNINGS = ("license", "licence", "copying", "copyright", "notice", "unlicense")
# Of the packaged programs: `just programs`.
FEATURES = "tactus/tls,tactus-daemon/tls"
CODE = {".rs", ".c", ".h", ".py", ".sh"}
# Where crates keep licence texts: theirs at the top, those of sources that they contain below.
FOLDERS = ("*", "*/*", "src/**/*", "third_party/**/*")

# For crates that contain no licence text: the licence under which they are used, in order of preference.
USED_UNDER = {
    "Apache-2.0": "the Apache License 2.0, whose text is in `LICENSE-APACHE` beside this file",
    "MIT": "the MIT License. Its text is that in `copyright` beside this file, with the copyright above",
    "BSD-2-Clause": """the BSD 2-Clause License:

Redistribution and use in source and binary forms, with or without modification, are permitted provided that the following
conditions are met:

1. Redistributions of source code must retain the above copyright notice, this list of conditions and the following disclaimer.

2. Redistributions in binary form must reproduce the above copyright notice, this list of conditions and the following disclaimer
   in the documentation and/or other materials provided with the distribution.

THIS SOFTWARE IS PROVIDED BY THE COPYRIGHT HOLDERS AND CONTRIBUTORS "AS IS" AND ANY EXPRESS OR IMPLIED WARRANTIES, INCLUDING, BUT
NOT LIMITED TO, THE IMPLIED WARRANTIES OF MERCHANTABILITY AND FITNESS FOR A PARTICULAR PURPOSE ARE DISCLAIMED. IN NO EVENT SHALL
THE COPYRIGHT HOLDER OR CONTRIBUTORS BE LIABLE FOR ANY DIRECT, INDIRECT, INCIDENTAL, SPECIAL, EXEMPLARY, OR CONSEQUENTIAL DAMAGES
(INCLUDING, BUT NOT LIMITED TO, PROCUREMENT OF SUBSTITUTE GOODS OR SERVICES; LOSS OF USE, DATA, OR PROFITS; OR BUSINESS
INTERRUPTION) HOWEVER CAUSED AND ON ANY THEORY OF LIABILITY, WHETHER IN CONTRACT, STRICT LIABILITY, OR TORT (INCLUDING NEGLIGENCE
OR OTHERWISE) ARISING IN ANY WAY OUT OF THE USE OF THIS SOFTWARE, EVEN IF ADVISED OF THE POSSIBILITY OF SUCH DAMAGE""",
}

# The page of tactus-web has JavaScript of others, which no crate holds.
PAGE_LICENCES = pathlib.Path(__file__).resolve().parents[1] / "crates/tactus-web/page/vendor/LICENCES.txt"

LIBUSB_CRATE = "libusb1-sys"
# The crate states the licence of its bindings only: docs/decisions/0015-libusb-and-hidapi.md.
LIBUSB_LICENCE = "MIT AND LGPL-2.1-or-later"
LIBUSB_NOTE = """The programs contain libusb, which is linked statically. libusb is covered by the GNU Lesser General Public License,
version 2.1 or later, whose text follows. You may change libusb and relink the programs with your version:

1. Get the source of Tactus {version} ({repository}) and that of the crate {crate} {crate_version}
   (https://crates.io/crates/{crate}/{crate_version}). The crate's folder `libusb` is the source of libusb.
2. Change libusb there, and add to the `Cargo.toml` of Tactus:

       [patch.crates-io]
       {crate} = {{ path = "FOLDER OF THE CRATE" }}

3. Build the programs: `just programs`.

Instead, you may link the system's libusb: remove `vendored` from the features of `rusb` in that `Cargo.toml`. The licence of Tactus
allows changes for your own use, and reverse engineering to debug them."""


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
    """The licence texts that a crate contains, or a reference to that of the licence under which it is used."""
    folder = pathlib.Path(package["manifest_path"]).parent
    files = [path for pattern in FOLDERS for path in sorted(folder.glob(pattern)) if path.is_file()]
    licences = [path for path in files if path.name.lower().startswith(BEGINNINGS) and path.suffix not in CODE]
    if not licences:
        authors = ", ".join(package["authors"]) or "its authors"
        source = package["repository"] or f"https://crates.io/crates/{package['name']}"
        choices = package["license"].replace("/", " ").split()
        used_under = next((text for licence, text in USED_UNDER.items() if licence in choices), None)
        if used_under is None:
            sys.exit(f"{package['name']} contains no licence text, and packaging/licences.py none for {package['license']}")
        return f"Copyright: {authors}. Source: {source}. The crate contains no licence text. It is used under {used_under}."
    return "\n\n".join(path.read_text(errors="replace").strip() for path in dict.fromkeys(licences))


def libusb(package, tactus):
    """The licence texts of libusb and its bindings, who wrote libusb, and how to relink it."""
    folder = pathlib.Path(package["manifest_path"]).parent / "libusb"
    holders = (folder / "AUTHORS").read_text().split("\n\n")[0]
    note = LIBUSB_NOTE.format(
        version=tactus["version"], repository=tactus["repository"], crate=package["name"], crate_version=package["version"]
    )
    return f"{note}\n\nlibusb: {holders}\n\n{texts(package)}"


def main():
    resolved = metadata()
    ids = linked(resolved, set(sys.argv[1:]))
    crates_of_text = {}
    [tactus] = [package for package in resolved["packages"] if package["name"] == "tactus"]
    for package in sorted(resolved["packages"], key=lambda package: package["name"]):
        if package["id"] in ids and package["source"] is not None:
            is_libusb = package["name"] == LIBUSB_CRATE
            licence = LIBUSB_LICENCE if is_libusb else package["license"] or "see below"
            text = libusb(package, tactus) if is_libusb else texts(package)
            crates_of_text.setdefault(text, []).append(f"{package['name']} {package['version']} ({licence})")
    print("Third-party code that is linked into the programs of Tactus, with its licences.")
    for text, crates in crates_of_text.items():
        print("\n" + "".join(f"\n# {crate}" for crate in crates) + f"\n\n{text}")
    print("\n\n# The libraries of the dashboard's page\n\n" + PAGE_LICENCES.read_text().strip())


main()
