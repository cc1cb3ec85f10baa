#!/usr/bin/env python3
"""Counts what a mesh is made of, and compares with `patchsurf info --json`.

    count_mesh.py [--tool build/patchsurf] MESH.obj...

Without --tool it prints its own counts. It works from the definitions alone, with sets and
dictionaries, and shares no code with the library:

    ring        a vertex with a fan of faces connected through edges; a vertex can have several
    n_eff       closed ring: its faces k; open: 2k, and 4 where k = 1, which is a corner
    ngon        a face with six corners or more, or at a closed ring of two faces: it is split into
                triangles round its centre before the others are classified
    ordinary    a quad, all of whose corners have n_eff 4
    polar       a triangle at a polar vertex: all faces there are triangles of one closed ring, all
                neighbours have n_eff 4, and none of them is such a vertex as well
    p3 p4 p5    the others
"""

import argparse
import json
import subprocess
import sys

KEYS = ("vertices faces edges boundary_edges components max_valence "
        "ordinary polar p3 p4 p5 ngon valence2").split()


def read_obj(path):
    """Number of vertices, and the faces as lists of vertex numbers from 0."""
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
    return vertices, faces


class Rings:
    """The fans round the vertices of a list of faces."""

    def __init__(self, faces):
        self.faces = faces
        self.edge_faces = {}
        self.at_vertex = {}
        for number, face in enumerate(faces):
            for corner, vertex in enumerate(face):
                ends = frozenset((vertex, face[(corner + 1) % len(face)]))
                self.edge_faces.setdefault(ends, []).append(number)
                self.at_vertex.setdefault(vertex, []).append(number)
        self.fans = {vertex: self.split_fans(vertex) for vertex in self.at_vertex}

    def split_fans(self, vertex):
        """The faces at a vertex as sets, connected through the edges at the vertex."""
        left, fans = set(self.at_vertex[vertex]), []
        while left:
            fan, reach = set(), [left.pop()]
            while reach:
                face = reach.pop()
                fan.add(face)
                for other in self.across(vertex, face):
                    if other in left:
                        left.discard(other)
                        reach.append(other)
            fans.append(fan)
        return fans

    def across(self, vertex, face):
        for end in self.neighbours(vertex, face):
            for other in self.edge_faces[frozenset((vertex, end))]:
                if other != face:
                    yield other

    def neighbours(self, vertex, face):
        """The vertices before and after a vertex in a face."""
        corners = self.faces[face]
        at = corners.index(vertex)
        return corners[at - 1], corners[(at + 1) % len(corners)]

    def fan(self, vertex, face):
        return next(fan for fan in self.fans[vertex] if face in fan)

    def closed(self, vertex, fan):
        return all(len(self.edge_faces[frozenset((vertex, end))]) == 2
                   for face in fan for end in self.neighbours(vertex, face))

    def n_eff(self, vertex, face):
        fan = self.fan(vertex, face)
        if self.closed(vertex, fan):
            return len(fan)
        return 4 if len(fan) == 1 else 2 * len(fan)

    def valence(self, vertex):
        return len({end for face in self.at_vertex[vertex]
                    for end in self.neighbours(vertex, face)})

    def pole_candidate(self, vertex, face):
        fan = self.fan(vertex, face)
        return (self.closed(vertex, fan)
                and all(len(self.faces[other]) == 3 for other in fan)
                and all(self.n_eff(end, other) == 4
                        for other in fan for end in self.neighbours(vertex, other)))

    def polar_vertex(self, vertex, face):
        return (self.pole_candidate(vertex, face)
                and not any(self.pole_candidate(end, other) for other in self.fan(vertex, face)
                            for end in self.neighbours(vertex, other)))


def classify(rings, face):
    corners = rings.faces[face]
    if len(corners) == 4 and all(rings.n_eff(vertex, face) == 4 for vertex in corners):
        return "ordinary"
    if len(corners) == 3 and any(rings.polar_vertex(vertex, face) for vertex in corners):
        return "polar"
    return "p%d" % len(corners)


def count_components(faces):
    """Sets of faces connected through vertices."""
    root = {}

    def find(item):
        while root.setdefault(item, item) != item:
            root[item] = root[root[item]]
            item = root[item]
        return item

    for face in faces:
        for vertex in face[1:]:
            root[find(vertex)] = find(face[0])
    return len({find(face[0]) for face in faces})


def count(vertices, faces):
    rings = Rings(faces)
    valence2 = {(vertex, face) for vertex, fans in rings.fans.items() for fan in fans
                if len(fan) == 2 and rings.closed(vertex, fan) for face in fan}
    ngons = {face for face, corners in enumerate(faces) if len(corners) >= 6}
    ngons |= {face for vertex, face in valence2}

    split, origin = [], []
    for number, corners in enumerate(faces):
        if number in ngons:
            centre = vertices + number
            split += [[corners[i - 1], corners[i], centre] for i in range(len(corners))]
            origin += [None] * len(corners)
        else:
            split.append(corners)
            origin.append(number)

    result = dict.fromkeys(KEYS, 0)
    result["vertices"] = vertices
    result["faces"] = len(faces)
    result["edges"] = len(rings.edge_faces)
    result["boundary_edges"] = sum(len(uses) == 1 for uses in rings.edge_faces.values())
    result["components"] = count_components(faces)
    result["max_valence"] = max(map(rings.valence, rings.at_vertex))
    result["ngon"] = len(ngons)
    result["valence2"] = len(valence2) // 2
    pieces = Rings(split) if ngons else rings
    for number, face in enumerate(origin):
        if face is not None:
            result[classify(pieces, number)] += 1
    return result


def compare(path, counts, tool):
    """True if the tool's counts are the same."""
    run = subprocess.run([tool, "info", path, "--json"], stdout=subprocess.PIPE)
    if run.returncode != 0:
        print("%s: patchsurf info: exit status %d" % (path, run.returncode))
        return False
    theirs = json.loads(run.stdout.decode("ascii"))
    wrong = [key for key in KEYS if theirs.get(key) != counts[key]]
    for key in wrong:
        print("%s: %s: patchsurf info says %s, counted %d" %
              (path, key, theirs.get(key), counts[key]))
    if not wrong:
        print("%s: %d counts agree" % (path, len(KEYS)))
    return not wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--tool", help="the patchsurf tool to compare with")
    parser.add_argument("meshes", nargs="+", metavar="MESH.obj")
    options = parser.parse_args()
    good = True
    for path in options.meshes:
        counts = count(*read_obj(path))
        print("%s: %s" % (path, " ".join("%s %d" % (key, counts[key]) for key in KEYS)))
        if options.tool:
            good = compare(path, counts, options.tool) and good
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
