#!/usr/bin/env python3
"""Looks for cracks: samples of a shared edge whose positions differ between its two faces.

    check_cracks.py --tool build/patchsurf [--rates 1-33] [--flip] MESH.obj...
    check_cracks.py --csv SAMPLES.csv --rates R [--flip] MESH.obj

Reads the mesh itself and what `patchsurf sample` prints for it, and shares no code with either. A
position is compared as text: nine significant digits identify a 32-bit float, and the script makes
sure that all of them are there. Compared are all edges with two faces, and the lines between the
sectors of faces with five corners and more.

--flip changes the lowest bit of one coordinate before comparing: the check must then fail.
Exit status: 0 no crack, 1 cracks, 2 the input is not what it should be.
"""

import argparse
import math
import struct
import subprocess
import sys


class BadInput(Exception):
    pass


def read_faces(path):
    """The faces of an OBJ file, as lists of vertex numbers from 0."""
    vertices, faces = 0, []
    with open(path, encoding="latin-1", newline=None) as file:
        lines = file.read().replace("\\\n", " ").split("\n")
    for line in lines:
        words = line.split()
        if words[:1] == ["v"]:
            vertices += 1
        elif words[:1] == ["f"]:
            refs = [int(word.split("/")[0]) for word in words[1:]]
            faces.append([ref - 1 if ref > 0 else vertices + ref for ref in refs])
    return faces


def triangle_line(rate, i, j):
    """Line of grid point u = i/rate, v = j/rate in a triangle's block, v outer, u inner."""
    return j * (rate + 1) - j * (j - 1) // 2 + i


def sector_lines(rate):
    return (rate + 1) * (rate + 2) // 2


def block_lines(size, rate):
    """Lines of a face with so many corners."""
    if size == 3:
        return sector_lines(rate)
    if size == 4:
        return (rate + 1) * (rate + 1)
    return size * sector_lines(rate)


def edge_lines(size, edge, rate):
    """(line in the block, sector, i, j) of samples 0..rate from corner `edge` to the next."""
    steps = range(rate + 1)
    if size == 4:
        points = [[(t, 0) for t in steps], [(rate, t) for t in steps],
                  [(rate - t, rate) for t in steps], [(0, rate - t) for t in steps]][edge]
        return [(j * (rate + 1) + i, 0, i, j) for i, j in points]
    if size == 3:
        sector = 0
        points = [[(t, 0) for t in steps], [(rate - t, t) for t in steps],
                  [(0, rate - t) for t in steps]][edge]
    else:
        sector = edge
        points = [(rate - t, t) for t in steps]
    first = sector * sector_lines(rate)
    return [(first + triangle_line(rate, i, j), sector, i, j) for i, j in points]


def seam_lines(size, corner, rate):
    """The line from a corner to the centre, in the sector after it and in the one before it."""
    before = (corner - 1) % size
    count = sector_lines(rate)
    after_side = [(corner * count + triangle_line(rate, t, 0), corner, t, 0)
                  for t in range(rate + 1)]
    before_side = [(before * count + triangle_line(rate, 0, t), before, 0, t)
                   for t in range(rate + 1)]
    return after_side, before_side


def as_float32(number):
    return struct.unpack("<f", struct.pack("<f", number))[0]


class Samples:
    """The lines of a `patchsurf sample` file, by face."""

    def __init__(self, text, faces, rate):
        lines = text.replace("\r", "").split("\n")
        if lines and lines[-1] == "":
            lines.pop()
        if not lines or not lines[0].startswith("face,sector,u,v,x,y,z,nx,ny,nz"):
            raise BadInput("no header line face,sector,u,v,x,y,z,nx,ny,nz")
        self.lines, self.rate, self.starts = lines, rate, []
        start = 1
        for face in faces:
            self.starts.append(start)
            start += block_lines(len(face), rate)
        if start != len(lines):
            raise BadInput("%d lines, not the %d of rate %d" % (len(lines), start, rate))

    def position(self, face, place):
        """x, y, z of a sample as text, after making sure that the line is that sample's."""
        line, sector, i, j = place
        number = self.starts[face] + line
        fields = self.lines[number].split(",")
        where = "line %d" % (number + 1)
        if fields[:2] != [str(face), str(sector)]:
            raise BadInput("%s: not face %d sector %d" % (where, face, sector))
        for text, want in ((fields[2], i / self.rate), (fields[3], j / self.rate)):
            if not abs(float(text) - want) < 1e-6:
                raise BadInput("%s: parameter %s, not %.9g" % (where, text, want))
        for text in fields[4:7]:
            value = float(text)
            if not math.isfinite(value):
                raise BadInput("%s: %s is not finite" % (where, text))
            if "%.9g" % as_float32(value) != text:
                raise BadInput("%s: %s is not a 32-bit float with 9 digits" % (where, text))
        return fields[4:7]

    def flip(self, face, place):
        """Changes the lowest bit of a sample's x."""
        number = self.starts[face] + place[0]
        fields = self.lines[number].split(",")
        bits = struct.unpack("<I", struct.pack("<f", float(fields[4])))[0] ^ 1
        fields[4] = "%.9g" % struct.unpack("<f", struct.pack("<I", bits))[0]
        self.lines[number] = ",".join(fields)


