#!/usr/bin/env python3
"""Keeps what is written true to the code.

    check_docs.py [COMPILER]

- patchsurf.h is ASCII, at most 100 columns wide, without tabs, carriage returns or trailing blanks.
- Every PSURF_API function has a comment, above or beside it, that names every parameter, but for
  those of a type of the header's own: these are documented where they are declared. A first and a
  count may be called a range. Declarations without an empty line between share a comment.
- So has every struct.
- The manual (all before the API) mentions every result code and every option macro.
- The chapters of the printed table exist, in that order.
- The manual's complete program compiles without a warning and prints a mesh.
- README.md names only make targets that exist; CHANGELOG.md knows the version.
"""

import os
import re
import subprocess
import sys
import tempfile

problems = []


def problem(place, text):
    problems.append("%s: %s" % (place, text))


def read(path):
    try:
        with open(path, "rb") as file:
            return file.read().decode("utf-8")
    except OSError as error:
        problem(path, error.strerror)
        return ""


def check_form(path, text):
    for number, line in enumerate(text.split("\n"), 1):
        place = "%s:%d" % (path, number)
        if not line.isascii():
            problem(place, "not ASCII")
        if len(line) > 100:
            problem(place, "%d columns" % len(line))
        if "\t" in line or "\r" in line or line != line.rstrip():
            problem(place, "tab, carriage return or trailing blank")
    if not text.endswith("\n"):
        problem(path, "no newline at the end")


DECLARATION = re.compile(r"^PSURF_API ([^;{]*?)(psurf_\w+)\(([^;{]*?)\);([^\n]*)", re.M | re.S)
COMMENT = re.compile(r"^/\*.*?\*/", re.M | re.S)


def parameters_to_name(text):
    """Parameters whose type says nothing: numbers and arrays of numbers."""
    names = []
    for part in text.split(",") if text.strip() != "void" else []:
        own_type, name = re.match(r"\s*(?:const )?(\w+)?.*?(\w+)\s*$", part, re.S).groups()
        if own_type == "psurf_real" or not own_type.startswith("psurf_"):
            names.append(name)
    return names


def check_functions(path, text):
    functions = 0
    for found in DECLARATION.finditer(text):
        functions += 1
        name, parameters, beside = found.group(2), found.group(3), found.group(4)
        place = "%s:%d" % (path, text.count("\n", 0, found.start()) + 1)
        block = text[:found.start()].rsplit("\n\n", 1)[-1]
        above = COMMENT.findall(block)
        comment = above[-1] if above else beside
        if "/*" not in comment:
            problem(place, "%s has no comment" % name)
        for parameter in parameters_to_name(parameters):
            is_range = re.search(r"(^|_)(first|count)(_|$)", parameter) and "range" in comment
            if not is_range and not re.search(r"\b%s\b" % parameter, comment):
                problem(place, "the comment of %s does not name %s" % (name, parameter))
    if not functions:
        problem(path, "no PSURF_API function found")
    return functions


def check_structs(path, text):
    for found in re.finditer(r"^typedef struct (psurf_\w+) \{\n.*?^\}", text, re.M | re.S):
        block = text[:found.start()].rsplit("\n\n", 1)[-1]
        if not COMMENT.search(block) and "/*" not in found.group(0):
            place = "%s:%d" % (path, text.count("\n", 0, found.start()) + 1)
            problem(place, "%s has no comment, above or inside" % found.group(1))


def check_manual(path, text):
    manual, _, code = text.partition("/* >>api")
    names = re.findall(r"^\s+X\((\w+),", code, re.M)
    options = re.findall(r"^#\s*ifn?def (PSURF_[A-Z][A-Z_]*)$", code, re.M)
    options += re.findall(r"\bdefined\((PSURF_[A-Z][A-Z_]*)\)", code)
    private = ("PSURF_H_INCLUDED", "PSURF_IMPLEMENTATION_DONE")
    for name in ["PSURF_" + name for name in names] + sorted(set(options) - set(private)):
        if not re.search(r"\b(PSURF_)?%s\b" % name[6:], manual):
            problem(path, "the manual does not mention %s" % name)
    if not names:
        problem(path, "no list of results found")
    return len(names)


def check_chapters(path, text):
    table = re.search(r"^   CONTENTS.*?\n\n", text, re.M | re.S).group(0)
    listed = re.findall(r" >>(\w+) ", table)
    rulers = re.findall(r"^(?:/\*|  ) >>(\w+).* ={5,}", text, re.M)
    rulers = [name for name in rulers if name != "impl"]
    if not listed or listed != rulers:
        problem(path, "the table lists chapters %s, the rulers are %s" % (listed, rulers))


def check_program(path, text, compiler):
    """Compiles and runs what stands below A COMPLETE PROGRAM."""
    found = re.search(r"^   A COMPLETE PROGRAM.*?\n((?:\n|       .*\n)+)", text, re.M)
    if not found:
        problem(path, "the manual has no complete program")
        return
    with tempfile.TemporaryDirectory() as folder:
        source, program = os.path.join(folder, "program.c"), os.path.join(folder, "program")
        with open(source, "w") as file:
            file.write(found.group(1))
        command = [compiler, "-std=c99", "-Wall", "-Wextra", "-Werror", "-I.", source, "-o",
                   program, "-lm"]
        if subprocess.call(command) != 0:
            problem(path, "the manual's program does not compile")
            return
        lines = subprocess.check_output([program], universal_newlines=True).split("\n")
    if {line[:2] for line in lines if line} != {"v ", "f "}:
        problem(path, "the manual's program does not print a mesh")


def check_version(header, changelog):
    version = ".".join(re.search(r"#define PSURF_VERSION_%s (\d+)" % part, header).group(1)
                       for part in ("MAJOR", "MINOR", "PATCH"))
    if version not in changelog:
        problem("CHANGELOG.md", "does not know version %s" % version)


def check_targets(path, text, targets):
    code = "\n".join(re.findall(r"`[^`]+`|^    .*$", text, re.M))
    for words in re.findall(r"\bmake((?: [a-z]+)+)", code):
        for word in words.split():
            if word not in targets:
                problem(path, "make has no target %s" % word)


def main():
    header = read("patchsurf.h")
    check_form("patchsurf.h", header)
    functions = check_functions("patchsurf.h", header)
    check_structs("patchsurf.h", header.split("/* >>impl")[0])
    results = check_manual("patchsurf.h", header)
    check_chapters("patchsurf.h", header)
    check_program("patchsurf.h", header, sys.argv[1] if len(sys.argv) > 1 else "gcc")
    targets = set(re.findall(r"^([a-z]+):", read("Makefile"), re.M))
    check_targets("README.md", read("README.md"), targets)
    check_version(header, read("CHANGELOG.md"))
    for line in problems:
        print(line)
    print("%d functions, %d result codes, %d problems" % (functions, results, len(problems)))
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