def shared_sides(faces):
    """Pairs ((face, edge), (face, edge)): two sides of an edge, which run against each other."""
    sides = {}
    for number, face in enumerate(faces):
        for edge, start in enumerate(face):
            ends = (start, face[(edge + 1) % len(face)])
            sides.setdefault(frozenset(ends), []).append((ends, number, edge))
    pairs = []
    for uses in sides.values():
        if len(uses) == 2 and uses[0][0] == uses[1][0][::-1]:
            pairs.append((uses[0][1:], uses[1][1:]))
        elif len(uses) != 1:
            raise BadInput("edge %d-%d is not used once from each side" % uses[0][0])
    return pairs


def compare(samples, faces, pairs, report):
    """Number of pairs of samples compared, and of those that differ."""
    rate, compared, cracks = samples.rate, 0, 0
    lines = {(size, edge): edge_lines(size, edge, rate)
             for size in set(map(len, faces)) for edge in range(size)}

    def check(face_a, places_a, face_b, places_b, what):
        nonlocal compared, cracks
        for place_a, place_b in zip(places_a, places_b):
            compared += 1
            a, b = samples.position(face_a, place_a), samples.position(face_b, place_b)
            if a != b:
                cracks += 1
                if cracks <= 3:
                    report("crack on %s: %s against %s" % (what, " ".join(a), " ".join(b)))

    for (face_a, edge_a), (face_b, edge_b) in pairs:
        check(face_a, lines[len(faces[face_a]), edge_a],
              face_b, lines[len(faces[face_b]), edge_b][::-1],
              "the edge of faces %d and %d" % (face_a, face_b))
    for number, face in enumerate(faces):
        for corner in range(len(face) if len(face) >= 5 else 0):
            after, before = seam_lines(len(face), corner, rate)
            check(number, after, number, before, "a seam of face %d" % number)
    seams = sum(len(face) for face in faces if len(face) >= 5)
    if compared != (len(pairs) + seams) * (rate + 1) or compared == 0:
        raise BadInput("compared %d samples on %d edges and %d seams" %
                       (compared, len(pairs), seams))
    return compared, cracks


def sample(tool, mesh, rate):
    command = [tool, "sample", mesh, "--rate", str(rate), "--quiet", "-o", "-"]
    run = subprocess.run(command, stdout=subprocess.PIPE, universal_newlines=True)
    if run.returncode != 0:
        raise BadInput("%s: exit status %d" % (" ".join(command), run.returncode))
    return run.stdout


def parse_rates(text):
    rates = []
    for part in text.split(","):
        first, _, last = part.partition("-")
        rates += range(int(first), int(last or first) + 1)
    return rates


def check_mesh(path, options):
    faces = read_faces(path)
    pairs = shared_sides(faces)
    compared = cracks = 0
    rates = parse_rates(options.rates)
    for rate in rates:
        if options.csv:
            with open(options.csv, encoding="ascii") as file:
                text = file.read()
        else:
            text = sample(options.tool, path, rate)
        samples = Samples(text, faces, rate)
        if options.flip:
            face, edge = pairs[len(pairs) // 2][0]
            samples.flip(face, edge_lines(len(faces[face]), edge, rate)[rate // 2])
        one, two = compare(samples, faces, pairs,
                           lambda what: print("%s, rate %d: %s" % (path, rate, what)))
        compared, cracks = compared + one, cracks + two
    print("%s: %d edges, rates %s, %d samples compared, %d cracks" %
          (path, len(pairs), options.rates, compared, cracks))
    return cracks


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    source = parser.add_mutually_exclusive_group(required=True)
    source.add_argument("--tool", help="the patchsurf tool, to sample with")
    source.add_argument("--csv", help="samples of one mesh at one rate")
    parser.add_argument("--rates", default="1-33", help="such as 8 or 1-33 or 1,2,8 (default 1-33)")
    parser.add_argument("--flip", action="store_true", help="change one bit first: must fail")
    parser.add_argument("meshes", nargs="+", metavar="MESH.obj")
    options = parser.parse_args()
    if options.csv and (len(options.meshes) != 1 or len(parse_rates(options.rates)) != 1):
        parser.error("--csv goes with one mesh and one rate")
    try:
        cracks = sum([check_mesh(path, options) for path in options.meshes])
    except (BadInput, OSError, ValueError, IndexError) as error:
        print("check_cracks: %s" % error, file=sys.stderr)
        return 2
    return 1 if cracks else 0


if __name__ == "__main__":
    sys.exit(main())
